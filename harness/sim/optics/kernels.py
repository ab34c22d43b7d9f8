"""The loops of the optics: slope to colour for every pixel of one image."""

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.compiled import compiled
from harness.sim.optics.shading import at_pixel, at_row, colour, softly_limited

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
def _normal(z: FloatArray, i: int, j: int, limit: float) -> tuple[float, float, float]:
    """Steepness of a pixel, and the image part of its normal, bent towards the limit."""
    a, b = _slopes(z, i, j)
    steep: float = np.hypot(a, b)
    if steep == 0.0:
        return steep, 0.0, 0.0
    sine = steep / np.sqrt(1.0 + steep * steep)
    scale = softly_limited(sine, limit) / steep
    return steep, -b * scale, -a * scale


@compiled
def _smooth_pixel(
    z: FloatArray,
    i: int,
    j: int,
    row: FloatArray,
    limit: float,
    here: FloatArray,
    out: FloatArray,
) -> float:
    steep, nx, ny = _normal(z, i, j, limit)
    if steep == 0.0:
        out[:] = 0.0
        return steep
    at_pixel(row, j, z.shape[1], here)
    colour(here, nx, ny, out)
    return steep


@compiled
def change_smoothly(z: FloatArray, smooth: FloatArray, limit: float, change: FloatArray) -> None:
    """Write the polynomial's grey levels ``(rows, columns, 3)`` for a surface ``z`` in pixels."""
    row, here = np.empty((3, 60)), np.empty(60)
    for i in range(z.shape[0]):
        at_row(smooth, i, z.shape[0], row)
        for j in range(z.shape[1]):
            _smooth_pixel(z, i, j, row, limit, here, change[i, j])


@compiled
def draw_smoothly(
    z: FloatArray,
    pressed: FloatArray,
    smooth: FloatArray,
    light: FloatArray,
    base: FloatArray,
    limit: float,
    image: ByteArray,
) -> tuple[int, int]:
    """As ``draw_exactly`` with the polynomial, and the light of ``harness.sim.optics.lit_calibration``.

    Args:
        z: ``(rows, columns)`` heights in pixels.
        pressed: ``(rows, columns)`` pixels, of indentation.
        smooth: ``(120, 3)`` coefficients of the slopes.
        light: ``(36, 3)`` of the light, grey levels a pixel of indentation; ``(0, 3)`` for none.
        base: ``(rows, columns, 3)``.
        limit: sine of the steepest slope supported.
        image: ``(rows, columns, 3)``, overwritten.
    """
    rows, columns = z.shape
    steepest = limit / np.sqrt(1.0 - limit * limit) if limit < 1.0 else np.inf
    clipped, beyond = 0, 0
    row, here, out = np.empty((3, 60)), np.empty(60), np.empty(3)
    light_row = np.empty((3, len(light) // 2))
    for i in range(rows):
        at_row(smooth, i, rows, row)
        _light_at_row(light, i, rows, light_row)
        for j in range(columns):
            if _smooth_pixel(z, i, j, row, limit, here, out) > steepest:
                beyond += 1
            if len(light) and pressed[i, j] != 0.0:
                _, nx, ny = _normal(z, i, j, limit)
                _add_light(light_row, 2.0 * (j + 0.5) / columns - 1.0, nx, ny, pressed[i, j], out)
            clipped += _to_bytes(base[i, j], out, image[i, j])
    return clipped, beyond


@compiled
def _light_at_row(light: FloatArray, i: int, rows: int, out: FloatArray) -> None:
    # As at_row: (3, 18), powers of the scaled column by power of the normal and channel.
    v = 2.0 * (i + 0.5) / rows - 1.0
    for k in range(len(light) // 6):
        at = k * 6
        for c in range(3):
            out[0, k * 3 + c] = light[at, c] + v * (light[at + 1, c] + v * light[at + 2, c])
            out[1, k * 3 + c] = light[at + 3, c] + v * light[at + 4, c]
            out[2, k * 3 + c] = light[at + 5, c]


@compiled
def _add_light(row: FloatArray, u: float, nx: float, ny: float, pressed: float, out: FloatArray) -> None:
    for c in range(3):
        one, y, yy, x, xy, xx = (
            row[0, c] + u * (row[1, c] + u * row[2, c]),
            row[0, 3 + c] + u * (row[1, 3 + c] + u * row[2, 3 + c]),
            row[0, 6 + c] + u * (row[1, 6 + c] + u * row[2, 6 + c]),
            row[0, 9 + c] + u * (row[1, 9 + c] + u * row[2, 9 + c]),
            row[0, 12 + c] + u * (row[1, 12 + c] + u * row[2, 12 + c]),
            row[0, 15 + c] + u * (row[1, 15 + c] + u * row[2, 15 + c]),
        )
        out[c] += pressed * (one + ny * (y + ny * yy) + nx * (x + ny * xy + nx * xx))


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
