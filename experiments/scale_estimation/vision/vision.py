"""What one picture by a calibrated camera says of the size of a known object."""

import time
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.scale_estimation.size import Belief, SizeRange, add_unevenness
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import DIRECTIONS, SeenOutline, directions

PIXEL_SIGMA = 0.4
"""Standard deviation in pixels of the outline of a mask, and of the outline of a model."""

ALIKE = 3.0
"""Directions that see one corner of the outline err together: so many count as one."""

_SIZE, _YAW, _FOCAL, _SUPPORT = 0, 3, 12, 13
_PLACE, _CAMERA, _TURN = slice(1, 3), slice(6, 9), slice(9, 12)
UNKNOWNS = (
    *(
        "its size",
        "its place along x",
        "its place along y",
        "its yaw",
        "its tilt about x",
        "its tilt about y",
    ),
    *(f"the camera's place along {axis}" for axis in "xyz"),
    *(f"the camera's turn about its {axis}" for axis in "xyz"),
    *("the focal length", "the support's height"),
)
"""Names of the fitted parameters, in order."""

_UNKNOWNS = len(UNKNOWNS)
_NUDGE = 1.0e-6

_AROUND = 600
"""Directions, five degrees apart: a corner between two stands out by less than a thousandth of the size."""


@dataclass(frozen=True, eq=False)
class View:
    """A camera and what stands before it, as the station and the scene state them."""

    base_from_camera: FloatArray  #: ``(4, 4)``; x right, y down, z forward.
    focal_px: float  #: pixels.
    centre_px: tuple[float, float]  #: (x, y) of the optical axis, pixels from the picture's corner.
    standing: FloatArray
    """``(n, 3)`` m, corners of the nominal object's convex hull upright in base, its anchor at the origin."""
    place: FloatArray  #: ``(3,)`` m in base: where that middle nominally stands.
    errors: CameraErrors = field(default_factory=CameraErrors)  #: of all this.

    @cached_property
    def corners(self) -> FloatArray:
        """``(m, 3)`` those corners that can be on an outline: the farthest in directions all around."""
        return np.asarray(self.standing[np.unique((_all_around() @ self.standing.T).argmax(axis=1))])

    @cached_property
    def sigmas(self) -> FloatArray:
        """``(14,)`` prior deviations of the unknowns; infinite for size and yaw."""
        e = self.errors
        return np.array(
            [np.inf, e.place, e.place, np.inf, e.tilt, e.tilt]
            + 3 * [e.position]
            + 3 * [e.rotation]
            + [e.focal_length, e.support]
        )

    def project(self, unknowns: FloatArray, corners: FloatArray) -> FloatArray:
        """``(k, n, 2)`` pixels of ``(n, 3)`` or ``(k, n, 3)`` standing corners, for ``(k, 14)`` unknowns."""
        cosine, sine = np.cos(unknowns[:, _YAW, None]), np.sin(unknowns[:, _YAW, None])
        tilt_x, tilt_y = unknowns[:, 4, None], unknowns[:, 5, None]
        x, y, z = np.moveaxis(np.broadcast_to(corners, (len(unknowns), *corners.shape[-2:])), -1, 0)
        x, y = cosine * x - sine * y, sine * x + cosine * y
        tilted = np.stack([x + tilt_y * z, y - tilt_x * z, z + tilt_x * y - tilt_y * x], axis=-1)
        placed = tilted * np.exp(unknowns[:, _SIZE, None, None]) + self.place
        placed[..., :2] += unknowns[:, None, _PLACE]
        placed[..., 2] += unknowns[:, _SUPPORT, None]
        eye = self.base_from_camera[:3, 3] + unknowns[:, None, _CAMERA]
        seen = (placed - eye) @ self.base_from_camera[:3, :3]
        # The camera's turn, to first order. ``numpy.cross`` takes longer of small arrays.
        x, y, z = np.moveaxis(seen, -1, 0)
        a, b, c = np.moveaxis(unknowns[:, None, _TURN], -1, 0)
        seen = seen + np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=-1)
        focal = self.focal_px * np.exp(unknowns[:, _FOCAL, None, None])
        pixels: FloatArray = focal * seen[..., :2] / np.maximum(seen[..., 2:], 1e-3) + self.centre_px
        return pixels


