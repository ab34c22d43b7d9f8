"""``L D L^T`` of a sparse symmetric matrix: solves for blocks, and how many eigenvalues are below zero.

Pivots are taken on the diagonal in the plan's order, without exchanges: always stable where the
matrix is positive definite, and measured by ``growth`` where it is not.

Products of a few columns with eight right sides at a time, eight numbers a register.

A BLAS copies its operands before it multiplies, which costs more than the product where one of
them has eight columns. Here the factor is read once, as it stands. Registers narrower than eight
numbers are used in pairs or more: LLVM splits what the machine does not have.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse as sp
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.basics.errors import MeshRefused, WrongUse
from harness.sim.factor.elimination import Elimination
from harness.sim.factor.kernels import DONE, OUTSIDE, factorise

SparseColumns: TypeAlias = "sp.csc_array[Any]"

_LOST = 1e-13
"""Of its diagonal entry, below which a pivot is rounding: about 500 units of the last place."""

EIGHT = 8
_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, EIGHT)
_BYTES = 8
_MAY_FUSE = ("contract",)
_loop: Any = cgutils.for_range
_variable: Any = cgutils.alloca_once


@dataclass(frozen=True, eq=False)
class Pivots:
    """What the elimination of a symmetric matrix says of its eigenvalues."""

    values: FloatArray  #: ``(u,)`` diagonal of ``D``, in the plan's order.
    growth: float
    """the largest ``sum_j L_ij^2 |d_j| / |A_ii|``, by which the matrix that was in fact factorised may be
    further from the given one than rounding; 1 for a positive definite one."""

    @property
    def negative(self) -> int:
        """How many eigenvalues are below zero (Sylvester's law of inertia)."""
        return int(np.count_nonzero(self.values < 0.0))


@dataclass(frozen=True, eq=False)
class Factor:
    """The factors of one matrix."""

    plan: Elimination  #: of the elimination.
    panels: FloatArray  #: the columns of ``L``, supernode by supernode.
    pivots: Pivots  #: ``D``.

    def solve(self, block: FloatArray) -> FloatArray:
        """``(u, b)``: what the matrix turns into ``block``, ``(u, b)`` float64.

        Raises:
            WrongUse: another shape or type.
        """
        unknowns = len(self.plan.order)
        if block.ndim != 2 or block.shape[0] != unknowns or block.dtype != np.float64:
            raise WrongUse(
                f"a block of shape {block.shape} and type {block.dtype} was to be solved; it must be "
                f"({unknowns}, columns) of float64"
            )
        solved, places = np.empty(block.shape), _places(self.plan)
        for begin in range(0, block.shape[1], EIGHT):
            part = block[:, begin : begin + EIGHT]
            eight = np.zeros((unknowns, EIGHT))
            eight[:, : part.shape[1]] = part[self.plan.order]
            solve(self.plan, self.panels, places, self.pivots.values, eight)
            solved[self.plan.order, begin : begin + EIGHT] = eight[:, : part.shape[1]]
        return solved


def factorised(matrix: SparseColumns, plan: Elimination) -> Factor:
    """The factors of a symmetric matrix, both halves given.

    Raises:
        MeshRefused: a pivot is zero to rounding, as at a node that no element holds.
        WrongUse: not float64, or entries outside the plan.
    """
    panels = np.empty(plan.stored)
    pivots, bad = _eliminated(matrix, plan, panels, _places(plan))
    if bad is not None:
        raise MeshRefused(
            f"the stiffness of the object cannot be factorised: unknown {bad} has a pivot below {_LOST:g} of "
            "its diagonal entry; its volume mesh has a node that no element holds, or an element without "
            "volume: mesh the object again"
        )
    return Factor(plan, panels, pivots)


def inertia(matrix: SparseColumns, plan: Elimination) -> Pivots | None:
    """The pivots alone, in the memory of one panel; None where one is zero to rounding.

    A matrix that is singular has such a pivot; one that is not may have it, as its pivots are not
    exchanged, and another shift then has none.

    Raises:
        WrongUse: not float64, or entries outside the plan.
    """
    largest = int((plan.widths * (plan.widths + plan.heights)).max(initial=0))
    places = np.zeros(len(plan.children), dtype=np.int64)
    pivots, bad = _eliminated(matrix, plan, np.empty(largest), places)
    return pivots if bad is None else None


def _places(plan: Elimination) -> IntArray:
    return np.concatenate([[0], np.cumsum(plan.widths * (plan.widths + plan.heights))])


def _eliminated(
    matrix: SparseColumns, plan: Elimination, panels: FloatArray, places: IntArray
) -> tuple[Pivots, int | None]:
    """The pivots, and the unknown at which they ended early."""
    unknowns = len(plan.order)
    if matrix.shape != (unknowns, unknowns) or matrix.dtype != np.float64:
        raise WrongUse(
            f"a matrix of shape {matrix.shape} and type {matrix.dtype} was to be factorised by a plan for "
            f"({unknowns}, {unknowns}) of float64"
        )
    high = plan.widths + plan.heights
    diagonal = np.abs(matrix.diagonal())[plan.order]
    values, sums = np.empty(unknowns), np.zeros(unknowns)
    names = ("dgemm", "dtrsm")
    bad = factorise(
        np.array([get_cython_function_address("scipy.linalg.cython_blas", name) for name in names]),
        matrix.data,
        matrix.indices,
        matrix.indptr,
        plan,
        panels,
        places,
        _LOST * diagonal,
        values,
        sums,
        np.empty(int((plan.widths * high).max(initial=1))),
        np.empty(int((plan.heights**2).max(initial=1))),
        np.empty(_deepest(plan)),
    )
    if bad == OUTSIDE:
        raise WrongUse("the matrix has entries where its plan has none; make the plan of its own pattern")
    if bad != DONE:
        return Pivots(values, np.inf), int(plan.order[bad])
    growth = np.divide(sums, diagonal, out=np.full(unknowns, np.inf), where=diagonal > 0.0)
    return Pivots(values, float(growth.max(initial=1.0))), None


def _deepest(plan: Elimination) -> int:
    """Numbers that the fronts take at most while they wait."""
    waiting: list[int] = []
    held = most = 0
    for left, count in zip((plan.heights**2).tolist(), plan.children.tolist(), strict=True):
        for _ in range(count):
            held -= waiting.pop()
        if left:
            waiting.append(left)
            held += left
        most = max(most, held)
    return max(most, 1)


@compiled
def _group(left: int) -> int:
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


def _at(builder: Any, place: Any, offset: Any, kind: Any) -> Any:
    """Address ``offset`` numbers after ``place``."""
    bytes_on = builder.mul(offset, ir.Constant(ir.IntType(64), _BYTES))
    return builder.inttoptr(builder.add(place, bytes_on), kind.as_pointer())


def _vector(builder: Any, place: Any, row: Any) -> Any:
    return _at(builder, place, builder.mul(row, ir.Constant(ir.IntType(64), EIGHT)), _VECTOR)


def _spread(builder: Any, place: Any, offset: Any) -> Any:
    """One number, eight times."""
    number = builder.load(_at(builder, place, offset, _NUMBER), align=_BYTES)
    first = ir.Constant(ir.IntType(32), 0)
    alone = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, first)
    return builder.shuffle_vector(
        alone, alone, ir.Constant(ir.VectorType(ir.IntType(32), EIGHT), [0] * EIGHT)
    )


