"""The size at which a model's outline is that of a picture; place, turn and the camera's errors unknown."""

from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import SeenOutline, directions

PIXEL_SIGMA = 0.4
"""Pixels, of where a mask's outermost pixel leaves the outline, and a model's shape it."""

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
"""What is fitted, in order."""

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


@cache
def _all_around() -> FloatArray:
    """``(n, 3)`` unit vectors, evenly over the sphere: a spiral of equal turns (Saff and Kuijlaars, 1997)."""
    heights = 1.0 - (2.0 * np.arange(_AROUND) + 1.0) / _AROUND
    turns = np.arange(_AROUND) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - heights**2)
    return read_only(np.column_stack([across * np.cos(turns), across * np.sin(turns), heights]))


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
        """From ``(k, 14)`` starts down to the nearest minimum each, by damped Gauss-Newton steps.

        Args:
            starts: unknowns.
            rounds: steps at most.
            fixed_size: whether the size stays as it is.
        """
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
