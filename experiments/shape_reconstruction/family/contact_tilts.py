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

TILT_SIGMA = float(np.radians(30.0))

OUT, STEP = 1.5e-3, 1.0e-3
"""M before the surface where a shape's slope is taken, and over which."""

_PRIOR = np.array([*SHIFT_SIGMA, TILT_SIGMA, TILT_SIGMA])
_STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-2])
_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class ContactTilts:
    """Of every contact, in their order.

    Attributes:
        angles: ``(contacts,)`` rad, by which each is turned about axes in the gel's face to fit best.
        gains: ``(contacts,)`` by how much the sum of squares is less for that.
    """

    angles: FloatArray
    gains: FloatArray


def contact_tilts(shape: FamilyShape, evidence: ShapeEvidence) -> ContactTilts:
    """How the contacts are turned against a shape."""
    found = [_tilt(shape, touch) for touch in evidence.contacts]
    return ContactTilts(np.array([angle for angle, _ in found]), np.array([gain for _, gain in found]))


def _tilt(shape: FamilyShape, touch: GuardedTouch) -> tuple[float, float]:
    patch = _Patch.of(touch, shape.theta[layout.GEL : layout.GEL + 3])
    _, shifted = _least(shape, patch, 3)
    moved, turned = _least(shape, patch, 5)
    return float(np.linalg.norm(moved[3:])), max(shifted - turned, 0.0)


@dataclass(frozen=True, eq=False)
class _Patch:
    """Points and the normals there in the frame of the gel, and where that is."""

    points: FloatArray
    normals: FloatArray
    turn: FloatArray
    place: FloatArray

    @classmethod
    def of(cls, touch: GuardedTouch, gel: FloatArray) -> "_Patch":
        rows = farthest_points(touch.points, POINTS)
        turn, place = touch.stand_from_gel[:3, :3], touch.points[rows].mean(axis=0)
        return cls(
            (touch.points[rows] - place) @ turn, touch.normals[rows] @ turn, turn, place + turn @ gel
        )

    def residuals(self, shape: FamilyShape, moved: FloatArray) -> FloatArray:
        """``(5 + 4 n,)``: of the move itself, of each point, and of each normal's components."""
        about = rotation_from_vector(np.array([moved[3], moved[4], 0.0]))
        points = (self.points @ about.T + moved[:3]) @ self.turn.T + self.place
        normals = self.normals @ about.T @ self.turn.T
        share = np.sqrt(INDEPENDENT / len(points))
        gap = distances(shape.code, shape.theta, points) * share / POINT_SIGMA
        bent = (_slopes(shape, points + OUT * normals) - normals) * share / NORMAL_SIGMA
        return np.concatenate([moved / _PRIOR, gap, bent.ravel()])


def _slopes(shape: FamilyShape, points: FloatArray) -> FloatArray:
    steps = STEP * np.concatenate([np.eye(3), -np.eye(3)])
    around = distances(shape.code, shape.theta, (points[:, None] + steps).reshape(-1, 3)).reshape(-1, 6)
    return np.asarray((around[:, :3] - around[:, 3:]) / (2.0 * STEP))


def _least(shape: FamilyShape, patch: _Patch, free: int) -> tuple[FloatArray, float]:
    """The move of least sum of squares, its first ``free`` numbers free, by Gauss and Newton; and that sum."""
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
