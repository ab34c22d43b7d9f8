"""Free numbers of a shape, their prior, and the cost of bench errors that a fit needs.

A fit may lift a shape off its support, lean it, or move the gel and the camera. A body outside the family
takes more of that than any calibration leaves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar, cast

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.kinds import kind_of
from harness.basics.arrays import FloatArray, IntArray

TILT = float(np.radians(0.8))
"""Standard deviation per axis of the tilt of an object on its support, rad."""

GEL_OFF = (0.6e-3, 0.6e-3, 0.4e-3)
"""Standard deviations of the offset of a calibrated gel throughout a run, in its frame, m."""

OUTLINE_BIAS, OUTLINE_OFF = -0.15, 0.3
"""Mean and deviation of the distance of masks beyond objects, pixels: a third of a pixel suffices."""

SMOOTHNESS = 0.10
"""Standard deviation of the second difference of a section's deviation from its sample."""


_F = TypeVar("_F", bound=Callable[..., FloatArray])


def _kept_by_code(make: _F) -> _F:
    """Cache what a function returns for each code of a shape."""

    @lru_cache(maxsize=256)
    def kept(code: tuple[int, ...], *rest: bool) -> FloatArray:
        return make(np.array(code), *rest)

    def found(code: IntArray, *rest: bool) -> FloatArray:
        return kept(tuple(int(part) for part in code), *rest)

    return cast(_F, found)


@_kept_by_code
def basis_of(code: IntArray, sighted: bool, touched: bool) -> FloatArray:
    """Return ``(n, size)`` directions: every free number by itself."""
    kind = kind_of(code)
    slots = [layout.X, layout.Y, layout.LIFT, layout.TILT_X, layout.TILT_Y, *kind.deviations(code)]
    if kind.traits(code).has_yaw:
        slots.append(layout.YAW)
    if sighted:
        slots += [layout.CAMERA_RIGHT, layout.CAMERA_DOWN, layout.CAMERA_SCALE, layout.OUTLINE]
    if touched:
        slots += [layout.GEL, layout.GEL + 1, layout.GEL + 2]
    return np.asarray(np.eye(kind.size)[np.sort(slots)])


@_kept_by_code
def stand_basis(code: IntArray, two_senses: bool) -> FloatArray:
    """Return ``(n, size)`` directions of position, yaw, size and proportions, along which a sample is placed.

    With ``two_senses``, vision and touch, the picture's shift too: it is what they differ by most.
    """
    kind = kind_of(code)
    rows: list[tuple[int, ...]] = [(layout.CAMERA_RIGHT,), (layout.CAMERA_DOWN,)] if two_senses else []
    rows += [(layout.X,), (layout.Y,), kind.lengths, (kind.height,)]
    if kind.traits(code).has_yaw:
        rows.append((layout.YAW,))
    rows += [(slot,) for slot in kind.traits(code).proportions]
    return np.array([_along(kind.size, *slots) for slots in rows])


def _along(size: int, *slots: int) -> FloatArray:
    row = np.zeros(size)
    row[list(slots)] = 1.0
    return row


def bench_rows(place: float, support: float, pixel: float, shift: float, scale: float) -> FloatArray:
    """Return ``(n, POSE_SIZE)`` rows of a prior: each bench error over its deviation."""
    sigmas = {
        layout.X: place, layout.Y: place, layout.LIFT: support, layout.TILT_X: TILT, layout.TILT_Y: TILT,
        layout.CAMERA_RIGHT: shift, layout.CAMERA_DOWN: shift, layout.CAMERA_SCALE: scale,
        layout.OUTLINE: OUTLINE_OFF * pixel,
        layout.GEL: GEL_OFF[0], layout.GEL + 1: GEL_OFF[1], layout.GEL + 2: GEL_OFF[2],
    }  # fmt: skip
    return np.array([_along(layout.POSE_SIZE, slot) / sigma for slot, sigma in sigmas.items()])


def prior_rows(bench: FloatArray, own: FloatArray) -> FloatArray:
    """Return ``(k, size)`` rows of a prior: those of the bench, then those of the parameters."""
    rows = np.zeros((len(bench) + len(own), own.shape[1]))
    rows[: len(bench), : layout.POSE_SIZE], rows[len(bench) :] = bench, own
    return rows


@_kept_by_code
def shape_rows(code: IntArray) -> FloatArray:
    """Return ``(n, size)`` rows of a prior: each free parameter, and the section's second differences."""
    kind = kind_of(code)
    rows = [_along(kind.size, slot) / sigma for slot, sigma in kind.deviations(code).items()]
    for a, b, c in zip(kind.section, kind.section[1:], kind.section[2:], strict=False):
        rows.append((_along(kind.size, a) - 2.0 * _along(kind.size, b) + _along(kind.size, c)) / SMOOTHNESS)
    return np.array(rows)


@_kept_by_code
def stand_rows(code: IntArray) -> FloatArray:
    """Return ``(n, size)`` rows of the prior while a sample is placed: its size and proportions.

    One length stands for the size, as all scale together; the position has rows of its own.
    """
    kind = kind_of(code)
    width, height = _along(kind.size, kind.width), _along(kind.size, kind.height)
    rows = [width / 0.4, (height - width) / 0.25]
    rows += [(_along(kind.size, slot) - width) / 0.3 for slot in kind.traits(code).proportions]
    return np.array(rows)


_NAMES = {
    **dict.fromkeys((layout.X, layout.Y), ("its place", "mm", 1e3)),
    layout.LIFT: ("its support's height", "mm", 1e3),
    **dict.fromkeys((layout.TILT_X, layout.TILT_Y), ("its upright", "deg", np.degrees(1.0))),
    **dict.fromkeys((layout.CAMERA_RIGHT, layout.CAMERA_DOWN), ("the camera's place", "mm", 1e3)),
    layout.CAMERA_SCALE: ("the picture's scale", "%", 1e2),
    layout.OUTLINE: ("the mask's border", "mm", 1e3),
    **dict.fromkeys(range(layout.GEL, layout.GEL + 3), ("the gel's place", "mm", 1e3)),
}
"""Name, unit, and factor to that unit, of each bench error."""


@dataclass(frozen=True)
class NuisanceCost:
    """Cost of the bench errors that a shape needs to fit."""

    cost: float  #: half the sum of squares, in standard deviations.
    largest: str  #: the largest of the errors, in words.

    @property
    def is_excessive(self) -> bool:
        """True if no calibrated bench has such errors."""
        return self.cost > limits.MAX_NUISANCE_COST


def nuisance_cost(theta: FloatArray, rows: FloatArray, middle: FloatArray) -> NuisanceCost:
    """Compute the cost of the bench errors in a shape's vector.

    Args:
        theta: vector of the shape.
        rows: ``(n, POSE_SIZE)``, each one bench error over its standard deviation.
        middle: ``(POSE_SIZE,)`` expected pose and bench errors.
    """
    off = rows @ (theta[: layout.POSE_SIZE] - middle)
    most = int(np.argmax(np.abs(off)))
    slot = int(np.flatnonzero(rows[most])[0])
    name, unit, factor = _NAMES[slot]
    by = factor * abs(theta[slot] - middle[slot])
    largest = f"{name} off by {by:.1f} {unit}, {abs(off[most]):.0f} standard deviations"
    return NuisanceCost(0.5 * float(off @ off), largest)
