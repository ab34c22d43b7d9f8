"""Free numbers of a shape, their prior, and the cost of bench errors that a fit needs.

A fit may lift a shape off its support, lean it, or move the gel and the camera. A body outside the family
takes more of that than any calibration leaves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar, cast

import numpy as np

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.layout import (
    BAR,
    BENT,
    CORED,
    FLAT_SIDED,
    LOOP,
    NO_LIMB,
    PLAIN,
    ROUND,
    SUPER,
    TOOL,
    TURNED,
)
from harness.basics.arrays import FloatArray, IntArray

TILT = float(np.radians(0.8))
"""Rad per axis that an object on its support leans by."""

GEL_OFF = (0.6e-3, 0.6e-3, 0.4e-3)
"""M in the gel's frame by which a calibrated gel is off its believed place, all through a run."""

OUTLINE_BIAS, OUTLINE_OFF = -0.15, 0.3
"""Pixels by which masks reach beyond objects: a pixel counts where the object covers about a third of it."""

_DEVIATIONS = {
    TURNED: {
        layout.HEIGHT: 0.3, layout.WARP: 0.15, layout.WALL: 0.35, layout.FLOOR: 0.4,
        **{layout.RADII + k: 0.35 for k in range(layout.KNOTS)},
    },
    TOOL: {
        layout.LENGTH: 0.35, layout.SHAFT_A: 0.3, layout.SHAFT_B: 0.3, layout.SHAFT_THICK: 0.35,
    },
    BENT: {
        layout.ARC: 0.35, layout.BEND: 0.5, layout.FLAT: 0.15,
        **{layout.GIRTHS + k: 0.35 for k in range(layout.GIRTH_KNOTS)},
    },
}  # fmt: skip
_LIMB = {
    layout.LIMB_AT: 0.12, layout.LIMB_REACH: 0.3, layout.LIMB_SLANT: 0.15, layout.LIMB_THICK: 0.25,
    layout.LIMB_WIDE: 0.25,
}  # fmt: skip
_LOOP = {layout.LIMB_HALF: 0.25, layout.LIMB_CORNER: 0.7}
_SPOUT = {
    layout.SPOUT_AT: 0.12, layout.SPOUT_REACH: 0.3, layout.SPOUT_RISE: 0.4, layout.SPOUT_ROOT: 0.25,
    layout.SPOUT_TIP: 0.25,
}  # fmt: skip
_SMOOTH = 0.10
"""Second difference of a section's deviation from its draw."""

SIZES = {
    TURNED: (
        layout.HEIGHT, *range(layout.RADII, layout.RADII + layout.KNOTS), layout.WALL, layout.FLOOR,
        layout.CORE_X, layout.CORE_Y, layout.LIMB_HALF, layout.LIMB_REACH, layout.LIMB_THICK,
        layout.LIMB_WIDE, layout.SPOUT_REACH, layout.SPOUT_ROOT, layout.SPOUT_TIP,
    ),
    TOOL: tuple(
        range(layout.LENGTH, layout.SLOT_TURN)
    ),
    BENT: (layout.ARC, *range(layout.GIRTHS, layout.GIRTHS + layout.GIRTH_KNOTS)),
}  # fmt: skip


_F = TypeVar("_F", bound=Callable[..., FloatArray])


def _kept_by_code(make: _F) -> _F:
    """Cache what a function returns for each code of a shape."""

    @lru_cache(maxsize=256)
    def kept(code: tuple[int, ...], *rest: bool) -> FloatArray:
        return make(np.array(code), *rest)

    def found(code: IntArray, *rest: bool) -> FloatArray:
        return kept(tuple(int(part) for part in code), *rest)

    return cast(_F, found)


