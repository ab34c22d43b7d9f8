"""The loops of the optics: slope to colour for every pixel of one image."""

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.compiled import compiled

GRID = 2.0**20
"""Steps to a pixel of height. Far below any sensor's noise, and far above rounding: a table goes by the
direction of a slope however small, so rounding alone would choose the colour of a flat face, or the side of
a bin's border that a face along an axis is drawn on. Sums and differences on the grid are exact; published
maps, in single precision, lie on it and are drawn as they were."""


@compiled
def to_pixels(rest: FloatArray, pressed: FloatArray, per_pitch: float, out: FloatArray) -> None:
    """Write the surface of the pressed gel in pixels, held to the grid."""
    for i in range(rest.shape[0]):
        for j in range(rest.shape[1]):
            # Held once, as a whole: of two parts each would bring rounding of its own.
            out[i, j] = np.rint((rest[i, j] + pressed[i, j]) * per_pitch * GRID) / GRID


@compiled
def _slopes(z: FloatArray, i: int, j: int) -> tuple[float, float]:
    # Central differences down and right; the border repeats its inner neighbour (Taxim).
    rows, columns = z.shape
    i = min(max(i, 1), rows - 2)
    j = min(max(j, 1), columns - 2)
    return (z[i + 1, j] - z[i - 1, j]) / 2.0, (z[i, j + 1] - z[i, j - 1]) / 2.0


@compiled
def _exact_pixel(z: FloatArray, i: int, j: int, table: FloatArray, out: FloatArray) -> float:
    a, b = _slopes(z, i, j)
    steep: float = np.hypot(a, b)
    bins = table.shape[0]
    magnitude = np.arctan(steep)
    # Adding zero turns -0.0 to 0.0, or the sign of nothing would choose the side of the seam.
    direction = np.arctan2(a + 0.0, b + 0.0) if steep > 0.0 else 0.0
    row = int(np.floor(magnitude / (0.5 * np.pi / (bins - 1))))
    column = int(np.floor((direction + np.pi) / (2.0 * np.pi / (bins - 1))))
    x, y = float(j), float(i)
    for c in range(3):
        p = table[row, column]
        value = x * x * p[0, c] + y * y * p[1, c] + x * y * p[2, c]
        out[c] = value + x * p[3, c] + y * p[4, c] + p[5, c]
    return steep


@compiled
def change_exactly(z: FloatArray, table: FloatArray, change: FloatArray) -> None:
    """Write the table's grey levels ``(rows, columns, 3)`` for a surface ``z`` in pixels."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            _exact_pixel(z, i, j, table, change[i, j])


@compiled
def draw_exactly(
    z: FloatArray, table: FloatArray, base: FloatArray, steepest: float, image: ByteArray
) -> tuple[int, int]:
    """Add the table's grey levels to ``base``, round and clip to ``image``; count clipped and too steep."""
    clipped, beyond = 0, 0
    out = np.empty(3)
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            if _exact_pixel(z, i, j, table, out) > steepest:
                beyond += 1
            clipped += _to_bytes(base[i, j], out, image[i, j])
    return clipped, beyond


@compiled
def _to_bytes(base: FloatArray, change: FloatArray, pixel: ByteArray) -> int:
    clipped = 0
    for c in range(3):
        value = np.rint(base[c] + change[c])
        if value < 0.0 or value > 255.0:
            clipped += 1
            value = min(max(value, 0.0), 255.0)
        pixel[c] = np.uint8(value)
    return clipped
