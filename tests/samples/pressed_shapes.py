"""What is pressed into a gel, as height maps from formulas."""

import numpy as np

from harness.basics.arrays import FloatArray

Pair = tuple[float, float]


def places(pitch: float, rows: int, columns: int, at: Pair = (0.0, 0.0)) -> tuple[FloatArray, FloatArray]:
    """Metres x and y of every pixel from ``at`` (metres)."""
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    return (x + 0.5 - columns / 2) * pitch - at[0], (y + 0.5 - rows / 2) * pitch - at[1]


def paraboloid(radius: float, depth: float, pitch: float, size: int, at: Pair = (0.0, 0.0)) -> FloatArray:
    """``(size, size)`` metres of a paraboloid with that radius at its apex."""
    x, y = places(pitch, size, size, at)
    return np.asarray(np.maximum(0.0, depth - (x * x + y * y) / (2.0 * radius)))


def punch(radius: float, depth: float, pitch: float, size: int, at: Pair = (0.0, 0.0)) -> FloatArray:
    """``(size, size)`` metres of a flat round face."""
    x, y = places(pitch, size, size, at)
    return np.where(np.hypot(x, y) < radius, depth, 0.0)
