"""Loops of a multifrontal ``L D L^T`` without exchanges.

Duff and Reid, The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations, ACM
TOMS 9(3), 1983. Each supernode is a dense panel ``(k + r, k)``, column by column: its own rows,
then the rows below. What it takes from the rows below is the front ``(r, r)`` that its parent adds.

Two routines of the BLAS that scipy carries, to be called from compiled loops.

numba's own products want whole arrays; a sparse factor works in place on parts of large ones.
Matrices are parts of flat arrays, read column by column: the array, where it begins, and how far
its columns are apart. The routines are those of Dongarra, Du Croz, Hammarling and Duff, A Set of
Level 3 Basic Linear Algebra Subprograms, ACM TOMS 16(1), 1990.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.sim.factor.elimination import Elimination

OUTSIDE = -2
"""Instead of a column: the matrix has an entry where the plan has none."""

_STRIP = 64
"""Columns that are eliminated between two products."""

_WIDE = 192
"""Columns of a symmetric product that are computed in full."""

DONE = -1
"""Instead of a column: every pivot was taken."""

_NO, _YES, _RIGHT, _LOWER, _UNIT = (ord(letter) for letter in "NTRLU")
_stored: Any = cgutils.alloca_once_value
_parts: Any = cgutils.unpack_tuple


@compiled
def _subtract_front(
    routines: IntArray,
    panel: FloatArray,
    at: int,
    wide: int,
    high: int,
    pivots: FloatArray,
    scaled: FloatArray,
    front: FloatArray,
) -> None:
    """``front -= L D L^T`` of the rows below a panel that is eliminated."""
    rest = high - wide
    for j in range(wide):
        column = at + j * high + wide
        for i in range(rest):
            scaled[j * rest + i] = panel[column + i] * pivots[j]
    subtract_lower(routines, rest, rest, wide, panel, at + wide, high, scaled, rest, front, 0, rest)


@compiled
def _add_original(
    data: FloatArray,
    indices: AnyArray,
    indptr: AnyArray,
    plan: Elimination,
    first: int,
    wide: int,
    high: int,
    where: IntArray,
    panel: FloatArray,
    at: int,
) -> int:
    """Put the matrix's own entries into a panel; returns DONE or OUTSIDE."""
    for j in range(wide):
        column = plan.order[first + j]
        for p in range(indptr[column], indptr[column + 1]):
            row = plan.rank[indices[p]]
            if row >= first + j:
                if where[row] < 0:
                    return OUTSIDE
                panel[at + j * high + where[row]] += data[p]
    return DONE


@compiled
def _add_front(
    stack: FloatArray,
    from_: int,
    size: int,
    places: IntArray,
    wide: int,
    high: int,
    panel: FloatArray,
    at: int,
    front: FloatArray,
) -> None:
    """Add what a child left, its row ``i`` at ``places[i]`` of the parent."""
    rest = high - wide
    for j in range(size):
        place, column = places[j], from_ + j * size
        if place < wide:
            to = at + place * high
            for i in range(j, size):
                panel[to + places[i]] += stack[column + i]
        else:
            to = (place - wide) * rest - wide
            for i in range(j, size):
                front[to + places[i]] += stack[column + i]


@compiled
def _grow(
    panel: FloatArray,
    at: int,
    wide: int,
    high: int,
    pivots: FloatArray,
    first: int,
    rows: IntArray,
    sums: FloatArray,
) -> None:
    """Add ``sum_j L_ij^2 |d_j|`` of a panel to every row's."""
    here = np.zeros(high)
    for j in range(wide):
        size, column = abs(pivots[j]), at + j * high
        here[j] += size
        for i in range(j + 1, high):
            here[i] += size * panel[column + i] * panel[column + i]
    for i in range(wide):
        sums[first + i] += here[i]
    for i in range(len(rows)):
        sums[rows[i]] += here[wide + i]


@compiled
def _add_children(
    plan: Elimination,
    s: int,
    waiting: IntArray,
    depth: int,
    top: int,
    stack: FloatArray,
    where: IntArray,
    places: IntArray,
    panel: FloatArray,
    at: int,
    front: FloatArray,
) -> tuple[int, int]:
    """Add what the children of a supernode left; returns what of the stack is left."""
    wide = plan.firsts[s + 1] - plan.firsts[s]
    high = wide + plan.starts[s + 1] - plan.starts[s]
    for _ in range(plan.children[s]):
        depth -= 1
        begin = plan.starts[waiting[depth]]
        size = plan.starts[waiting[depth] + 1] - begin
        top -= size * size
        for i in range(size):
            places[i] = where[plan.rows[begin + i]]
        _add_front(stack, top, size, places, wide, high, panel, at, front)
    return depth, top


