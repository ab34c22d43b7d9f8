"""Two routines of the BLAS that scipy carries, to be called from compiled loops.

numba's own products want whole arrays; a sparse factor works in place on parts of large ones.
Matrices are parts of flat arrays, read column by column: the array, where it begins, and how far
its columns are apart. The routines are those of Dongarra, Du Croz, Hammarling and Duff, A Set of
Level 3 Basic Linear Algebra Subprograms, ACM TOMS 16(1), 1990.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_NO, _YES, _RIGHT, _LOWER, _UNIT = (ord(letter) for letter in "NTRLU")

_stored: Any = cgutils.alloca_once_value
_parts: Any = cgutils.unpack_tuple


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