@dataclass(frozen=True, eq=False)
class OutlineFit:
    """A place, turn and size of the object at which its outline is nearly that of the picture."""

    unknowns: FloatArray
    """``(14,)``: logarithm of the size over the nominal one; metres along base x and y; yaw, rad; tilts about
    x and y, rad; the camera's place, m, turn, rad, and logarithm of its focal length, off from what is
    stated; the support's height, m, off."""
    cost: float  #: half the sum of squares, prior included.
    rms: float  #: pixels, of the outline where it is not hidden.


class OutlineProblem:
    """Least squares of an outline, for many starts at a time.

    Args:
        view: camera, object, and how well they are known.
        outline: of the picture.
    """

    def __init__(self, view: View, outline: SeenOutline) -> None:
        self.view = view
        self._outline = outline
        self._weight = 1.0 / (PIXEL_SIGMA * np.sqrt(ALIKE))

    def fit(self, starts: FloatArray, rounds: int, fixed_size: bool = False) -> list[OutlineFit]:
        """Minimise from ``(k, 14)`` starts by damped Gauss-Newton steps."""
        here = starts.copy()
        residuals, slopes = self._residuals(here)
        cost = 0.5 * (residuals**2).sum(axis=1)
        damping = np.full(len(here), 1e-3)
        for _ in range(rounds):
            step = self._step(residuals, slopes, damping, fixed_size)
            there = here + step
            tried, tried_slopes = self._residuals(there)
            new = 0.5 * (tried**2).sum(axis=1)
            better = new < cost
            here, cost = np.where(better[:, None], there, here), np.where(better, new, cost)
            residuals = np.where(better[:, None], tried, residuals)
            slopes = np.where(better[:, None, None], tried_slopes, slopes)
            damping = np.where(better, 0.2 * damping, 10.0 * damping)
        seen = residuals[:, : len(self._outline.extents)] / self._weight
        counted = ~self._outline.hidden
        rms = np.sqrt((seen[:, counted] ** 2).mean(axis=1)) if counted.any() else np.zeros(len(here))
        return [OutlineFit(*one) for one in zip(here, cost.tolist(), rms.tolist(), strict=True)]

    def covariance(self, unknowns: FloatArray) -> FloatArray:
        """``(14, 14)`` of the unknowns at a minimum, to first order."""
        _, slopes = self._residuals(unknowns[None])
        return np.asarray(np.linalg.inv(slopes[0].T @ slopes[0] + 1e-9 * np.eye(_UNKNOWNS)))

    def _step(
        self, residuals: FloatArray, slopes: FloatArray, damping: FloatArray, fixed_size: bool
    ) -> FloatArray:
        free = slice(1, None) if fixed_size else slice(None)
        slopes = slopes[..., free]
        normal = np.einsum("kri,krj->kij", slopes, slopes)
        diagonal = np.einsum("kii->ki", normal)
        damped = damping[:, None] * diagonal + 1e-9
        normal = normal + damped[..., None] * np.eye(slopes.shape[-1])
        gradient = np.einsum("kri,kr->ki", slopes, residuals)
        step = np.zeros((len(residuals), _UNKNOWNS))
        step[:, free] = -np.linalg.solve(normal, gradient[..., None])[..., 0]
        return step

    def _residuals(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``(k, 72 + 14)`` in deviations, and their slopes ``(k, 72 + 14, 14)``."""
        view, towards = self.view, directions()
        places = view.project(unknowns, view.corners)
        reach = towards @ places.swapaxes(1, 2)
        farthest = reach.argmax(axis=2)
        extents = np.take_along_axis(reach, farthest[..., None], axis=2)[..., 0]
        # The corner that is farthest stays so for a nudge: only its own motion counts (the envelope theorem).
        corners = np.repeat(view.corners[farthest], _UNKNOWNS, axis=0)
        nudged = (unknowns[:, None] + _NUDGE * np.eye(_UNKNOWNS)).reshape(-1, _UNKNOWNS)
        moved = (
            (view.project(nudged, corners) * towards).sum(axis=-1).reshape(-1, _UNKNOWNS, extents.shape[1])
        )
        slopes = (moved.swapaxes(1, 2) - extents[..., None]) / _NUDGE
        apart = (extents - self._outline.extents) * self._weight
        idle = self._outline.hidden & (apart > 0.0)
        apart, slopes = np.where(idle, 0.0, apart), np.where(idle[..., None], 0.0, slopes * self._weight)
        prior = np.broadcast_to(np.diag(1.0 / view.sigmas), (len(unknowns), _UNKNOWNS, _UNKNOWNS))
        believed = np.where(np.isinf(view.sigmas), 0.0, unknowns / view.sigmas)
        return np.concatenate([apart, believed], axis=1), np.concatenate([slopes, prior], axis=1)


MISFIT = 0.9
"""Pixels rms between the outlines beyond which the picture is not of this object."""

MISFIT_COST = 0.5 * DIRECTIONS * (MISFIT / PIXEL_SIGMA) ** 2 / ALIKE
"""What such a misfit costs, all else as stated. A fit that costs more, far from what is stated, is not of
this object either: tilted by ten standard deviations, a wrench has the outline of a mug."""

NO_SIZE = 0.3
"""Deviation of the size's logarithm beyond which a picture says nothing of it."""

_FIRST_ROUNDS = 4
_FOLLOWED = 4
_ROUNDS = 8
_SCAN = np.linspace(-5.0, 5.0, 21)
_SCAN_ROUNDS = 4
_FAR = 20.0
_MOST_MODES = 4
_FIRST_TURNS = 12
"""Rotations about the vertical from which the fit of the size starts."""

_TURNS = 24
_ROUNDS_OF_TURNS = 12
_TURNS_APART = 0.1


@dataclass(frozen=True, eq=False)
class Sight:
    """The answer by sight."""

    belief: Belief  #: over the size.
    fit: OutlineFit  #: the best.
    seconds: float  #: s of the estimate.


def by_sight(view: View, outline: SeenOutline, nominal: float, sizes: SizeRange) -> Sight:
    """The size at which the model's outline is that of the picture.

    Args:
        view: camera and object.
        outline: of the picture.
        nominal: m, the longest side of the model.
        sizes: asked about.

    Raises:
        FitRefused: at no size and turn is it this object's outline.
    """
    began = time.perf_counter()
    problem = OutlineProblem(view, outline)
    begun = sorted(problem.fit(_starts(view, outline, _FIRST_TURNS), _FIRST_ROUNDS), key=lambda fit: fit.cost)
    fits = problem.fit(np.array([fit.unknowns for fit in begun[:_FOLLOWED]]), _ROUNDS)
    best = min(fits, key=lambda fit: fit.cost)
    # Refuse an outline that is another object's.
    if best.rms > MISFIT:
        raise FitRefused(
            f"the outline in the picture is {best.rms:.1f} px (rms) off this object's at any size and turn "
            f"(limit {MISFIT:g} px); check that it is this object, upright, with nothing in front of it"
        )
    if best.cost > MISFIT_COST:
        off = np.where(np.isinf(view.sigmas), 0.0, np.abs(best.unknowns) / view.sigmas)
        worst = int(off.argmax())
        raise FitRefused(
            f"the outline in the picture is this object's only if {UNKNOWNS[worst]} were {off[worst]:.0f} "
            "standard deviations off what is stated; check that it is this object, upright, and that the "
            "camera is where the station states"
        )
    log_nominal = np.log(nominal)
    density = np.full(len(sizes.logs), -np.inf)
    separate: list[OutlineFit] = []  # minima to scan, one per position and rotation
    for fit in sorted(fits, key=lambda fit: fit.cost):
        new = all(abs(fit.unknowns[0] - one.unknowns[0]) > 2e-3 for one in separate)
        if fit.cost < best.cost + _FAR and new and len(separate) < _MOST_MODES:
            separate.append(fit)
            density = np.logaddexp(density, _scanned(problem, fit, sizes.logs - log_nominal))
    return Sight(add_unevenness(Belief.of(sizes, density)), best, time.perf_counter() - began)


@dataclass(frozen=True, eq=False)
class SeenStand:
    """How the object may stand, by a look."""

    unknowns: FloatArray  #: ``(4,)`` log of the size over the nominal one, x, y, m, yaw, rad.
    farthest: FloatArray
    """``(2,)`` m along x and y: one standard deviation of its place the way it is known worst, the line of
    sight."""

    @property
    def place_error(self) -> float:
        """M, the length of ``farthest``."""
        return float(np.linalg.norm(self.farthest))


def stands_seen(view: View, outline: SeenOutline) -> tuple[SeenStand, ...]:
    """How the object may stand: every turn at which its outline is nearly that of the picture.

    A picture does not tell some turns apart, as those of a mug whose handle is behind it. What moves around
    the object keeps clear of all of them.

    Returns:
        The best first; none at all where the outline is not this object's.
    """
    problem = OutlineProblem(view, outline)
    fits = problem.fit(_starts(view, outline, _TURNS), _ROUNDS_OF_TURNS)
    found: list[OutlineFit] = []
    for fit in sorted(fits, key=lambda one: one.cost):
        turns = [(fit.unknowns[3] - one.unknowns[3] + np.pi) % (2.0 * np.pi) - np.pi for one in found]
        same = fit.rms <= MISFIT and fit.cost <= MISFIT_COST
        if same and all(abs(turn) > _TURNS_APART for turn in turns):
            found.append(fit)
    return tuple(_stand(problem, fit) for fit in found)


def _stand(problem: OutlineProblem, fit: OutlineFit) -> SeenStand:
    variances, axes = np.linalg.eigh(problem.covariance(fit.unknowns)[1:3, 1:3])
    return SeenStand(fit.unknowns[:4], np.sqrt(variances[-1]) * axes[:, -1])


def _starts(view: View, outline: SeenOutline, yaws: int) -> FloatArray:
    """``(yaws, 14)``: as large as the picture's outline is, and where it is."""
    starts = np.zeros((yaws, len(view.sigmas)))
    starts[:, 3] = np.arange(yaws) * 2.0 * np.pi / yaws
    half = len(outline.extents) // 2
    widths = outline.extents[:half] + outline.extents[half:]
    for _ in range(3):
        places = view.project(starts, view.corners)
        low, high = places.min(axis=1), places.max(axis=1)
        seen = 0.5 * ((high - low)[:, 0] / widths[0] + (high - low)[:, 1] / widths[half // 2])
        starts[:, 0] -= np.log(np.maximum(seen, 1e-3))
    return starts


def _scanned(problem: OutlineProblem, fit: OutlineFit, logs: FloatArray) -> FloatArray:
    """``(n,)`` minus the least cost at each logarithm of the size over the nominal one."""
    covariance = problem.covariance(fit.unknowns)
    middle, sigma = float(fit.unknowns[0]), min(float(np.sqrt(covariance[0, 0])), NO_SIZE)
    # The other unknowns go with the size as they do to first order, and are refined from there.
    along = covariance[0] / covariance[0, 0]
    starts = fit.unknowns + sigma * _SCAN[:, None] * along
    costs = np.array([one.cost for one in problem.fit(starts, _SCAN_ROUNDS, fixed_size=True)])
    away = (logs - middle) / sigma
    within = PchipInterpolator(_SCAN, costs)(np.clip(away, _SCAN[0], _SCAN[-1]))
    beyond = np.maximum(np.abs(away) - _SCAN[-1], 0.0)
    return np.asarray(-within - _SCAN[-1] * beyond)


@cache
def _all_around() -> FloatArray:
    """``(n, 3)`` unit vectors, evenly over the sphere: a spiral of equal turns (Saff and Kuijlaars, 1997)."""
    heights = 1.0 - (2.0 * np.arange(_AROUND) + 1.0) / _AROUND
    turns = np.arange(_AROUND) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - heights**2)
    return read_only(np.column_stack([across * np.cos(turns), across * np.sin(turns), heights]))