@compiled
def factorise(
    routines: IntArray,
    data: FloatArray,
    indices: AnyArray,
    indptr: AnyArray,
    plan: Elimination,
    panels: FloatArray,
    panel_at: IntArray,
    least: FloatArray,
    pivots: FloatArray,
    sums: FloatArray,
    work: FloatArray,
    front: FloatArray,
    stack: FloatArray,
) -> int:
    """Fill ``panels``, ``pivots`` and ``sums``; returns DONE, OUTSIDE or the column without a pivot.

    Args:
        routines: of ``blas_addresses``.
        data: of the whole matrix, column by column.
        indices: its rows.
        indptr: where its columns begin.
        plan: of the elimination.
        panels: where the supernodes' panels go.
        panel_at: ``(s,)`` where each begins; it may be one place for all.
        least: ``(u,)`` sizes that a pivot must be above.
        pivots: ``(u,)``, written.
        sums: ``(u,)`` zeros, to which ``sum_j L_ij^2 |d_j|`` is added.
        work: of the largest panel.
        front: of the largest front.
        stack: of the most that fronts take at once.
    """
    where = np.full(len(plan.order), -1, np.int64)
    places = np.empty(len(plan.order), np.int64)
    waiting = np.empty(len(plan.firsts), np.int64)
    depth, top = 0, 0
    for s in range(len(plan.children)):
        first, wide = plan.firsts[s], plan.firsts[s + 1] - plan.firsts[s]
        under = plan.rows[plan.starts[s] : plan.starts[s + 1]]
        rest = len(under)
        high, at, end = wide + rest, panel_at[s], first + wide
        panels[at : at + high * wide] = 0.0
        front[: rest * rest] = 0.0
        for i in range(wide):
            where[first + i] = i
        for i in range(rest):
            where[under[i]] = wide + i
        if _add_original(data, indices, indptr, plan, first, wide, high, where, panels, at) != DONE:
            return OUTSIDE
        depth, top = _add_children(
            plan, s, waiting, depth, top, stack, where, places, panels, at, front
        )  # fmt: skip
        where[first:end] = -1
        for i in range(rest):
            where[under[i]] = -1
        bad = eliminate(routines, panels, at, high, wide, pivots[first:end], least[first:end], work)
        if bad != DONE:
            return int(first + bad)
        _grow(panels, at, wide, high, pivots[first:end], first, under, sums)
        if rest > 0:
            _subtract_front(routines, panels, at, wide, high, pivots[first:end], work, front)
            copy_line(stack[top:], front[: rest * rest])
            waiting[depth] = s
            depth, top = depth + 1, top + rest * rest
    return DONE


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


def _fortran_code(_typing: Any, address: Any, values: Any) -> Any:
    """Typing and code of a call by reference; 64-bit integers among the values are places of numbers."""

    def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        number = ir.DoubleType().as_pointer()
        references = [
            builder.inttoptr(value, number)
            if kind in (types.int64, types.uint64)
            else _stored(builder, value)
            for kind, value in zip(values.types, _parts(builder, given[1]), strict=True)
        ]
        kind = ir.FunctionType(ir.VoidType(), [reference.type for reference in references])
        builder.call(builder.inttoptr(given[0], kind.as_pointer()), references)
        return context.get_dummy_value()

    return types.void(address, values), generate


_fortran: Any = intrinsic(_fortran_code)


@compiled
def subtract_product(
    routines: IntArray,
    shape: tuple[int, int, int],
    left: FloatArray,
    left_at: int,
    left_step: int,
    right: FloatArray,
    right_at: int,
    right_step: int,
    out: FloatArray,
    out_at: int,
    out_step: int,
) -> None:
    """``out -= left right^T`` of ``(m, k)`` and ``(n, k)``, given as ``(m, n, k)``."""
    _fortran(
        routines[0],
        (
            types.int8(_NO), types.int8(_YES), types.int32(shape[0]), types.int32(shape[1]),
            types.int32(shape[2]), -1.0, left.ctypes.data + 8 * left_at, types.int32(left_step),
            right.ctypes.data + 8 * right_at, types.int32(right_step), 1.0,
            out.ctypes.data + 8 * out_at, types.int32(out_step),
        ),
    )  # fmt: skip


@compiled
def divide_right(
    routines: IntArray,
    rows: int,
    columns: int,
    lower: FloatArray,
    lower_at: int,
    lower_step: int,
    out: FloatArray,
    out_at: int,
    out_step: int,
) -> None:
    """``out = out inverse(lower^T)`` of ``(rows, columns)``.

    The diagonal of ``lower`` is taken as one and not read.
    """
    _fortran(
        routines[1],
        (
            types.int8(_RIGHT), types.int8(_LOWER), types.int8(_YES), types.int8(_UNIT),
            types.int32(rows), types.int32(columns), 1.0, lower.ctypes.data + 8 * lower_at,
            types.int32(lower_step), out.ctypes.data + 8 * out_at, types.int32(out_step),
        ),
    )  # fmt: skip
