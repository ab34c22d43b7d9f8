"""Height from slope: least squares over the image, zero where the gel is known to rest."""

import numpy as np
from scipy.fft import dctn, idctn

from harness.arrays import BoolArray, FloatArray
from harness.sim.compiled import compiled

_SWEEPS = 300
_SETTLED = 2e-4
"""Pixels: a sweep that changes no height by more ends the iteration; 0.03 um at 0.1245 mm a pixel."""


def free_heights(down: FloatArray, right: FloatArray) -> FloatArray:
    """Heights of zero mean whose differences fit the slopes best, no boundary known.

    Poisson's equation with natural boundaries, diagonal under the cosine transform
    (Simchony, Chellappa and Shao, Direct analytical methods for solving Poisson equations in
    computer vision problems, 1990).

    Args:
        down: ``(rows, columns)`` slope along the rows' index, height in pixels per pixel.
        right: the same along the columns' index.

    Returns:
        ``(rows, columns)`` pixels.
    """
    rows, columns = down.shape
    source = np.zeros((rows, columns))
    step = 0.5 * (down[1:] + down[:-1])
    source[:-1] += step
    source[1:] -= step
    step = 0.5 * (right[:, 1:] + right[:, :-1])
    source[:, :-1] += step
    source[:, 1:] -= step
    waves = dctn(source, type=2, norm="ortho")
    row = 2.0 * np.cos(np.pi * np.arange(rows) / rows) - 2.0
    column = 2.0 * np.cos(np.pi * np.arange(columns) / columns) - 2.0
    stiffness = row[:, None] + column[None, :]
    stiffness[0, 0] = 1.0
    waves /= stiffness
    waves[0, 0] = 0.0
    heights: FloatArray = idctn(waves, type=2, norm="ortho")
    return heights


@compiled
def anchored_heights(
    heights: FloatArray, down: FloatArray, right: FloatArray, weight: FloatArray, rest: BoolArray
) -> int:
    """Refine ``heights`` in place: zero where ``rest``, elsewhere fitting the slopes best.

    Successive over-relaxation in two colours; the image's border is natural.

    Args:
        heights: ``(rows, columns)`` pixels, a first guess.
        down: slope along the rows' index.
        right: slope along the columns' index.
        weight: ``(rows, columns)`` trust in each pixel's slope, greater than zero.
        rest: where the height is known to be zero.

    Returns:
        How many sweeps were needed.
    """
    rows, columns = heights.shape
    for i in range(rows):
        for j in range(columns):
            if rest[i, j]:
                heights[i, j] = 0.0
    over = 2.0 / (1.0 + np.pi / (0.5 * (rows + columns)))
    for sweep in range(_SWEEPS):
        moved = 0.0
        for colour in range(2):
            for i in range(rows):
                for j in range((i + colour) % 2, columns, 2):
                    if rest[i, j]:
                        continue
                    total, norm = 0.0, 0.0
                    if i > 0:
                        w = min(weight[i, j], weight[i - 1, j])
                        total += w * (heights[i - 1, j] + 0.5 * (down[i - 1, j] + down[i, j]))
                        norm += w
                    if i < rows - 1:
                        w = min(weight[i, j], weight[i + 1, j])
                        total += w * (heights[i + 1, j] - 0.5 * (down[i + 1, j] + down[i, j]))
                        norm += w
                    if j > 0:
                        w = min(weight[i, j], weight[i, j - 1])
                        total += w * (heights[i, j - 1] + 0.5 * (right[i, j - 1] + right[i, j]))
                        norm += w
                    if j < columns - 1:
                        w = min(weight[i, j], weight[i, j + 1])
                        total += w * (heights[i, j + 1] - 0.5 * (right[i, j + 1] + right[i, j]))
                        norm += w
                    change = over * (total / norm - heights[i, j])
                    heights[i, j] += change
                    moved = max(moved, abs(change))
        if moved < _SETTLED:
            return sweep + 1
    return _SWEEPS
