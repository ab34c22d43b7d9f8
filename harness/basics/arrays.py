"""Array types, the promise that a result is not written to by its readers, means over blocks, row keys."""

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]
AnyArray = npt.NDArray[Any]

_A = TypeVar("_A", bound=AnyArray)


def read_only(array: _A) -> _A:
    """The same array, refusing to be written to."""
    array.setflags(write=False)
    return array


def row_keys(rows: IntArray) -> IntArray:
    """Encode rows of integers as one integer each: equal for equal rows, and in the order of the rows.

    ``np.unique`` of the keys is many times faster than ``np.unique`` of the rows along an axis.

    Args:
        rows: ``(n, columns)``.
    """
    lowest = int(rows.min(initial=0))
    size = int(rows.max(initial=0)) - lowest + 1
    if size ** rows.shape[1] > np.iinfo(np.int64).max:
        return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1), np.int64)
    keys = np.zeros(len(rows), np.int64)
    for column in rows.T:
        keys *= size
        keys += column.astype(np.int64) - lowest
    return keys


def block_means(picture: AnyArray, by: int) -> FloatArray:
    """Means over squares of ``by`` pixels a side; rows and columns that fill no square are left out.

    Args:
        picture: ``(rows, columns, ...)``.
        by: pixels, one or more.
    """
    rows, columns = picture.shape[0] // by, picture.shape[1] // by
    rest = picture.shape[2:]
    # One axis after the other is faster than both at once; bytes in whole numbers, which is as exact.
    exact = np.uint32 if picture.dtype == np.uint8 else np.float64
    across = columns * by * int(np.prod(rest))
    strips = picture[: rows * by, : columns * by].reshape(rows, by, across).sum(axis=1, dtype=exact)
    return np.asarray(strips.reshape(rows, columns, by, *rest).sum(axis=2, dtype=exact) / by**2)
