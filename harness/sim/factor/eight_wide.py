"""Products of a few columns with eight right sides at a time, eight numbers a register.

A BLAS copies its operands before it multiplies, which costs more than the product where one of
them has eight columns. Here the factor is read once, as it stands. Registers narrower than eight
numbers are used in pairs or more: LLVM splits what the machine does not have.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

EIGHT = 8
_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, EIGHT)
_BYTES = 8
_MAY_FUSE = ("contract",)

_loop: Any = cgutils.for_range
_variable: Any = cgutils.alloca_once


def _at(builder: Any, place: Any, offset: Any, kind: Any) -> Any:
    """Address ``offset`` numbers after ``place``."""
    bytes_on = builder.mul(offset, ir.Constant(ir.IntType(64), _BYTES))
    return builder.inttoptr(builder.add(place, bytes_on), kind.as_pointer())


def _vector(builder: Any, place: Any, row: Any) -> Any:
    """Address of the eight numbers of a row."""
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
