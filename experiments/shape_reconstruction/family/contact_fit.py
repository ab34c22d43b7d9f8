"""Compare contacts with a fitted shape: residuals, outliers, turned contacts, and moving the surface to them.

A rotated contact has a wrong pose of the arm. It is moved as a rigid patch: a shift along a curved wall may
explain a rotation as far as shifts are likely.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.contact_rows import SLIPPED, contact_sums
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.observed import FamilyEvidence, farthest_points
from experiments.shape_reconstruction.family.residuals import evaluate, make_rows, prepared_buffer
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.geometry import rotation_from_vector

_PROBE = 0.5e-3
_MOVED_POINTS = 8


@dataclass(frozen=True, eq=False)
class ContactFit:
    """Residuals of all contacts, in their order."""

    sums: FloatArray  #: ``(contacts,)`` sums of squares, in standard deviations.
    off: FloatArray  #: ``(contacts,)`` m rms between its points and the surface.
    doubtful: BoolArray  #: ``(contacts,)`` whether it does not fit while most do.
    others: float  #: cost of free places, of what the gel touched nothing of, and of rays of sight.

    @property
    def typical(self) -> float:
        """Median sum of squares of a contact; zero without any."""
        return float(np.median(self.sums)) if len(self.sums) else 0.0


def contact_fit(shape: FamilyShape, seen: FamilyEvidence) -> ContactFit:
    """Compute the residuals of the contacts against a shape."""
    out, q = make_rows(seen), prepared_buffer()
    cost = evaluate(shape.code, shape.theta, seen, False, out, q, np.inf)
    sums = np.asarray(contact_sums(seen, out.values))
    count = len(sums)
    off = np.zeros(count)
    if count:
        squares = (out.values[: len(seen.points)] * seen.sigma[seen.touch]) ** 2
        off = np.sqrt(np.bincount(seen.touch, squares, count) / np.bincount(seen.touch, minlength=count))
    strange = (sums > limits.MIN_OUTLIER_COST) & (off > limits.MIN_OUTLIER_DISTANCE)
    doubtful = strange & (sums > limits.MIN_OUTLIER_RATIO * np.median(sums)) if count else strange
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
    points = np.concatenate(
        [
            touch.points[:: max(len(touch.points) // _MOVED_POINTS, 1)] + touch.stand_from_gel[:3, :3] @ gel
            for touch in contacts
        ]
    )
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


POINTS = 12
"""Points of a contact that are compared."""

INDEPENDENT = 3.0
"""Points that a contact counts as: its neighbours err together."""

POINT_SIGMA, NORMAL_SIGMA = 0.6e-3, float(np.radians(4.0))
"""Standard deviations of the nearest shape from a contact with a right pose, m and rad."""

SHIFT_SIGMA = (1.0e-3, 1.0e-3, 2.0e-3)
"""Standard deviations of the offset of the nearest shape at a contact, along x, y and z of the gel, m."""

TILT_SIGMA = float(np.radians(30.0))

OUT, STEP = 1.5e-3, 1.0e-3
"""Distance outside the surface at which a slope is taken, and its step, m."""

_PRIOR = np.array([*SHIFT_SIGMA, TILT_SIGMA, TILT_SIGMA])
_STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-2])
_ROUNDS = 5


def find_rotated_contacts(shape: FamilyShape, evidence: ShapeEvidence) -> FloatArray:
    """``(contacts,)`` rad by which the pose of each contact is turned against a shape; 0 where it is right.

    It is turned where it fits much better turned, by more than ``MIN_TILT`` and thrice as far as the others.
    Contacts of edges and corners are not judged, and 0.
    """
    found = np.zeros(len(evidence.contacts))
    judged = []
    for k, touch in enumerate(evidence.contacts):
        # A smooth piece of surface, wide both ways: an edge has no one normal.
        middle = touch.points.mean(axis=0)
        widths = np.linalg.svd(touch.points - middle, compute_uv=False) / np.sqrt(len(touch.points))
        spread = np.arccos(np.clip(touch.normals @ touch.mean_normal, -1.0, 1.0))
        if (
            len(widths) > 1
            and widths[1] > limits.MIN_PATCH_WIDTH
            and spread.mean() < limits.MAX_NORMAL_SPREAD
        ):
            judged.append(k)
    if not judged:
        return found
    tilts, gains = np.zeros(len(judged)), np.zeros(len(judged))
    for row, k in enumerate(judged):
        patch = _Patch.of(evidence.contacts[k], shape.theta[layout.GEL : layout.GEL + 3])
        _, shifted = _least(shape, patch, 3)
        moved, turned = _least(shape, patch, 5)
        tilts[row], gains[row] = np.linalg.norm(moved[3:]), shifted - turned
    least = max(limits.MIN_TILT, limits.MIN_TILT_RATIO * float(np.median(tilts)))
    found[judged] = np.where((tilts > least) & (gains > limits.MIN_TILT_GAIN), tilts, 0.0)
    return found


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
        steps = STEP * np.concatenate([np.eye(3), -np.eye(3)])
        around = distances(shape.code, shape.theta, points.mean(axis=0) + OUT * normal + steps)
        bent = ((around[:3] - around[3:]) / (2.0 * STEP) - normal) / NORMAL_SIGMA
        return np.concatenate([moved / _PRIOR, gap, bent])


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


LENGTH = 15.0e-3
"""Correlation length of a displacement, m."""

AMPLITUDE = 3.0e-3
"""M: one standard deviation of a displacement where nothing was read."""

FAR = 45.0e-3
"""Correlation length of the error of a wrong class, m."""


def displacement(
    places: FloatArray, offsets: FloatArray, sigma: FloatArray, queries: FloatArray, far: float = 0.0
) -> FloatArray:
    """The mean of a Gaussian process of displacements, squared-exponential, each axis by itself.

    A surface is moved by vectors, not along its normals by amounts, so that both sides of a wall go together.

    Args:
        places: ``(n, 3)`` m.
        offsets: ``(n, 3)`` m that the surface is displaced by there.
        sigma: ``(n,)`` m, one standard deviation of those, greater than zero.
        queries: ``(m, 3)`` m.
        far: m, one standard deviation of displacements that die away over ``FAR``; none by default.

    Returns:
        ``(m, 3)`` m; zero far from all places.
    """
    if len(places) == 0:
        return np.zeros_like(queries)
    covariance = _kernel(places, places, far) + np.diag(sigma**2)
    weights = cho_solve(cho_factor(covariance, lower=True), offsets)
    return np.asarray(_kernel(queries, places, far) @ weights)


def _kernel(a: FloatArray, b: FloatArray, far: float) -> FloatArray:
    squares = cdist(a, b, "sqeuclidean")
    near = _falling(squares, AMPLITUDE, LENGTH)
    return np.asarray(near + _falling(squares, far, FAR) if far > 0.0 else near)


def _falling(squares: FloatArray, amplitude: float, length: float) -> FloatArray:
    """A squared-exponential covariance at squared distances; made in one array, which is large."""
    found = squares * (-0.5 / length**2)
    np.exp(found, out=found)
    found *= amplitude**2
    return found
