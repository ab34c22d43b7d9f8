"""The loops of the optics: slope to colour for every pixel of one image."""

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.compiled import compiled, compiled_fast
from harness.sim.optics.shading import at_pixel, at_row, colour, softly_limited
from harness.sim.optics.tactile_calibration import Float32Array

GRID = 2.0**20
"""Steps to a pixel of height. Far below any sensor's noise, and far above rounding: a table goes by the
direction of a slope however small, so rounding alone would choose the colour of a flat face, or the side of
a bin's border that a face along an axis is drawn on. Sums and differences on the grid are exact; published
maps, in single precision, lie on it and are drawn as they were."""

Int32Array = npt.NDArray[np.int32]

PADDED = 4
"""Channels to a row of the padded table: three and one unused, a whole vector register."""

_MARGIN = np.float32(2.0**-15)
"""Bins by which a slope may fall short of a bin's border and count as on it: more than single precision
loses of an angle. Directions along the axes and slopes of 45 degrees lie on borders of a table of 125 bins;
double precision finds them there, and whole faces would change their colour with the level."""

_HALF_PI = np.float32(0.5 * np.pi)
_PI = np.float32(np.pi)
_ONE = np.float32(1.0)
_HALF = np.float32(0.5)
_C0, _C1, _C2, _C3 = (
    np.float32(0.99999934),
    np.float32(-0.3332986),
    np.float32(0.19946566),
    np.float32(-0.13908629),
)
_C4, _C5, _C6, _C7 = (
    np.float32(0.09642197),
    np.float32(-0.05591233),
    np.float32(0.02186296),
    np.float32(-0.00405457),
)


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


def padded(table: Float32Array) -> Float32Array:
    """``(bins^2, 6, 4)`` the table with a fourth channel of zeros."""
    bins = len(table)
    wide = np.zeros((bins * bins, 6, PADDED), np.float32)
    wide[:, :, :3] = table.reshape(bins * bins, 6, 3)
    return wide


@compiled_fast
def arctangent(t: np.float32) -> np.float32:
    """Of 0 <= t <= 1, to 7e-8 rad: the minimax odd polynomial of degree 15."""
    s = t * t
    return t * (_C0 + s * (_C1 + s * (_C2 + s * (_C3 + s * (_C4 + s * (_C5 + s * (_C6 + s * _C7)))))))


@compiled_fast
def _bins_of_row(z: FloatArray, i: int, bins: int, steepest2: np.float32, at: Int32Array) -> int:
    columns = z.shape[1]
    per_row = np.float32((bins - 1) / (0.5 * np.pi))
    per_column = np.float32((bins - 1) / (2.0 * np.pi))
    last, wide = np.int32(bins - 1), np.int32(bins)
    above, here, below = z[i - 1], z[i], z[i + 1]
    beyond = 0
    for j in range(1, columns - 1):
        # Differences on the surface's grid are exact in double precision, and then in single.
        a = np.float32(below[j] - above[j]) * _HALF
        b = np.float32(here[j + 1] - here[j - 1]) * _HALF
        sizes_a, sizes_b = abs(a), abs(b)
        most, least = max(sizes_a, sizes_b), min(sizes_a, sizes_b)
        angle = arctangent(least / most if most > 0 else least)
        angle = _HALF_PI - angle if sizes_a > sizes_b else angle
        angle = _PI - angle if b < 0 else angle
        angle = -angle if a < 0 else angle
        steep2 = a * a + b * b
        steep = np.sqrt(steep2)
        tilt = arctangent(steep if steep < _ONE else _ONE / steep)
        tilt = tilt if steep < _ONE else _HALF_PI - tilt
        row = min(np.int32(tilt * per_row + _MARGIN), last)
        column = min(np.int32((angle + _PI) * per_column + _MARGIN), last)
        at[j] = row * wide + column
        beyond += int(steep2 > steepest2)
    at[0], at[columns - 1] = at[1], at[columns - 2]
    return beyond


@compiled_fast
def change_fast(z: FloatArray, bins: int, table: Float32Array, change: Float32Array) -> None:
    """Write the table's grey levels ``(rows, columns, 4)`` for a surface ``z`` in pixels."""
    rows, columns = z.shape
    at = np.empty(columns, np.int32)
    for i in range(rows):
        _bins_of_row(z, min(max(i, 1), rows - 2), bins, np.float32(np.inf), at)
        y = np.float32(i)
        for j in range(columns):
            x = np.float32(j)
            p = table[at[j]]
            for c in range(PADDED):
                change[i, j, c] = (
                    x * (x * p[0, c] + y * p[2, c] + p[3, c]) + y * (y * p[1, c] + p[4, c]) + p[5, c]
                )


@compiled_fast
def draw_fast(
    z: FloatArray, bins: int, table: Float32Array, base: Float32Array, steepest: float, image: ByteArray
) -> tuple[int, int]:
    """Add the table's grey levels to ``base``, round and clip to ``image``; count clipped and too steep.

    Args:
        z: ``(rows, columns)`` heights in pixels.
        bins: of the table.
        table: from ``padded``.
        base: ``(rows, columns, 4)``.
        steepest: tangent of the steepest slope supported.
        image: ``(rows, columns, 3)``, overwritten.
    """
    rows, columns = z.shape
    at = np.empty(columns, np.int32)
    line = np.empty((columns, PADDED), np.float32)
    steepest2 = np.float32(steepest * steepest)
    clipped, beyond = 0, 0
    for i in range(rows):
        beyond += _bins_of_row(z, min(max(i, 1), rows - 2), bins, steepest2, at)
        y = np.float32(i)
        under = base[i]
        for j in range(columns):
            x = np.float32(j)
            p = table[at[j]]
            for c in range(PADDED):
                value = x * (x * p[0, c] + y * p[2, c] + p[3, c]) + y * (y * p[1, c] + p[4, c]) + p[5, c]
                line[j, c] = np.rint(under[j, c] + value)
        out = image[i]
        for j in range(columns):
            for c in range(3):
                value = line[j, c]
                held = min(max(value, np.float32(0.0)), np.float32(255.0))
                clipped += held != value
                out[j, c] = np.uint8(held)
    return clipped, beyond
