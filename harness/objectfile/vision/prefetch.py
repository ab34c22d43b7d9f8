"""What memory is told to bring before it is asked for: faces of neighbouring pixels lie anywhere in a mesh.

A processor guesses rows that follow each other. Which face a ray a few rays on meets, and where the corners
of a face a few faces on lie, it cannot guess; here both are known beforehand.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled

AHEAD = 8
"""Rays or faces: 4 and 16 are no better."""

_LINE = 64
"""Bytes that are brought together."""

_BYTE = ir.IntType(8).as_pointer()
_NUMBER = ir.IntType(32)


def _bring(_typing: Any, _address: Any) -> Any:
    """Code that lets memory bring the line of an address into all caches; any address, it is never read."""

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [_BYTE, _NUMBER, _NUMBER, _NUMBER])
        prefetch = builder.module.declare_intrinsic("llvm.prefetch", (_BYTE,), kind)
        to_read, keep, data = (ir.Constant(_NUMBER, each) for each in (0, 3, 1))
        builder.call(prefetch, [builder.inttoptr(arguments[0], _BYTE), to_read, keep, data])
        return context.get_dummy_value()

    return types.void(types.int64), generate


_brought: Any = intrinsic(_bring)


@compiled
def bring_row(array: FloatArray, row: int) -> None:
    """Let memory bring one row of an array, while other things are computed; nothing else changes.

    Args:
        array: contiguous, of two axes or more.
        row: of the first axis.
    """
    begin, length = array.ctypes.data + row * array.strides[0], array.strides[0]
    for at in range(0, length, _LINE):
        _brought(begin + at)
    _brought(begin + length - 1)