def deviations(code: IntArray) -> dict[int, float]:
    """One standard deviation of each of the kind's own numbers that are free, from its draw."""
    kind = int(code[layout.KIND])
    free = dict(_DEVIATIONS[kind])
    if kind == TURNED:
        if code[layout.HOLLOW] == 0:
            del free[layout.WALL], free[layout.FLOOR]
        if code[layout.PLAN] == CORED:
            free |= {layout.CORE_X: 0.35, layout.CORE_Y: 0.35}
        if code[layout.PLAN] in (SUPER, FLAT_SIDED):
            free |= {layout.ACROSS: 0.25, layout.POWER: 0.3}
        if code[layout.LIMB] != NO_LIMB:
            free |= _LIMB
        if code[layout.LIMB] == LOOP:
            free |= _LOOP
        if code[layout.SPOUT] != 0:
            free |= _SPOUT
    if kind == TOOL:
        for end, head, hole in (
            (layout.END_A, layout.HEAD_A, layout.HOLE_A),
            (layout.END_B, layout.HEAD_B, layout.HOLE_B),
        ):
            if code[end] != PLAIN:
                free |= {head: 0.25, layout.HEAD_THICK: 0.3}
            if code[end] > layout.DISC:
                free[hole] = 0.25
        if layout.SLOT in (code[layout.END_A], code[layout.END_B]):
            free[layout.SLOT_TURN] = 0.2
    return free


def has_yaw(code: IntArray) -> bool:
    """Whether a turn about the vertical changes the shape."""
    plain = code[layout.PLAN] == ROUND and code[layout.LIMB] == NO_LIMB and code[layout.SPOUT] == 0
    return bool(code[layout.KIND] != TURNED or not plain)


@_kept_by_code
def basis_of(code: IntArray, sighted: bool, touched: bool) -> FloatArray:
    """``(n, SIZE)`` every number that is free, by itself."""
    slots = [layout.X, layout.Y, layout.LIFT, layout.TILT_X, layout.TILT_Y, *deviations(code)]
    if has_yaw(code):
        slots.append(layout.YAW)
    if sighted:
        slots += [layout.CAMERA_RIGHT, layout.CAMERA_DOWN, layout.CAMERA_SCALE, layout.OUTLINE]
    if touched:
        slots += [layout.GEL, layout.GEL + 1, layout.GEL + 2]
    return np.asarray(np.eye(layout.SIZE)[np.sort(slots)])


@_kept_by_code
def stand_basis(code: IntArray, two_senses: bool) -> FloatArray:
    """``(n, SIZE)`` directions of place, turn, size and proportions, along which a draw is laid down.

    With ``two_senses``, sight and touch, the picture's shift too: it is what they differ by most.
    """
    kind = int(code[layout.KIND])
    rows = [_along(layout.CAMERA_RIGHT), _along(layout.CAMERA_DOWN)] if two_senses else []
    rows += [_along(layout.X), _along(layout.Y), _along(*SIZES[kind])]
    rows.append(_along({TURNED: layout.HEIGHT, TOOL: layout.LENGTH, BENT: layout.ARC}[kind]))
    if has_yaw(code):
        rows.append(_along(layout.YAW))
    if code[layout.PLAN] == CORED and kind == TURNED:
        rows += [_along(layout.CORE_X), _along(layout.CORE_Y)]
    if code[layout.LIMB] == BAR:
        rows.append(_along(layout.LIMB_REACH))
    return np.array(rows)


def _along(*slots: int) -> FloatArray:
    row = np.zeros(layout.SIZE)
    row[list(slots)] = 1.0
    return row


def bench_rows(place: float, support: float, pixel: float, shift: float, scale: float) -> FloatArray:
    """``(n, SIZE)`` of a prior: place, support, leaning, camera and gel, in their standard deviations."""
    sigmas = {
        layout.X: place, layout.Y: place, layout.LIFT: support, layout.TILT_X: TILT, layout.TILT_Y: TILT,
        layout.CAMERA_RIGHT: shift, layout.CAMERA_DOWN: shift, layout.CAMERA_SCALE: scale,
        layout.OUTLINE: OUTLINE_OFF * pixel,
        layout.GEL: GEL_OFF[0], layout.GEL + 1: GEL_OFF[1], layout.GEL + 2: GEL_OFF[2],
    }  # fmt: skip
    return np.array([_along(slot) / sigma for slot, sigma in sigmas.items()])


