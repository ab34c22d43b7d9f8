"""Eight pixels of a z-buffer at a time.

A triangle's rows are a few pixels long: as a loop over pixels they cost a jump each, and the compiler's own
vectors only begin at rows much longer than that.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

EIGHT = 8
_NUMBERS = ir.VectorType(ir.DoubleType(), EIGHT)
_INT = ir.IntType(32)


def _eight(builder: Any, number: Any) -> Any:
    """One number, eight times."""
    alone = builder.insert_element(ir.Constant(_NUMBERS, ir.Undefined), number, ir.Constant(_INT, 0))
    return builder.shuffle_vector(alone, alone, ir.Constant(ir.VectorType(_INT, EIGHT), [0] * EIGHT))


def _code(
    _typing: Any, _place: Any, _first: Any, _step: Any, _low: Any, _high: Any, _before: Any, _count: Any
) -> Any:
    """Eight neighbours hold the nearer of what they have and of a plane, those of a row alone.

    Called with the address of the first of them, z at the row's first pixel and its step from pixel to pixel,
    the least and the greatest z that it may have, how many pixels after the row's first one the eight begin
    (below zero for before it) and how many the row has.
    """

    def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        place = builder.inttoptr(given[0], _NUMBERS.as_pointer())
        first, step, low, high, before, count = (_eight(builder, number) for number in given[1:])
        along = builder.fadd(before, ir.Constant(_NUMBERS, [float(k) for k in range(EIGHT)]))
        # A product and a sum, never fused: the same bits on every machine.
        z = builder.fadd(first, builder.fmul(step, along))
        # Rounding on a steep triangle must not leave the triangle.
        z = builder.select(builder.fcmp_ordered(">", z, low), z, low)
        z = builder.select(builder.fcmp_ordered("<", z, high), z, high)
        old = builder.load(place, align=8)
        of_row = builder.and_(
            builder.fcmp_ordered(">=", along, ir.Constant(_NUMBERS, [0.0] * EIGHT)),
            builder.fcmp_ordered("<", along, count),
        )
        nearer = builder.and_(of_row, builder.fcmp_ordered("<", z, old))
        builder.store(builder.select(nearer, z, old), place, align=8)
        return context.get_dummy_value()

    return types.void(types.int64, *[types.float64] * 6), generate


hold_nearer: Any = intrinsic(_code)
