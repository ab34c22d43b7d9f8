"""Solving with the supernodes of an ``L D L^T`` for eight right sides at a time."""

from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.sim.factor.eight_wide import (
    EIGHT,
    gather_1,
    gather_4,
    gather_8,
    subtract_1,
    subtract_4,
    subtract_8,
)
from harness.sim.factor.elimination import Elimination


@compiled
def _group(left: int) -> int:
    """Columns taken at once of those that are left."""
    if left >= 8:
        return 8
    return 4 if left >= 4 else 1


@compiled
def _forward(panel: int, high: int, wide: int, lines: int) -> None:
    """``lines``, ``(high, 8)``: the first ``wide`` rows are solved, the others lose their part.

    Both arrays are given by their addresses; a row of eight numbers takes 64 bytes.
    """
    done = 0
    while done < wide:
        many = _group(wide - done)
        for q in range(many - 1):
            column = done + q
            subtract_1(
                lines + 64 * (column + 1), panel + 8 * (column * (high + 1) + 1), high, lines + 64 * column,
                many - 1 - q,
            )  # fmt: skip
        end = done + many
        rows, a, known, rest = (
            lines + 64 * end,
            panel + 8 * (done * high + end),
            lines + 64 * done,
            high - end,
        )
        if many == 8:
            subtract_8(rows, a, high, known, rest)
        elif many == 4:
            subtract_4(rows, a, high, known, rest)
        else:
            subtract_1(rows, a, high, known, rest)
        done = end


@compiled
def _backward(panel: int, high: int, wide: int, lines: int) -> None:
    """The other way round: the rows below are known, the first ``wide`` are solved."""
    end = wide
    while end > 0:
        many = _group(end)
        begin = end - many
        rows, a, known, rest = (
            lines + 64 * end,
            panel + 8 * (begin * high + end),
            lines + 64 * begin,
            high - end,
        )
        if many == 8:
            gather_8(rows, a, high, known, rest)
        elif many == 4:
            gather_4(rows, a, high, known, rest)
        else:
            gather_1(rows, a, high, known, rest)
        for column in range(end - 2, begin - 1, -1):
            gather_1(
                lines + 64 * (column + 1), panel + 8 * (column * (high + 1) + 1), high, lines + 64 * column,
                end - 1 - column,
            )  # fmt: skip
        end = begin


@compiled
def solve(
    plan: Elimination, panels: FloatArray, panel_at: IntArray, pivots: FloatArray, block: FloatArray
) -> None:
    """``block``, ``(u, 8)`` in the new order, becomes the solution.

    Args:
        plan: of the elimination.
        panels: as ``factorise`` filled them.
        panel_at: ``(s,)`` where each begins.
        pivots: ``(u,)``.
        block: right sides.
    """
    supernodes, most = len(plan.children), 0
    for s in range(supernodes):
        most = max(most, plan.firsts[s + 1] - plan.firsts[s] + plan.starts[s + 1] - plan.starts[s])
    lines = np.empty((most, EIGHT))
    line_place: Any = np.int64(lines.ctypes.data)
    panel_place: Any = np.int64(panels.ctypes.data)
    for s in range(supernodes):
        first, end = plan.firsts[s], plan.firsts[s + 1]
        rows, wide = plan.rows[plan.starts[s] : plan.starts[s + 1]], end - first
        for i in range(wide):
            copy_line(lines[i], block[first + i])
        lines[wide : wide + len(rows)] = 0.0
        _forward(panel_place + 8 * panel_at[s], wide + len(rows), wide, line_place)
        for i in range(wide):
            copy_line(block[first + i], lines[i])
        for i in range(len(rows)):
            for c in range(EIGHT):
                block[rows[i], c] += lines[wide + i, c]
    for i in range(len(block)):
        for c in range(EIGHT):
            block[i, c] /= pivots[i]
    for s in range(supernodes - 1, -1, -1):
        first, end = plan.firsts[s], plan.firsts[s + 1]
        rows, wide = plan.rows[plan.starts[s] : plan.starts[s + 1]], end - first
        for i in range(wide):
            copy_line(lines[i], block[first + i])
        for i in range(len(rows)):
            for c in range(EIGHT):
                lines[wide + i, c] = block[rows[i], c]
        _backward(panel_place + 8 * panel_at[s], wide + len(rows), wide, line_place)
        for i in range(wide):
            copy_line(block[first + i], lines[i])
