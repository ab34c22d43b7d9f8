"""Calibrate the dots of a gel from pictures of it at rest: where each is, and how well that is known.

One picture is enough; several say by how much a place wanders from one to the next. Pictures of a gel that is
touched are refused: around a contact dots lie off the grid by more than a lens can bend it.

``lay_lattice`` numbers the dots by rows and columns. Directions come from every dot's nearest neighbours,
numbers from walking from dot to dot: each next one is looked for where the last step leads, so that a lens
may bend the rows. One linear map then says how the grid lies, and smooth polynomials what a lens does to it;
what is left of a resting gel is a dot's own misprint.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from calibration.markers.dots import Dots, find_dots
from calibration.taxim.arm.moves import ArmScale, arm_scale
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.picture.dot_lattice import DotLattice

LARGEST_LOCAL = 0.06
"""Of the spacing, by which a dot of a resting gel may be off its smooth grid. In two published pictures of a
touched gel dots are off by an eighth and by a third."""

_FEW, _SHARE = 3, 0.02
"""Dots that may be off by more, and the share of all: misprints. More of them are a contact."""

LARGEST_MOVE = 0.25
"""Pixels rms, by which dots may wander from picture to picture: beyond, the gel was touched or moved."""

LEAST_DOTS = 12
LEAST_LINES = 3
"""Rows, and columns."""

LEAST_ORDER = 0.6
"""Of the neighbours' directions, folded by quarter turns: 1 of a perfect grid, 0 of dots strewn about."""

LEAST_SHARE = 0.8
"""Of all dots that must lie on the grid."""

_NEAR = 0.35
"""Of a step, about where a next dot is expected."""

_OFF = 4.0
_TURNS = 8


@dataclass(frozen=True)
class Printed:
    """What is known of the gel beside its pictures; at most one of pitch and spacing."""

    sensor: str = "tactile camera"  #: make.
    serial: str = "unknown"  #: of the gel.
    pitch: float | None = None  #: m a pixel.
    spacing: float | None = None  #: m from dot to dot of the print: millimetres a pixel follow.


@dataclass(frozen=True, eq=False)
class RestingMarkers:
    """The dots of a gel at rest."""

    picture: ByteArray  #: ``(rows, columns, 3)`` mean of the pictures.
    dots: Dots  #: of that mean.
    lattice: DotLattice  #: through them.
    scale: ArmScale | None
    """how the picture lies on the gel, by the print's spacing; None where that is not known."""
    pitch: float | None  #: m a pixel; None where nothing told it.
    wander: float | None  #: pixels rms, of a dot from picture to picture; None of one picture.
    misprinted: tuple[int, ...]  #: places in ``dots`` that lie off their grid by more than ``LARGEST_LOCAL``.
    seconds: float  #: that it took.


def markers_at_rest(pictures: Sequence[ByteArray], printed: Printed) -> RestingMarkers:
    """Find the dots.

    Args:
        pictures: ``(rows, columns, 3)`` each, of one gel at rest.
        printed: what is known of it.

    Raises:
        CalibrationRefused: pictures that do not belong together, no grid of dots, or a touched gel.
        OutOfDomain: no picture, or both a pitch and a spacing.
    """
    began = perf_counter()
    if not pictures:
        raise OutOfDomain("no picture of the resting gel came; give one, or a folder of them")
    if printed.pitch is not None and printed.spacing is not None:
        raise OutOfDomain(
            "both a pitch and the print's spacing came, and each gives the other: leave one out"
        )
    shapes = sorted({picture.shape for picture in pictures})
    if len(shapes) > 1:
        sizes = " and ".join(f"{shape[1]} x {shape[0]}" for shape in shapes)
        raise CalibrationRefused(
            f"the pictures have {sizes} pixels; those of one camera at one resolution are wanted"
        )
    # Products of a few numbers a dot: threads would wait for one another.
    with threadpool_limits(limits=1, user_api="blas"):
        mean = np.round(np.mean(np.stack(pictures), axis=0, dtype=np.float64)).astype(np.uint8)
        dots = find_dots(mean)
        lattice = lay_lattice(dots.places)
        misprinted = _resting(dots, lattice)
        wander = _wander(pictures, dots, lattice)
        scale: ArmScale | None = None
        if printed.spacing is not None:
            # The print's rows are the gel's own x; errors are those of the places.
            on = lattice.on
            on_gel = printed.spacing * lattice.index[on].astype(np.float64)
            try:
                scale = arm_scale([dots.places[on]], on_gel)
            except CalibrationRefused as refused:
                raise CalibrationRefused(
                    f"the print is no scale of {1e3 * printed.spacing:g} mm: {refused}"
                ) from refused
    pitch = printed.pitch if scale is None else scale.pitch.value
    return RestingMarkers(
        read_only(mean), dots, lattice, scale, pitch, wander, misprinted, perf_counter() - began
    )


