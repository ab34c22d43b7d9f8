"""How far one picture is from another."""

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.basics.errors import OutOfDomain

PEAK = 255.0
"""Grey levels from black to white."""

_WINDOW = 1.5
"""Pixels, sigma of the window, cut off at five: 11 pixels wide."""

_STABLE = ((0.01 * PEAK) ** 2, (0.03 * PEAK) ** 2)


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


def ssim(a: AnyArray, b: AnyArray, where: BoolArray | None = None) -> float:
    """Structural similarity, mean over pixels and channels; 1 where the pictures are the same.

    Wang, Bovik, Sheikh and Simoncelli (2004), equation 13, with their Gaussian window and constants.

    Args:
        a: ``(rows, columns, 3)`` grey levels of 0 to 255.
        b: the same shape.
        where: ``(rows, columns)`` the pixels whose windows count; all if None.

    Raises:
        OutOfDomain: shapes that disagree, or no pixel that counts.
    """
    if a.shape != b.shape or a.ndim != 3 or (where is not None and where.shape != a.shape[:-1]):
        raise OutOfDomain(f"pictures of {a.shape} and {b.shape} pixels cannot be compared")
    x, y = a.astype(np.float64), b.astype(np.float64)
    mean_x, mean_y = _blurred(x), _blurred(y)
    var_x, var_y = _blurred(x * x) - mean_x**2, _blurred(y * y) - mean_y**2
    both = _blurred(x * y) - mean_x * mean_y
    alike = (2.0 * mean_x * mean_y + _STABLE[0]) * (2.0 * both + _STABLE[1])
    of = (mean_x**2 + mean_y**2 + _STABLE[0]) * (var_x + var_y + _STABLE[1])
    counted = alike / of if where is None else (alike / of)[where]
    if counted.size == 0:
        raise OutOfDomain("no pixel was chosen to compare two pictures by; choose one or more")
    return float(counted.mean())


def _blurred(picture: FloatArray) -> FloatArray:
    return np.asarray(gaussian_filter(picture, (_WINDOW, _WINDOW, 0.0), truncate=5.0 / _WINDOW))
