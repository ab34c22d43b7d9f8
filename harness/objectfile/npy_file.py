"""Arrays in files of numpy (``.npy``, version 1.0): no Python objects are written, none run by reading."""

import io
import math

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused

_LONGEST_HEADER = 1000


def npy_bytes(array: AnyArray, dtype: str) -> bytes:
    """The array as a file.

    Args:
        array: of any shape.
        dtype: its numbers are written as, with the order of its bytes: ``"<f8"``.
    """
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ascontiguousarray(array, dtype), (1, 0), allow_pickle=False)
    return stream.getvalue()


def npy_array(data: bytes, name: str, dtype: str, shape: tuple[int | None, ...], wanted: str) -> AnyArray:
    """The array of a file's bytes; nothing is unpickled, and no more memory taken than the file has.

    Args:
        data: of the file.
        name: of the file.
        dtype: of its numbers.
        shape: that it has; None for any size from 1 up.
        wanted: what belongs there, for a refusal: ``"nodes of float64 (n, 6)"``.

    Raises:
        DataRefused: it is no such file, holds something else, or is cut short or too long.
    """
    stream = io.BytesIO(data)
    try:
        np.lib.format.read_magic(stream)
        found, fortran, kind = np.lib.format.read_array_header_1_0(stream, max_header_size=_LONGEST_HEADER)
    except ValueError as error:
        raise DataRefused(f"{name} is no .npy file of numbers; build the object again") from error
    fits = len(found) == len(shape) and all(
        size >= 1 if fixed is None else size == fixed for size, fixed in zip(found, shape, strict=True)
    )
    if fortran or kind != np.dtype(dtype) or not fits:
        raise DataRefused(f"{name} holds {kind} {found}, not {wanted}; build the object again")
    start, count = stream.tell(), math.prod(found)
    expected = start + kind.itemsize * count
    if len(data) != expected:
        raise DataRefused(
            f"{name} has {len(data)} bytes, not the {expected} of {wanted}, {found}; copy it again"
        )
    return np.frombuffer(data, dtype, count, start).reshape(found)
