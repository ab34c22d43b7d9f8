"""``L D L^T`` of the dense panel of one supernode, in place and without exchanges."""

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.factor.blas_calls import divide_right, subtract_product

_STRIP = 64
"""Columns that are eliminated between two products."""

_WIDE = 192
"""Columns of a symmetric product that are computed in full."""

DONE = -1
"""Instead of a column: every pivot was taken."""


@compiled
def subtract_lower(
    routines: IntArray,
    rows: int,
    columns: int,
    inner: int,
    left: FloatArray,
    left_at: int,
    left_step: int,
    right: FloatArray,
    right_step: int,
    out: FloatArray,
    out_at: int,
    out_step: int,
) -> None:
    """``out -= left right^T`` on and below the diagonal; above it, what comes."""
    for begin in range(0, columns, _WIDE):
        wide = min(_WIDE, columns - begin)
        subtract_product(
            routines, (rows - begin, wide, inner), left, left_at + begin, left_step,
            right, begin, right_step, out, out_at + begin * (out_step + 1), out_step,
        )  # fmt: skip


@compiled
def _strip(panel: FloatArray, at: int, step: int, width: int, pivots: FloatArray, least: FloatArray) -> int:
    """Eliminate a small dense block in place; returns the column without a pivot, or DONE."""
    for j in range(width):
        column = at + j * step
        pivot = panel[column + j]
        if not abs(pivot) > least[j]:
            return j
        pivots[j] = pivot
        for c in range(j + 1, width):
            share = panel[column + c] / pivot
            other = at + c * step
            for i in range(c, width):
                panel[other + i] -= share * panel[column + i]
        for i in range(j + 1, width):
            panel[column + i] /= pivot
    return DONE


@compiled
def eliminate(
    routines: IntArray,
    panel: FloatArray,
    at: int,
    high: int,
    wide: int,
    pivots: FloatArray,
    least: FloatArray,
    scaled: FloatArray,
) -> int:
    """``L`` of one panel in place of it; returns the column without a pivot, or DONE."""
    for begin in range(0, wide, _STRIP):
        width = min(_STRIP, wide - begin)
        corner = at + begin * (high + 1)
        end = begin + width
        bad = _strip(panel, corner, high, width, pivots[begin:end], least[begin:end])
        if bad != DONE:
            return begin + bad
        below = high - end
        if below == 0:
            break
        divide_right(routines, below, width, panel, corner, high, panel, corner + width, high)
        for j in range(width):
            column, pivot = corner + width + j * high, pivots[begin + j]
            for i in range(below):
                scaled[j * below + i] = panel[column + i]
                panel[column + i] /= pivot
        subtract_lower(
            routines, below, wide - end, width, panel, corner + width, high, scaled, below,
            panel, at + end * (high + 1), high,
        )  # fmt: skip
    return DONE
