"""Height from slope: least squares over the image, zero where the gel is known to rest."""

import numpy as np
from scipy.fft import dctn, idctn

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.compiled import compiled

_SWEEPS = 300
_SETTLED = 1e-3
"""Pixels: a sweep that changes no height by more ends the iteration; 0.1 um at 0.1245 mm a pixel."""

_LOOKS = 4
"""Sweeps from one look at how far the heights moved to the next."""


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

    Successive over-relaxation in two colours; the image's border is natural. Each colour lies packed in a
    plane of its own, so that a row is read and written without gaps.

    Args:
        heights: ``(rows, columns)`` pixels, a first guess.
        down: slope along the rows' index.
        right: slope along the columns' index.
        weight: ``(rows, columns)`` trust in each pixel's slope, greater than zero.
        rest: where the height is known to be zero.

    Returns:
        How many sweeps were made.
    """
    rows, columns = heights.shape
    over = 2.0 / (1.0 + np.pi / (0.5 * (rows + columns)))
    planes = _planes(heights, rest)
    pulls = _pulls(_system(down, right, weight, rest), rest, over)
    made = 0
    for sweep in range(_SWEEPS):
        look = sweep % _LOOKS == _LOOKS - 1
        moved = 0.0
        for colour in range(2):
            moved = max(moved, _sweep(planes[colour], planes[1 - colour], pulls[colour], colour, over, look))
        made = sweep + 1
        if look and moved < _SETTLED:
            break
    for i in range(rows):
        for j in range(columns):
            heights[i, j] = planes[(i + j) % 2, i + 1, j // 2 + 1]
    return made


@compiled
def _planes(heights: FloatArray, rest: BoolArray) -> FloatArray:
    # (2, rows + 2, half the columns + 2): pixels of even and of odd row + column, zero where the gel rests
    # and all around.
    rows, columns = heights.shape
    planes = np.zeros((2, rows + 2, (columns + 1) // 2 + 2))
    for i in range(rows):
        for j in range(columns):
            if not rest[i, j]:
                planes[(i + j) % 2, i + 1, j // 2 + 1] = heights[i, j]
    return planes


@compiled
def _pulls(system: tuple[FloatArray, FloatArray, FloatArray], rest: BoolArray, over: float) -> FloatArray:
    # (2, rows, 5, half the columns): what a pixel's new height takes from the slopes and from the pixels
    # above, below, left and right; nothing where the gel rests.
    edges, source, gain = system
    rows, columns = rest.shape
    pulls = np.zeros((2, rows, 5, (columns + 1) // 2))
    for i in range(rows):
        for j in range(columns):
            if rest[i, j]:
                continue
            colour, k, by = (i + j) % 2, j // 2, over * gain[i, j]
            pulls[colour, i, 0, k] = by * source[i, j]
            if i > 0:
                pulls[colour, i, 1, k] = by * edges[i - 1, j, 0]
            if i < rows - 1:
                pulls[colour, i, 2, k] = by * edges[i, j, 0]
            if j > 0:
                pulls[colour, i, 3, k] = by * edges[i, j - 1, 1]
            if j < columns - 1:
                pulls[colour, i, 4, k] = by * edges[i, j, 1]
    return pulls


@compiled
def _sweep(
    own: FloatArray, other: FloatArray, pull: FloatArray, colour: int, over: float, look: bool
) -> float:
    # One colour from the other. How far its heights moved at most, where one looks: a greatest value of many
    # is what a processor cannot take several at a time of.
    rows, wide = len(pull), pull.shape[2]
    keep, moved, new = 1.0 - over, 0.0, np.empty(wide)
    for i in range(rows):
        left = (i + colour) % 2
        for k in range(wide):
            new[k] = (
                keep * own[i + 1, k + 1]
                + pull[i, 0, k]
                + pull[i, 1, k] * other[i, k + 1]
                + pull[i, 2, k] * other[i + 2, k + 1]
                + pull[i, 3, k] * other[i + 1, k + left]
                + pull[i, 4, k] * other[i + 1, k + left + 1]
            )
        if look:
            for k in range(wide):
                moved = max(moved, abs(new[k] - own[i + 1, k + 1]))
        for k in range(wide):
            own[i + 1, k + 1] = new[k]
    return moved


@compiled
def _system(
    down: FloatArray, right: FloatArray, weight: FloatArray, rest: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Weights of the edges down and right of each pixel, the slopes' pull, one over the sum of weights.
    rows, columns = rest.shape
    edges, source, total = np.zeros((rows, columns, 2)), np.zeros((rows, columns)), np.zeros((rows, columns))
    for i in range(rows):
        for j in range(columns):
            for way in range(2):
                k, m = (i + 1, j) if way == 0 else (i, j + 1)
                if k == rows or m == columns:
                    continue
                slope = down if way == 0 else right
                w = min(weight[i, j], weight[k, m])
                step = 0.5 * w * (slope[i, j] + slope[k, m])
                edges[i, j, way] = w
                source[i, j] -= step
                source[k, m] += step
                total[i, j] += w
                total[k, m] += w
    for i in range(rows):
        for j in range(columns):
            total[i, j] = 0.0 if rest[i, j] else 1.0 / total[i, j]
    return edges, source, total