def _fused(builder: Any, left: Any, right: Any, sum_: Any) -> Any:
    """``left right + sum_``, in one instruction where the machine has it."""
    return builder.fadd(builder.fmul(left, right, flags=_MAY_FUSE), sum_, flags=_MAY_FUSE)


def _constant(number: int) -> Any:
    return ir.Constant(ir.IntType(64), number)


def _subtracting(columns: int) -> Callable[..., Any]:
    """Code of ``rows -= a known``, ``(n, 8)``, ``(n, columns)`` and ``(columns, 8)``.

    Called with the addresses of ``rows`` and ``a``, the numbers from one column of ``a`` to the
    next, the address of ``known``, and ``n``.
    """

    def code(_typing: Any, _rows: Any, _a: Any, _step: Any, _known: Any, _count: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            out, left, apart, right, number = given
            minus = [
                builder.fneg(builder.load(_vector(builder, right, _constant(q)), align=_BYTES))
                for q in range(columns)
            ]
            starts = [builder.mul(apart, _constant(q)) for q in range(columns)]
            with _loop(builder, number) as loop:
                to = _vector(builder, out, loop.index)
                sum_ = builder.load(to, align=_BYTES)
                for start, taken in zip(starts, minus, strict=True):
                    sum_ = _fused(
                        builder, _spread(builder, left, builder.add(start, loop.index)), taken, sum_
                    )
                builder.store(sum_, to, align=_BYTES)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 5), generate

    return code


def _gathering(columns: int) -> Callable[..., Any]:
    """Code of ``known -= a^T rows``, called as ``_subtracting`` is."""

    def code(_typing: Any, _rows: Any, _a: Any, _step: Any, _known: Any, _count: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            source, left, apart, right, number = given
            starts = [builder.mul(apart, _constant(q)) for q in range(columns)]
            sums = [_variable(builder, _VECTOR) for _ in range(columns)]
            for sum_ in sums:
                builder.store(ir.Constant(_VECTOR, [0.0] * EIGHT), sum_)
            with _loop(builder, number) as loop:
                row = builder.load(_vector(builder, source, loop.index), align=_BYTES)
                for start, sum_ in zip(starts, sums, strict=True):
                    factor = _spread(builder, left, builder.add(start, loop.index))
                    builder.store(_fused(builder, factor, row, builder.load(sum_)), sum_)
            for q, sum_ in enumerate(sums):
                to = _vector(builder, right, _constant(q))
                rest = builder.fsub(builder.load(to, align=_BYTES), builder.load(sum_))
                builder.store(rest, to, align=_BYTES)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 5), generate

    return code


subtract_8: Any = intrinsic(_subtracting(8))
subtract_4: Any = intrinsic(_subtracting(4))
subtract_1: Any = intrinsic(_subtracting(1))
gather_8: Any = intrinsic(_gathering(8))
gather_4: Any = intrinsic(_gathering(4))
gather_1: Any = intrinsic(_gathering(1))
