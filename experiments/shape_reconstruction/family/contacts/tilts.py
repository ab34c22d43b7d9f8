"""By how much each contact is turned against a shape: what a wrong pose of the arm looks like.

A contact is moved as a rigid patch. Shifted a little along a curved wall it is turned against it as well, as
at the bar of a handle, so that a shift is free to explain a tilt as far as shifts are likely.
"""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.spread import farthest_points
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_from_vector

POINTS = 12
"""Of a contact, that are compared."""

INDEPENDENT = 3.0
"""Points that a contact counts as: its neighbours err together."""

POINT_SIGMA, NORMAL_SIGMA = 0.6e-3, float(np.radians(4.0))
"""M and rad by which the nearest shape is off a contact whose pose is right."""

SHIFT_SIGMA = (1.0e-3, 1.0e-3, 2.0e-3)
"""M along x, y and z of the gel that the nearest shape lies beside a real one at a contact."""

TURNED, APART, GAIN = float(np.radians(9.0)), 3.0, 8.0
"""Rad, times the median contact, and the sum of squares: more than errors of gel and shape explain."""

WIDE, SMOOTH = 1.2e-3, float(np.radians(10.0))
"""M rms of a contact's points across its narrower side, and rad of its normals about their mean: of a press
on an edge normals are off by 30 degrees and more at a right pose."""

TILT_SIGMA = float(np.radians(30.0))

OUT, STEP = 1.5e-3, 1.0e-3
"""M before the surface where a shape's slope is taken, and over which."""

_PRIOR = np.array([*SHIFT_SIGMA, TILT_SIGMA, TILT_SIGMA])
_STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-2])
_ROUNDS = 5


def turned_contacts(shape: FamilyShape, evidence: ShapeEvidence) -> FloatArray:
    """``(contacts,)`` rad by which the pose of each contact is turned against a shape; 0 where it is right.

    It is turned where it fits much better turned, by more than ``TURNED`` and thrice as far as the others.
    Contacts of edges and corners are not judged, and 0.
    """
    found = np.zeros(len(evidence.contacts))
    judged = [k for k, touch in enumerate(evidence.contacts) if _is_face(touch)]
    if not judged:
        return found
    tilts = np.array([_tilt(shape, evidence.contacts[k]) for k in judged])
    least = max(TURNED, APART * float(np.median(tilts[:, 0])))
    turned = (tilts[:, 0] > least) & (tilts[:, 1] > GAIN)
    found[judged] = np.where(turned, tilts[:, 0], 0.0)
    return found


def _is_face(touch: GuardedTouch) -> bool:
    """Whether it met a smooth piece of surface, wide both ways: an edge has no one normal."""
    middle = touch.points.mean(axis=0)
    widths = np.linalg.svd(touch.points - middle, compute_uv=False) / np.sqrt(len(touch.points))
    spread = np.arccos(np.clip(touch.normals @ touch.mean_normal, -1.0, 1.0))
    return bool(len(widths) > 1 and widths[1] > WIDE and spread.mean() < SMOOTH)


def _tilt(shape: FamilyShape, touch: GuardedTouch) -> tuple[float, float]:
    """Rad that it is turned to fit best, and by how much its sum of squares is less for that."""
    patch = _Patch.of(touch, shape.theta[layout.GEL : layout.GEL + 3])
    _, shifted = _least(shape, patch, 3)
    moved, turned = _least(shape, patch, 5)
    return float(np.linalg.norm(moved[3:])), shifted - turned


@dataclass(frozen=True, eq=False)
class _Patch:
    """Points and their mean normal in the frame of the gel, about their middle, and where that is."""

    points: FloatArray
    normal: FloatArray
    turn: FloatArray
    place: FloatArray

    @classmethod
    def of(cls, touch: GuardedTouch, gel: FloatArray) -> "_Patch":
        rows = farthest_points(touch.points, POINTS)
        turn, place = touch.stand_from_gel[:3, :3], touch.points[rows].mean(axis=0)
        return cls((touch.points[rows] - place) @ turn, touch.mean_normal @ turn, turn, place + turn @ gel)

    def residuals(self, shape: FamilyShape, moved: FloatArray) -> FloatArray:
        """``(5 + n + 3,)``: of the move itself, of each point, and of the normal."""
        about = rotation_from_vector(np.array([moved[3], moved[4], 0.0]))
        points = (self.points @ about.T + moved[:3]) @ self.turn.T + self.place
        normal = self.turn @ about @ self.normal
        share = np.sqrt(INDEPENDENT / len(points))
        gap = distances(shape.code, shape.theta, points) * share / POINT_SIGMA
        bent = (_slope(shape, points.mean(axis=0) + OUT * normal) - normal) / NORMAL_SIGMA
        return np.concatenate([moved / _PRIOR, gap, bent])


def _slope(shape: FamilyShape, point: FloatArray) -> FloatArray:
    steps = STEP * np.concatenate([np.eye(3), -np.eye(3)])
    around = distances(shape.code, shape.theta, point + steps)
    return np.asarray((around[:3] - around[3:]) / (2.0 * STEP))


def _least(shape: FamilyShape, patch: _Patch, free: int) -> tuple[FloatArray, float]:
    """The move of least sum of squares with its first ``free`` numbers free (Gauss-Newton), and that sum."""
    moved = np.zeros(5)
    rows = patch.residuals(shape, moved)
    for _ in range(_ROUNDS):
        slopes = np.array(
            [patch.residuals(shape, moved + _STEPS[k] * np.eye(5)[k]) - rows for k in range(free)]
        )
        slopes /= _STEPS[:free, None]
        step = np.zeros(5)
        step[:free] = np.linalg.solve(slopes @ slopes.T, -slopes @ rows)
        tried = patch.residuals(shape, moved + step)
        if tried @ tried >= rows @ rows:
            break
        moved, rows = moved + step, tried
    return moved, float(rows @ rows)
