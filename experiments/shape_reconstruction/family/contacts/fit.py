"""How each contact fits a shape: what is off by how much, and which contact is not to be believed."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.contacts.rows import SLIPPED, contact_sums
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.residuals import evaluate, prepared_room, rows_for
from harness.basics.arrays import BoolArray, FloatArray

STRANGE = 16.0
"""A contact's sum of squares, of some five numbers, from which on it may be doubted."""

ALONE = 5.0
"""By how many times it exceeds the median contact's: where all are off, the shape is, not the contacts."""

LEAST_OFF = 1.0e-3
"""M that a doubtful contact is off at least: normals at edges differ without being wrong."""

_PROBE = 0.5e-3


@dataclass(frozen=True, eq=False)
class ContactFit:
    """Of every contact, in their order.

    Attributes:
        sums: ``(contacts,)`` sums of squares, in standard deviations.
        off: ``(contacts,)`` m rms between its points and the surface.
        doubtful: ``(contacts,)`` whether it does not fit while most do.
        others: cost of free places, of what the gel touched nothing of, and of rays of sight.
    """

    sums: FloatArray
    off: FloatArray
    doubtful: BoolArray
    others: float

    @property
    def typical(self) -> float:
        """Median sum of squares of a contact; zero without any."""
        return float(np.median(self.sums)) if len(self.sums) else 0.0


def contact_fit(shape: FamilyShape, seen: FamilyEvidence) -> ContactFit:
    """How the contacts fit a shape."""
    out, q = rows_for(seen), prepared_room()
    cost = evaluate(shape.code, shape.theta, seen, False, out, q)
    sums = np.asarray(contact_sums(seen, out.values))
    count = len(sums)
    off = np.zeros(count)
    if count:
        squares = (out.values[: len(seen.points)] * seen.sigma[seen.touch]) ** 2
        off = np.sqrt(np.bincount(seen.touch, squares, count) / np.bincount(seen.touch, minlength=count))
    strange = (sums > STRANGE) & (off > LEAST_OFF)
    doubtful = strange & (sums > ALONE * np.median(sums)) if count else strange
    linear = np.sqrt(SLIPPED * sums) - 0.5 * SLIPPED
    by_contacts = float(np.where(sums <= SLIPPED, 0.5 * sums, linear).sum())
    return ContactFit(sums, off, doubtful, cost - by_contacts)


def moved_points(
    shape: FamilyShape, evidence: ShapeEvidence, which: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Points of chosen contacts where the run's gel really was, and how far each is off the shape.

    Returns:
        ``(n, 3)`` m and ``(n, 3)`` m from the shape's surface to each.
    """
    gel = shape.theta[layout.GEL : layout.GEL + 3]
    contacts = [touch for touch, chosen in zip(evidence.contacts, which, strict=True) if chosen]
    if not contacts:
        return np.empty((0, 3)), np.empty((0, 3))
    points = np.concatenate([_few(touch.points) + touch.stand_from_gel[:3, :3] @ gel for touch in contacts])
    ahead = np.concatenate(
        [distances(shape.code, shape.theta, points + _PROBE * axis)[:, None] for axis in np.eye(3)], axis=1
    )
    behind = np.concatenate(
        [distances(shape.code, shape.theta, points - _PROBE * axis)[:, None] for axis in np.eye(3)], axis=1
    )
    slope = (ahead - behind) / (2.0 * _PROBE)
    length = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-6)
    gap = distances(shape.code, shape.theta, points)
    return points, gap[:, None] * slope / length


def _few(points: FloatArray, count: int = 8) -> FloatArray:
    return points[:: max(len(points) // count, 1)]
