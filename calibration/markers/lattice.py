"""Which dot is which: rows and columns of a printed grid, however it lies in the picture.

Directions come from every dot's nearest neighbours, numbers from walking from dot to dot: each next one is
looked for where the last step leads, so that a lens may bend the rows. One linear map then says how the grid
lies, and smooth polynomials what a lens does to it; what is left of a resting gel is a dot's own misprint.
"""

from collections import deque

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.picture.dot_lattice import DotLattice

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
    across, down = _steps(places)
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


def _steps(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From a dot to the next to the right and to the next below, ``(2,)`` pixels each."""
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
    return _along(apart, turn), _along(apart, turn + 0.5 * np.pi)


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
