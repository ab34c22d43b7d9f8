"""One tile of a layer in registers: some outputs of some samples, a lane each, summed over all inputs.

numpy and BLAS see a product of 32 rows with a small matrix, and spend more on packing it than on multiplying.
Here a weight is read once from memory as it stands, spread over a register, and multiplied into the sums of
its output. LLVM is told so directly: left to itself it keeps the sums in memory.
"""

from collections.abc import Callable
from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_BYTES = 4
_NUMBER = ir.FloatType()
_LONG = ir.IntType(64)
_MAY_FUSE = ("contract",)

loop_over: Any = cgutils.for_range
_variable: Any = cgutils.alloca_once

WIDE: bool = bool(llvmlite.binding.get_host_cpu_features().get("avx512f", False))
"""Whether this processor has 32 registers of 16 numbers; else it is taken to have 16 of 8."""

LANES = 16 if WIDE else 8
VECTORS = 2
"""Registers of samples in a tile."""

OUTPUTS = 8 if WIDE else 4
"""In a tile: as many sums as leave registers for what is multiplied."""

SAMPLES = LANES * VECTORS
"""In a tile."""


def address(builder: Any, place: Any, offset: Any, kind: Any) -> Any:
    """Address ``offset`` numbers after ``place``."""
    return builder.inttoptr(
        builder.add(place, builder.mul(offset, ir.Constant(_LONG, _BYTES))), kind.as_pointer()
    )


def _spread(builder: Any, number: Any, lanes: int) -> Any:
    """One number in every lane."""
    first = ir.Constant(ir.IntType(32), 0)
    alone = builder.insert_element(ir.Constant(ir.VectorType(_NUMBER, lanes), ir.Undefined), number, first)
    return builder.shuffle_vector(
        alone, alone, ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
    )


def layer_tile(outputs: int, lanes: int, vectors: int, relu: bool) -> Callable[..., Any]:
    """Code of one tile: ``out = bias + weight.T @ given``, negative sums to zero where ``relu``.

    Called with the addresses of ``given`` ``(inputs, lanes * vectors)``, ``weight`` ``(inputs, outputs)``,
    ``bias`` ``(outputs,)`` and ``out`` ``(outputs, lanes * vectors)``, all float32, and ``inputs``.
    """
    vector = ir.VectorType(_NUMBER, lanes)
    across = lanes * vectors

    def code(_typing: Any, _given: Any, _weight: Any, _bias: Any, _out: Any, _inputs: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            given, weight, bias, out, inputs = arguments
            sums = [[_variable(builder, vector) for _ in range(vectors)] for _ in range(outputs)]
            for o, row in enumerate(sums):
                start = builder.load(address(builder, bias, ir.Constant(_LONG, o), _NUMBER), align=_BYTES)
                for sum_ in row:
                    builder.store(_spread(builder, start, lanes), sum_)
            with loop_over(builder, inputs) as loop:
                first = builder.mul(loop.index, ir.Constant(_LONG, across))
                seen = [
                    builder.load(
                        address(builder, given, builder.add(first, ir.Constant(_LONG, v * lanes)), vector),
                        align=_BYTES,
                    )
                    for v in range(vectors)
                ]
                begin = builder.mul(loop.index, ir.Constant(_LONG, outputs))
                for o, row in enumerate(sums):
                    place = address(builder, weight, builder.add(begin, ir.Constant(_LONG, o)), _NUMBER)
                    factor = _spread(builder, builder.load(place, align=_BYTES), lanes)
                    for value, sum_ in zip(seen, row, strict=True):
                        product = builder.fmul(factor, value, flags=_MAY_FUSE)
                        builder.store(builder.fadd(product, builder.load(sum_), flags=_MAY_FUSE), sum_)
            zero = ir.Constant(vector, [0.0] * lanes)
            for o, row in enumerate(sums):
                for v, sum_ in enumerate(row):
                    value = builder.load(sum_)
                    if relu:
                        value = builder.select(builder.fcmp_ordered(">", value, zero), value, zero)
                    to = address(builder, out, ir.Constant(_LONG, o * across + v * lanes), vector)
                    builder.store(value, to, align=_BYTES)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 5), generate

    return code


relu_tile: Any = intrinsic(layer_tile(OUTPUTS, LANES, VECTORS, relu=True))
relu_narrow: Any = intrinsic(layer_tile(OUTPUTS, LANES, 1, relu=True))
sum_4: Any = intrinsic(layer_tile(4, LANES, VECTORS, relu=False))
sum_4_narrow: Any = intrinsic(layer_tile(4, LANES, 1, relu=False))
sum_1: Any = intrinsic(layer_tile(1, LANES, VECTORS, relu=False))
sum_1_narrow: Any = intrinsic(layer_tile(1, LANES, 1, relu=False))