def _resting(dots: Dots, lattice: DotLattice) -> tuple[int, ...]:
    """Dots that were misprinted; refuses a gel that is touched."""
    off = np.hypot(lattice.local[:, 0], lattice.local[:, 1]) / lattice.spacing
    far = np.flatnonzero(off > LARGEST_LOCAL)
    if len(far) >= _FEW and len(far) > _SHARE * len(off):
        worst = int(far[np.argmax(off[far])])
        x, y = dots.places[worst]
        raise CalibrationRefused(
            f"{len(far)} of {len(off)} dots lie off their grid by more than {LARGEST_LOCAL:.0%} of its "
            f"spacing, the one at column {x:.0f}, row {y:.0f} by {off[worst]:.0%}: the gel is touched there; "
            "take pictures of it at rest"
        )
    return tuple(int(k) for k in far)


def _wander(pictures: Sequence[ByteArray], dots: Dots, lattice: DotLattice) -> float | None:
    """Pixels rms of a coordinate between single pictures; dots that only some show do not count."""
    if len(pictures) < 2:
        return None
    seen = []
    for picture in pictures:
        found = find_dots(picture).places
        away, at = (np.asarray(one) for one in cKDTree(found).query(dots.places))
        seen.append(np.where((away < 0.25 * lattice.spacing)[:, None], found[at], np.nan))
    every: FloatArray = np.array(seen)
    shown: BoolArray = np.asarray(np.isfinite(every).all(axis=(0, 2)), dtype=np.bool_)
    if shown.mean() < 0.9:
        raise CalibrationRefused(
            f"{int(shown.sum())} of {len(shown)} dots are in every picture: they are not of one gel at rest"
        )
    wander = float(np.sqrt(np.var(every[:, shown], axis=0, ddof=1).mean()))
    if wander > LARGEST_MOVE:
        raise CalibrationRefused(
            f"dots wander by {wander:.2f} px rms from picture to picture (at most {LARGEST_MOVE:g}): the gel "
            "was touched in some, or the sensor moved in its mount"
        )
    return wander


def lay_lattice(places: FloatArray) -> DotLattice:
    """Lay a grid through dots at ``(n, 2)`` pixels (column, row).

    Raises:
        CalibrationRefused: too few dots, or dots that are on no grid.
    """
    if len(places) < LEAST_DOTS:
        raise CalibrationRefused(
            f"{len(places)} whole dots are in the picture; at least {LEAST_DOTS} are needed to tell a grid: "
            "is this the marked gel, in focus, and all of it in the picture?"
        )
    # From a dot to the next to the right and to the next below, ``(2,)`` pixels each.
    near: IntArray = np.asarray(cKDTree(places).query(places, k=5)[1])
    apart = (places[near[:, 1:]] - places[:, None]).reshape(-1, 2)
    angle = np.arctan2(apart[:, 1], apart[:, 0])
    folded = np.mean(np.exp(4j * angle))
    if abs(folded) < LEAST_ORDER:
        raise CalibrationRefused(
            f"the dots' neighbours lie in all directions (order {abs(folded):.2f} of 1, {LEAST_ORDER:g} "
            "wanted): these are not rows and columns of a print, but dirt, or another pattern"
        )
    turn = float(np.angle(folded)) / 4.0
    across, down = _along(apart, turn), _along(apart, turn + 0.5 * np.pi)
    index = _walked(places, across, down)
    on = index[:, 0] >= 0
    if (
        on.sum() < max(LEAST_DOTS, LEAST_SHARE * len(places))
        or (np.ptp(index[on], axis=0) < LEAST_LINES - 1).any()
    ):
        raise CalibrationRefused(
            f"{int(on.sum())} of {len(places)} dark dots lie on one grid of {LEAST_LINES} rows and columns "
            f"or more; at least {LEAST_SHARE:.0%} of them are wanted: clean the gel, and light it evenly"
        )
    origin, step, affine = _affine(places, index, on)
    local = np.full_like(affine, np.nan)
    local[on] = _bent(index[on].astype(np.float64), affine[on])
    every = {(c, r) for c in range(int(index[:, 0].max()) + 1) for r in range(int(index[:, 1].max()) + 1)}
    missing = sorted(every - {(int(c), int(r)) for c, r in index[on]})
    return DotLattice(
        read_only(index),
        read_only(origin),
        read_only(step),
        read_only(affine),
        read_only(local),
        read_only(np.array(missing, dtype=np.int64).reshape(-1, 2)),
    )


