"""Numpy's constructors as pickles name them, replaced by ours, which make arrays of plain numbers alone.

A pickle builds a numpy array by calls and by states that it hands over. Numpy's own would take any dtype,
objects and padded structures among them, and any state. These take what a published ObjectFile has:
little-endian numbers and booleans, as many bytes as their shape has.
"""

import math
import pickle
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray

_CODES = frozenset({"b1", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8"})

MOST_NUMBERS = 2**28
"""Of one array; the largest published one has 17 million."""


class PickledDtype:
    """A dtype of plain numbers (``numpy.dtype(code, align, copy)``)."""

    def __init__(self, code: Any, *_: Any) -> None:
        if code not in _CODES:
            raise pickle.UnpicklingError(f"numbers of the kind {code!r}")
        self.dtype = np.dtype("<" + code)

    def __setstate__(self, state: Any) -> None:
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        if order not in ("<", "|", "="):
            raise pickle.UnpicklingError(f"numbers of the byte order {order!r}")


class PickledArray:
    """An array of plain numbers, made empty (``numpy.core.multiarray._reconstruct``) and filled by its state.

    Attributes:
        array: None before.
    """

    def __init__(self, *_: Any) -> None:
        self.array: AnyArray | None = None

    def __setstate__(self, state: Any) -> None:
        if not (isinstance(state, tuple) and len(state) == 5 and isinstance(state[2], PickledDtype)):
            raise pickle.UnpicklingError("an array whose state is none")
        _, shape, kind, fortran, data = state
        self.array = _filled(shape, kind, data, "F" if fortran else "C")


def scalar(kind: Any, data: Any) -> Any:
    """``numpy.core.multiarray.scalar``: one number, as Python's."""
    if not isinstance(kind, PickledDtype):
        raise pickle.UnpicklingError("a scalar without a kind")
    return _filled((), kind, data, "C").item()


class ArrayName:
    """``numpy.ndarray``, as ``PickledArray`` is given it: a name, not to be called."""

    def __new__(cls, *_: Any) -> "ArrayName":
        """Refuse."""
        raise pickle.UnpicklingError("an array made by its class")


ALLOWED: tuple[tuple[Any, str], ...] = (
    (PickledArray, "numpy.core.multiarray._reconstruct"),
    (PickledArray, "numpy._core.multiarray._reconstruct"),
    (scalar, "numpy.core.multiarray.scalar"),
    (scalar, "numpy._core.multiarray.scalar"),
    (PickledDtype, "numpy.dtype"),
    (ArrayName, "numpy.ndarray"),
)
"""What a published file may name beside torch's own tensors, and what is called instead."""


def _filled(shape: Any, kind: PickledDtype, data: Any, order: Any) -> AnyArray:
    sizes = isinstance(shape, tuple) and all(
        type(size) is int and 0 <= size <= MOST_NUMBERS for size in shape
    )
    if not sizes or not isinstance(data, bytes) or math.prod(shape) > MOST_NUMBERS:
        raise pickle.UnpicklingError(f"an array of the shape {shape!r}")
    if len(data) != math.prod(shape) * kind.dtype.itemsize:
        raise pickle.UnpicklingError(f"{len(data)} bytes for an array {shape!r} of {kind.dtype}")
    return np.frombuffer(data, kind.dtype).reshape(shape, order=order)
