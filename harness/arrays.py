"""Array types, and the promise that a result is not written to by its readers."""

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
