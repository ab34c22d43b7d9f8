"""The loops of the gel: separable blurs that mirror at the border, the edge pixel not repeated."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled, compiled_fast, copy_line

_COARSE = 4


@compiled_fast
def blur(image: FloatArray, half: FloatArray) -> None:
    """Blur ``(rows, columns)`` in place by a symmetric kernel given from its centre out."""
    rows, columns = image.shape
    reach = len(half) - 1
    line = np.empty(columns + 2 * reach)
    for i in range(rows):
        copy_line(line[reach:], image[i])
        for k in range(1, reach + 1):
            line[reach - k] = image[i, _mirrored(-k, columns)]
            line[reach + columns - 1 + k] = image[i, _mirrored(columns - 1 + k, columns)]
        out = image[i]
        for j in range(columns):
            out[j] = half[0] * line[reach + j]
        for k in range(1, reach + 1):
            weight = half[k]
            left = line[reach - k : reach - k + columns]
            right = line[reach + k : reach + k + columns]
            for j in range(columns):
                out[j] += weight * (left[j] + right[j])
    source = image.copy()
    for i in range(rows):
        out = image[i]
        middle = source[i]
        for j in range(columns):
            out[j] = half[0] * middle[j]
        for k in range(1, reach + 1):
            weight = half[k]
            above = source[_mirrored(i - k, rows)]
            below = source[_mirrored(i + k, rows)]
            for j in range(columns):
                out[j] += weight * (above[j] + below[j])


@compiled
def blur_coarsely(image: FloatArray, half: FloatArray) -> None:
    """As ``blur``, on means of 4 x 4 pixels, interpolated back; for kernels much wider than that."""
    rows, columns = image.shape
    small = np.zeros(((rows + _COARSE - 1) // _COARSE, (columns + _COARSE - 1) // _COARSE))
    for i in range(small.shape[0]):
        for j in range(small.shape[1]):
            total, count = 0.0, 0
            for a in range(i * _COARSE, min((i + 1) * _COARSE, rows)):
                for b in range(j * _COARSE, min((j + 1) * _COARSE, columns)):
                    total += image[a, b]
                    count += 1
            small[i, j] = total / count
    blur(small, _thinned(half))
    for i in range(rows):
        y = (i + 0.5) / _COARSE - 0.5
        top = min(max(int(np.floor(y)), 0), max(small.shape[0] - 2, 0))
        below = min(top + 1, small.shape[0] - 1)
        t = min(max(y - top, 0.0), 1.0)
        for j in range(columns):
            x = (j + 0.5) / _COARSE - 0.5
            left = min(max(int(np.floor(x)), 0), max(small.shape[1] - 2, 0))
            right = min(left + 1, small.shape[1] - 1)
            s = min(max(x - left, 0.0), 1.0)
            upper = small[top, left] * (1 - s) + small[top, right] * s
            lower = small[below, left] * (1 - s) + small[below, right] * s
            image[i, j] = upper * (1 - t) + lower * t


@compiled
def _thinned(half: FloatArray) -> FloatArray:
    # The variance of the wide kernel less that of averaging and of interpolating, in coarse pixels.
    variance = 0.0
    for k in range(1, len(half)):
        variance += 2.0 * half[k] * k * k
    variance = variance / _COARSE**2 - (1.0 - 1.0 / _COARSE**2) / 12.0 - 1.0 / 6.0
    reach = max((len(half) - 1) // _COARSE, 1)
    thin = np.exp(-(np.arange(reach + 1) ** 2) / (2.0 * variance))
    normalised: FloatArray = thin / (2.0 * thin.sum() - thin[0])
    return normalised


@compiled
def put_back(surface: FloatArray, pressed: FloatArray, core: float) -> None:
    """Copy ``pressed`` onto ``surface`` where it is deeper than ``core``."""
    rows, columns = surface.shape
    for i in range(rows):
        for j in range(columns):
            if pressed[i, j] > core:
                surface[i, j] = pressed[i, j]


@compiled
def _mirrored(at: int, size: int) -> int:
    if size == 1:
        return 0
    at = abs(at) % (2 * (size - 1))
    return at if at < size else 2 * (size - 1) - at