@_kept_by_code
def shape_rows(code: IntArray) -> FloatArray:
    """``(n, SIZE)`` of a prior: each free number by itself, and the section's second differences."""
    rows = [_along(slot) / sigma for slot, sigma in deviations(code).items()]
    first, count = {
        TURNED: (layout.RADII, layout.KNOTS), TOOL: (0, 0), BENT: (layout.GIRTHS, layout.GIRTH_KNOTS)
    }[int(code[layout.KIND])]  # fmt: skip
    for k in range(first, first + count - 2):
        rows.append((_along(k) - 2.0 * _along(k + 1) + _along(k + 2)) / _SMOOTH)
    return np.array(rows)


@_kept_by_code
def stand_rows(code: IntArray) -> FloatArray:
    """``(n, SIZE)`` of the prior while a draw is laid on the readings: its size and proportions.

    One length stands for the size, as all scale together; a place has its own rows, any turn is as likely.
    """
    kind = int(code[layout.KIND])
    anchor = {TURNED: layout.RADII, TOOL: layout.SHAFT_A, BENT: layout.GIRTHS + 2}[kind]
    tall = {TURNED: layout.HEIGHT, TOOL: layout.LENGTH, BENT: layout.ARC}[kind]
    rows = [_along(anchor) / 0.4, (_along(tall) - _along(anchor)) / 0.25]
    if code[layout.PLAN] == CORED and kind == TURNED:
        rows += [(_along(slot) - _along(anchor)) / 0.3 for slot in (layout.CORE_X, layout.CORE_Y)]
    if code[layout.LIMB] == BAR:
        rows.append((_along(layout.LIMB_REACH) - _along(anchor)) / 0.3)
    return np.array(rows)


MAX_NUISANCE_COST = 20.0
"""Half the sum of squares of some twelve bench errors, in standard deviations: no calibrated bench has more
(docs/results/shape.md)."""

_NAMES = {
    layout.X: ("its place", "mm", 1e3),
    layout.Y: ("its place", "mm", 1e3),
    layout.LIFT: ("its support's height", "mm", 1e3),
    layout.TILT_X: ("its upright", "deg", np.degrees(1.0)),
    layout.TILT_Y: ("its upright", "deg", np.degrees(1.0)),
    layout.CAMERA_RIGHT: ("the camera's place", "mm", 1e3),
    layout.CAMERA_DOWN: ("the camera's place", "mm", 1e3),
    layout.CAMERA_SCALE: ("the picture's scale", "%", 1e2),
    layout.OUTLINE: ("the mask's border", "mm", 1e3),
    layout.GEL: ("the gel's place", "mm", 1e3),
    layout.GEL + 1: ("the gel's place", "mm", 1e3),
    layout.GEL + 2: ("the gel's place", "mm", 1e3),
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
        return self.cost > MAX_NUISANCE_COST


def nuisance_cost(theta: FloatArray, rows: FloatArray, middle: FloatArray) -> NuisanceCost:
    """Compute the cost of the bench errors in a shape's vector.

    Args:
        theta: ``(SIZE,)`` vector of the shape.
        rows: ``(n, SIZE)``, each one bench error over its standard deviation.
        middle: ``(SIZE,)`` expected vector.
    """
    off = rows @ (theta - middle)
    most = int(np.argmax(np.abs(off)))
    slot = int(np.flatnonzero(rows[most])[0])
    name, unit, factor = _NAMES[slot]
    by = factor * abs(theta[slot] - middle[slot])
    largest = f"{name} off by {by:.1f} {unit}, {abs(off[most]):.0f} standard deviations"
    return NuisanceCost(0.5 * float(off @ off), largest)
