"""How far one picture is from another."""

import numpy as np

from harness.arrays import AnyArray, BoolArray
from harness.errors import OutOfDomain

PEAK = 255.0
"""Grey levels from black to white."""


def psnr(a: AnyArray, b: AnyArray, where: BoolArray | None = None) -> float:
    """Peak signal-to-noise ratio in dB over all channels; +inf where the pictures are the same.

    Args:
        a: ``(rows, columns, 3)`` grey levels of 0 to 255.
        b: the same shape.
        where: ``(rows, columns)`` the pixels that count; all if None.

    Raises:
        OutOfDomain: shapes that disagree, or no pixel that counts.
    """
    error = mean_square(a, b, where)
    return float("inf") if error == 0.0 else float(10.0 * np.log10(PEAK**2 / error))


def mean_square(a: AnyArray, b: AnyArray, where: BoolArray | None = None) -> float:
    """Mean squared difference in squared grey levels; arguments and errors as in ``psnr``."""
    if a.shape != b.shape or (where is not None and where.shape != a.shape[:-1]):
        raise OutOfDomain(f"pictures of {a.shape} and {b.shape} pixels cannot be compared")
    apart = (a.astype(np.float64) - b.astype(np.float64)) ** 2
    counted = apart if where is None else apart[where]
    if counted.size == 0:
        raise OutOfDomain("no pixel was chosen to compare two pictures by; choose one or more")
    return float(counted.mean())
