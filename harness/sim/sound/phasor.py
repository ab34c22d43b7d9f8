"""Powers of sixteen complex steps at a time, held in registers from row to row.

Loops of numba write each power to memory and read it again, which took nine times as long. Registers
narrower than sixteen numbers are used in pairs or more: LLVM splits what the machine does not have.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

SIXTEEN = 16
_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, SIXTEEN)
_BYTES = 8
_MAY_FUSE = ("contract",)

_loop: Any = cgutils.for_range
_variable: Any = cgutils.alloca_once


def _loaded(builder: Any, place: Any) -> Any:
    """Sixteen numbers at an address."""
    return builder.load(builder.inttoptr(place, _VECTOR.as_pointer()), align=_BYTES)


def _product(builder: Any, left: Any, right: Any) -> Any:
    return builder.fmul(left, right, flags=_MAY_FUSE)


def _turned(builder: Any, power: tuple[Any, Any], step: tuple[Any, Any]) -> tuple[Any, Any]:
    """Real and imaginary part of the product of two complex numbers."""
    lost = _product(builder, power[1], step[1])
    gained = _product(builder, power[1], step[0])
    real = builder.fsub(_product(builder, power[0], step[0]), lost, flags=_MAY_FUSE)
    return real, builder.fadd(_product(builder, power[0], step[1]), gained, flags=_MAY_FUSE)


def _audible(builder: Any, numbers: Any, least: Any) -> Any:
    """Zero instead of what has a square not above ``least``."""
    loud = builder.fcmp_ordered(">", builder.fmul(numbers, numbers), least)
    return builder.select(loud, numbers, ir.Constant(_VECTOR, [0.0] * SIXTEEN))


def _spread(builder: Any, number: Any) -> Any:
    """One number, sixteen times."""
    first = ir.Constant(ir.IntType(32), 0)
    alone = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, first)
    lanes = ir.Constant(ir.VectorType(ir.IntType(32), SIXTEEN), [0] * SIXTEEN)
    return builder.shuffle_vector(alone, alone, lanes)


def _turning(element: Any) -> Callable[..., Any]:
    """Code that writes rows of powers as numbers of one type.

    Called with the addresses of the first row's real and imaginary parts, the bytes from one row to
    the next, the number of rows, the addresses of the real and imaginary parts of the first power
    and of the step, and the square below which a part is written as zero.
    """
    row = ir.VectorType(element, SIXTEEN)
    narrow = element != _NUMBER

    def code(
        _typing: Any, _real: Any, _imag: Any, _apart: Any, _rows: Any, _first_re: Any, _first_im: Any,
        _step_re: Any, _step_im: Any, _least: Any,
    ) -> Any:  # fmt: skip
        def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            *outs, apart, rows, first_re, first_im, step_re, step_im, square = given
            step = (_loaded(builder, step_re), _loaded(builder, step_im))
            least = _spread(builder, square)
            power = [_variable(builder, _VECTOR) for _ in outs]
            for part, place in zip(power, (first_re, first_im), strict=True):
                builder.store(_loaded(builder, place), part)
            with _loop(builder, rows) as loop:
                on = builder.mul(apart, loop.index)
                now = (builder.load(power[0]), builder.load(power[1]))
                for part, out in zip(now, outs, strict=True):
                    kept = _audible(builder, part, least)
                    written = builder.fptrunc(kept, row) if narrow else kept
                    to = builder.inttoptr(builder.add(out, on), row.as_pointer())
                    builder.store(written, to, align=4 if narrow else _BYTES)
                for part, value in zip(power, _turned(builder, now, step), strict=True):
                    builder.store(value, part)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 8, types.float64), generate

    return code


turn_single: Any = intrinsic(_turning(ir.FloatType()))
turn_double: Any = intrinsic(_turning(_NUMBER))
