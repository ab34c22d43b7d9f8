"""Touches that do not fit the rest: each predicted from all others."""

import numpy as np
from scipy.linalg import cho_solve

from experiments.shape_reconstruction.estimators.thin_plate import ThinPlateField
from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray

DOUBTFUL = 4.0
"""Standard deviations by which a touch is off what all others say of it."""

_SAME_PLACE = 1e-12


def doubtful_touches(evidence: ShapeEvidence, field: ThinPlateField) -> dict[int, float]:
    """By the index of the touch, m that it is off: the mean of its places from the field without them.

    With ``P`` the inverse of the covariance, a block left out is off by ``inv(P_bb) (P y)_b``, with the
    covariance ``inv(P_bb)`` (Rasmussen and Williams, Gaussian processes for machine learning, 2006,
    section 5.4.2).
    """
    count = 4 * len(field.data.points)
    inverse = cho_solve((field.factor, True), np.eye(count), check_finite=False)
    found = {}
    for contact in evidence.contacts:
        rows = _rows_of(contact.points, field)
        if len(rows) == 0:
            continue
        block = np.linalg.inv(inverse[np.ix_(rows, rows)])
        off = block @ field.weights.ravel()[rows]
        values = slice(0, None, 4)
        mean = float(off[values].mean())
        sigma = float(np.sqrt(block[values, values].mean()))
        if abs(mean) > DOUBTFUL * sigma:
            found[contact.index] = abs(mean) * field.reach
    return found


def _rows_of(points: FloatArray, field: ThinPlateField) -> list[int]:
    """Numbers of the values and gradients that are a contact's."""
    apart = ((field.data.points[:, None] - points[None]) ** 2).sum(axis=2).min(axis=1)
    return [4 * int(k) + i for k in np.nonzero(apart < _SAME_PLACE)[0] for i in range(4)]
