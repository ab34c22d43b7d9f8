"""What a contact at a place would tell: the error that is expected to be left after it.

Under each hypothesis of where the object is, the gel would meet another part of it. How far from where it was
sent it is stopped, and how the surface goes on around that place, tells some hypotheses from others. What a
strike there would say is not counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.posterior import thinned
from harness.basics.arrays import FloatArray, read_only
from harness.basics.faces.ray_mesh import RayMesh
from harness.skills.exploring.bayes_risk import bayes_risk_after

GEL = read_only(
    1.0e-3 * np.array([[0, 0], [6, 0], [-6, 0], [0, 5], [0, -5], [5, 4], [-5, 4], [5, -4], [-5, -4]], float)
)
"""``(9, 2)`` m along x and y of the gel: places of its face; the first that meets something stops it."""

BEFORE = 40.0e-3
"""M before a place from where on the gel's way to it is followed."""

BEYOND = 30.0e-3
"""M behind a place up to which it is followed; what is met later is not met."""

STOPPED, STOPPED_PER_METRE = 1.0e-3, 8.0e-3
"""M by which the place where the gel is stopped is off, and of that for each m from the first contact."""

SHAPED, DEEPEST = 0.57e-3, 2.5e-3
"""M by which heights under the gel are off, with how much they go together, and how deep a gel sees."""

MOST = 9.0
"""Half squares that two readings differ by at most."""

HYPOTHESES = 80
"""That stand for the posterior, at most."""


@dataclass(frozen=True, eq=False)
class BelievedGels:
    """Where the gel was at the first contact, by some hypotheses.

    Attributes:
        gels: ``(n, 3)`` m, its centre in the object's frame.
        object_from_base: ``(n, 3, 3)`` rotations.
        weights: ``(n,)`` summing to 1.
        first_in_base: ``(3,)`` m: where the arm says that it was; only what is added to it counts.
    """

    gels: FloatArray
    object_from_base: FloatArray
    weights: FloatArray
    first_in_base: FloatArray


def believed_gels(hypotheses: Hypotheses, prior: Prior, first_in_base: FloatArray) -> BelievedGels:
    """Few hypotheses that stand for a posterior.

    Args:
        hypotheses: all of it.
        prior: of the object's orientation.
        first_in_base: ``(3,)`` m, the gel's centre at the first contact.
    """
    places = np.column_stack([hypotheses.gels, hypotheses.yaws])
    few, weights = thinned(places, hypotheses.weights, HYPOTHESES)
    return BelievedGels(few[:, :3], prior.object_from_base(few[:, 3]), weights, first_in_base)


def errors_left(rays: RayMesh, at: BelievedGels, places: Sequence[FloatArray]) -> FloatArray:
    """``(n,)`` m: the error that is expected of a contact at each place once it is made.

    However large: that a posterior over a whole side shrinks to half of it is worth something.

    Args:
        rays: to the object's surface.
        at: what is believed.
        places: ``(4, 4)`` ``base_from_gel`` each, were the object where it should be.
    """
    return np.array([_error_left(rays, at, place) for place in places])


def _error_left(rays: RayMesh, at: BelievedGels, base_from_gel: FloatArray) -> float:
    read, points = readings_at(rays, at, base_from_gel)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    return bayes_risk_after(read, at.weights, apart, MOST)


def readings_at(rays: RayMesh, at: BelievedGels, base_from_gel: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a press reads under each hypothesis, and which place it touches.

    Args:
        rays: to the object's surface.
        at: what is believed.
        base_from_gel: ``(4, 4)`` of the press.

    Returns:
        ``(n, 10)`` in deviations of a reading, where the gel is stopped and the heights under it, infinite
        where it meets nothing; ``(n, 3)`` m in the object's frame, the middle of the gel there.
    """
    moved = base_from_gel[:3, 3] - at.first_in_base
    turns = at.object_from_base @ base_from_gel[:3, :3]
    centres, axes = at.gels + at.object_from_base @ moved, turns[:, :, 2]
    starts = centres[:, None] + GEL @ np.swapaxes(turns[:, :, :2], 1, 2) - BEFORE * axes[:, None]
    ways = np.repeat(axes, len(GEL), axis=0)
    met = rays.first_hits(starts.reshape(-1, 3), ways).distance.reshape(len(centres), -1) - BEFORE
    met = np.where(met < BEYOND, met, np.inf)
    stopped = met.min(axis=1)
    along = np.where(np.isfinite(stopped), stopped, 0.0)[:, None]
    heights = np.minimum(met - along, DEEPEST)
    off = np.hypot(STOPPED, STOPPED_PER_METRE * np.linalg.norm(moved))
    read = np.column_stack([stopped / off, heights / SHAPED])
    return read, centres + along * axes