def _along(apart: FloatArray, direction: float) -> FloatArray:
    towards = np.array([np.cos(direction), np.sin(direction)])
    length = apart @ towards
    close = np.abs(length) > 0.94 * np.hypot(apart[:, 0], apart[:, 1])
    if not close.any():
        raise CalibrationRefused("the dots stand in single lines: rows and columns of a grid are wanted")
    forward = apart[close] * np.sign(length[close])[:, None]
    # Past a missing dot the next is two steps on: the median of the nearer half is one step.
    size = np.abs(length[close])
    step: FloatArray = np.median(forward[size <= 1.5 * np.percentile(size, 25.0)], axis=0)
    return step


def _walked(places: FloatArray, across: FloatArray, down: FloatArray) -> IntArray:
    tree = cKDTree(places)
    index = np.full((len(places), 2), np.iinfo(np.int64).min)
    first = int(tree.query(np.median(places, axis=0))[1])
    index[first] = 0
    taken = {(0, 0): first}
    waiting = deque([(first, across, down)])
    while waiting:
        here, right, below = waiting.popleft()
        for turn, way in (((1, 0), right), ((-1, 0), -right), ((0, 1), below), ((0, -1), -below)):
            away, there = tree.query(places[here] + way)
            number = (int(index[here, 0]) + turn[0], int(index[here, 1]) + turn[1])
            if away > _NEAR * np.hypot(*way) or index[there, 0] > np.iinfo(np.int64).min or number in taken:
                continue
            index[there], taken[number] = number, int(there)
            went = (places[there] - places[here]) * (turn[0] + turn[1])
            # Half of what was seen: one dot's misprint must not lead the walk astray.
            step = (0.5 * (right + went), below) if turn[0] else (right, 0.5 * (below + went))
            waiting.append((int(there), *step))
    reached = index[:, 0] > np.iinfo(np.int64).min
    index[reached] -= index[reached].min(axis=0)
    index[~reached] = -1
    return index


def _affine(places: FloatArray, index: IntArray, on: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Origin, steps and what is off them; dots that are off by far do not count."""
    terms = np.column_stack([np.ones(len(index)), index.astype(np.float64)])
    kept = on.copy()
    for _ in range(_TURNS):
        solved = np.linalg.lstsq(terms[kept], places[kept], rcond=None)[0]
        off = places - terms @ solved
        size = np.hypot(off[:, 0], off[:, 1])
        again = on & (size <= max(_OFF * float(np.median(size[kept])), 1e-9))
        if np.array_equal(again, kept):
            break
        kept = again
    off[~on] = np.nan
    return solved[0], np.ascontiguousarray(solved[1:].T), off


def _bent(index: FloatArray, off: FloatArray) -> FloatArray:
    """What is left of ``off`` once a smooth polynomial of the dot's number is taken out, robustly."""
    scaled = 2.0 * (index - index.min(axis=0)) / np.maximum(np.ptp(index, axis=0), 1.0) - 1.0
    degree = 3 if len(index) >= 30 else 2 if len(index) >= 18 else 1
    powers = [(a, b) for a in range(degree + 1) for b in range(degree + 1 - a)]
    terms = np.stack([scaled[:, 0] ** a * scaled[:, 1] ** b for a, b in powers], axis=1)
    weight = np.ones(len(index))
    for _ in range(_TURNS):
        root = np.sqrt(weight)[:, None]
        left = off - terms @ np.linalg.lstsq(terms * root, off * root, rcond=None)[0]
        size = np.hypot(left[:, 0], left[:, 1])
        weight = 1.0 / (1.0 + (size / max(2.0 * float(np.median(size)), 1e-9)) ** 2) ** 2
    bent: FloatArray = left
    return bent
