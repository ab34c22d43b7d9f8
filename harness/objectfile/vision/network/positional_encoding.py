"""Sines and cosines of many octaves, and logistic functions, a register of samples at a time."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from harness.objectfile.vision.network.tiles import LANES, VECTORS, address, loop_over

_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_LONG = ir.IntType(64)
_ALIGN = 4
_MAY_FUSE = ("contract",)

_variable: Any = cgutils.alloca_once

_SINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(6))
"""Of odd powers: within 2e-10 up to 1."""

_COSINE = tuple((-1.0) ** k / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(7))
"""Of even powers: within 2e-11 up to 1."""

# tanh as a quotient of polynomials of its square, within 4e-7, as Eigen computes it.
_MOST = 7.90531110763549805
_ABOVE = (
    *(4.89352455891786e-03, 6.37261928875436e-04, 1.48572235717979e-05, 5.12229709037114e-08),
    *(-8.60467152213735e-11, 2.00018790482477e-13, -2.76076847742355e-16),
)
_BELOW = (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06)


def _spread(number: float) -> Any:
    """A constant in every lane, as float32 has it."""
    return ir.Constant(_VECTOR, [float(np.float32(number))] * LANES)


def _fused(builder: Any, left: Any, right: Any, added: Any) -> Any:
    return builder.fadd(builder.fmul(left, right, flags=_MAY_FUSE), added, flags=_MAY_FUSE)


def _polynomial(builder: Any, at: Any, coefficients: tuple[float, ...]) -> Any:
    """``c0 + c1 at + c2 at^2 + ...``."""
    sum_ = _spread(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        sum_ = _fused(builder, sum_, at, _spread(coefficient))
    return sum_


def _waves(vectors: int) -> Any:
    """Code that fills rows 3 on of ``(3 + 6 octaves, samples)`` float32 at an address; |values| <= 1."""
    across = vectors * LANES

    def code(_typing: Any, _rows: Any, _octaves: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            rows, octaves = arguments
            waves = []
            for lane in range(3 * vectors):
                value = builder.load(
                    address(builder, rows, ir.Constant(_LONG, lane * LANES), _VECTOR), align=_ALIGN
                )
                square = builder.fmul(value, value)
                sine, cosine = _variable(builder, _VECTOR), _variable(builder, _VECTOR)
                builder.store(builder.fmul(value, _polynomial(builder, square, _SINE)), sine)
                builder.store(_polynomial(builder, square, _COSINE), cosine)
                waves.append((sine, cosine))
            with loop_over(builder, octaves) as loop:
                begin = builder.mul(loop.index, ir.Constant(_LONG, 6 * across))
                for lane, (sine, cosine) in enumerate(waves):
                    s, c = builder.load(sine), builder.load(cosine)
                    for value, row in ((s, 3), (c, 6)):
                        offset = builder.add(begin, ir.Constant(_LONG, row * across + lane * LANES))
                        builder.store(value, address(builder, rows, offset, _VECTOR), align=_ALIGN)
                    twice = builder.fadd(s, s)
                    builder.store(builder.fmul(twice, c), sine)
                    builder.store(_fused(builder, builder.fneg(twice), s, _spread(1.0)), cosine)
            return context.get_dummy_value()

        return types.void(types.int64, types.int64), generate

    return code


def _logistics(vectors: int) -> Any:
    """Code that puts ``1 / (1 + exp(-x))`` in place of each of so many registers at an address."""

    def code(_typing: Any, _rows: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            for lane in range(vectors):
                place = address(builder, arguments[0], ir.Constant(_LONG, lane * LANES), _VECTOR)
                value = builder.fmul(builder.load(place, align=_ALIGN), _spread(0.5))
                for sign, end in (("<", _MOST), (">", -_MOST)):
                    kept = builder.fcmp_ordered(sign, value, _spread(end))
                    value = builder.select(kept, value, _spread(end))
                square = builder.fmul(value, value)
                above = builder.fmul(value, _polynomial(builder, square, _ABOVE))
                ratio = builder.fdiv(above, _polynomial(builder, square, _BELOW))
                builder.store(_fused(builder, ratio, _spread(0.5), _spread(0.5)), place, align=_ALIGN)
            return context.get_dummy_value()

        return types.void(types.int64), generate

    return code


waves: Any = intrinsic(_waves(VECTORS))
waves_narrow: Any = intrinsic(_waves(1))
logistic_3: Any = intrinsic(_logistics(3 * VECTORS))
logistic_3_narrow: Any = intrinsic(_logistics(3))
