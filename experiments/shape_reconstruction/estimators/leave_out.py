"""Predict each contact from all others by the smooth field."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve

from experiments.shape_reconstruction.estimators.thin_plate import ThinPlateField
from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray

DOUBTFUL = 4.0
"""Standard deviations between a contact and its prediction above which it is an outlier."""

_SAME_PLACE = 1e-12


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Predictions of left-out contacts by the field.

    Attributes:
        errors: ``(contacts,)`` rms distance of each from the field fitted without it, m; zero where thinning
            kept no point of it.
        outliers: distance by the index of the touch, m, of those more than ``DOUBTFUL`` standard deviations
            off.
    """

    errors: FloatArray
    outliers: dict[int, float]


def predict_by_field(evidence: ShapeEvidence, field: ThinPlateField) -> LeftOut:
    """Predict each contact from the field without it.

    With ``P`` the inverse of the covariance, a block left out is off by ``inv(P_bb) (P y)_b``, with the
    covariance ``inv(P_bb)`` (Rasmussen and Williams, Gaussian processes for machine learning, 2006,
    section 5.4.2).
    """
    count = 4 * len(field.data.points)
    inverse = cho_solve((field.factor, True), np.eye(count), check_finite=False)
    errors, found = np.zeros(len(evidence.contacts)), {}
    for k, contact in enumerate(evidence.contacts):
        rows = _rows_of(contact.points, field)
        if len(rows) == 0:
            continue
        block = np.linalg.inv(inverse[np.ix_(rows, rows)])
        off = block @ field.weights.ravel()[rows]
        values = slice(0, None, 4)
        errors[k] = field.reach * float(np.sqrt(np.mean(off[values] ** 2)))
        mean = float(off[values].mean())
        sigma = float(np.sqrt(block[values, values].mean()))
        if abs(mean) > DOUBTFUL * sigma:
            found[contact.index] = abs(mean) * field.reach
    return LeftOut(errors, found)


def _rows_of(points: FloatArray, field: ThinPlateField) -> list[int]:
    """Numbers of the values and gradients that are a contact's."""
    apart = ((field.data.points[:, None] - points[None]) ** 2).sum(axis=2).min(axis=1)
    return [4 * int(k) + i for k in np.nonzero(apart < _SAME_PLACE)[0] for i in range(4)]
