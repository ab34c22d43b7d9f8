"""The smooth model of a gel's colour: a polynomial in the surface normal and the position.

``dI = sum_ab sum_cd k_abcd nx^a ny^b u^c v^d`` with 1 <= a + b <= 5 and c + d <= 2: no constant
in the normal, so a flat gel changes no colour. (nx, ny) is the part in the image plane of
the unit normal towards the camera, (u, v) the position scaled to -1..1 on the image. Beyond
the slopes that presses supported the normal is bent smoothly towards the limit.
"""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.optics.tactile_calibration import NORMAL_DEGREE, POSITION_DEGREE

KNEE = 0.9
"""Share of the slope limit up to which a slope is taken as it is."""

NORMAL_TERMS = (NORMAL_DEGREE + 1) * (NORMAL_DEGREE + 2) // 2 - 1
POSITION_TERMS = (POSITION_DEGREE + 1) * (POSITION_DEGREE + 2) // 2

_STEPS = 8
_SETTLED = 1e-4
_STARTS = 8

_FAINT = 12.0
"""Grey levels below which a colour has one explanation, the one near flat."""


def design(normal: FloatArray, position: FloatArray) -> FloatArray:
    """``(n, 120)`` the terms at ``(n, 2)`` normals and ``(n, 2)`` scaled positions."""
    powers = [(a, b) for a in range(NORMAL_DEGREE + 1) for b in range(NORMAL_DEGREE + 1 - a) if a + b]
    places = [(c, d) for c in range(POSITION_DEGREE + 1) for d in range(POSITION_DEGREE + 1 - c)]
    x, y = (np.vander(normal[:, k], NORMAL_DEGREE + 1, increasing=True) for k in range(2))
    u, v = (np.vander(position[:, k], POSITION_DEGREE + 1, increasing=True) for k in range(2))
    slopes = np.stack([x[:, a] * y[:, b] for a, b in powers], axis=1)
    where = np.stack([u[:, c] * v[:, d] for c, d in places], axis=1)
    terms: FloatArray = (slopes[:, :, None] * where[:, None, :]).reshape(len(normal), -1)
    return terms


def scaled_position(x: FloatArray, y: FloatArray, rows: int, columns: int) -> FloatArray:
    """``(n, 2)`` in -1..1 of pixel coordinates: column ``x`` and row ``y``, from 0."""
    return np.stack([2.0 * (x + 0.5) / columns - 1.0, 2.0 * (y + 0.5) / rows - 1.0], axis=-1)


@compiled
def at_row(smooth: FloatArray, i: int, rows: int, out: FloatArray) -> None:
    """Contract the coefficients with row ``i``: ``out`` becomes ``(3, 60)``, powers of the scaled column."""
    v = 2.0 * (i + 0.5) / rows - 1.0
    for k in range(NORMAL_TERMS):
        at = k * POSITION_TERMS
        for c in range(3):
            out[0, k * 3 + c] = smooth[at, c] + v * (smooth[at + 1, c] + v * smooth[at + 2, c])
            out[1, k * 3 + c] = smooth[at + 3, c] + v * smooth[at + 4, c]
            out[2, k * 3 + c] = smooth[at + 5, c]


@compiled
def at_pixel(row: FloatArray, j: int, columns: int, out: FloatArray) -> None:
    """Contract ``at_row``'s result with column ``j``: ``out`` becomes ``(60,)``, term by channel."""
    u = 2.0 * (j + 0.5) / columns - 1.0
    for k in range(NORMAL_TERMS * 3):
        out[k] = row[0, k] + u * (row[1, k] + u * row[2, k])


@compiled
def colour(here: FloatArray, nx: float, ny: float, out: FloatArray) -> None:
    """Write the change of colour ``(3,)`` of a normal, by Horner's rule over ``at_pixel``'s terms."""
    for c in range(3):
        k = NORMAL_TERMS
        total = 0.0
        for a in range(NORMAL_DEGREE, -1, -1):
            inner = 0.0
            for _ in range(NORMAL_DEGREE + 1 - a):
                k -= 1
                inner = inner * ny + (here[k * 3 + c] if k >= 0 else 0.0)
            total = total * nx + inner
        out[c] = total


@compiled
def colour_and_slope(here: FloatArray, nx: float, ny: float, out: FloatArray, by: FloatArray) -> None:
    """As ``colour``, and the derivatives by nx and ny into ``by``, ``(3, 2)``."""
    for c in range(3):
        k = NORMAL_TERMS
        total, total_x, total_y = 0.0, 0.0, 0.0
        for a in range(NORMAL_DEGREE, -1, -1):
            inner, inner_y = 0.0, 0.0
            for _ in range(NORMAL_DEGREE + 1 - a):
                k -= 1
                inner_y = inner_y * ny + inner
                inner = inner * ny + (here[k * 3 + c] if k >= 0 else 0.0)
            total_x = total_x * nx + total
            total_y = total_y * nx + inner_y
            total = total * nx + inner
        out[c], by[c, 0], by[c, 1] = total, total_x, total_y


@compiled
def softly_limited(sine: float, limit: float) -> float:
    """The sine of a slope, bent towards ``limit`` beyond the knee; once differentiable, increasing."""
    knee = KNEE * limit
    if sine <= knee:
        return sine
    room = limit - knee
    bent: float = knee + room * (1.0 - np.exp(-(sine - knee) / room))
    return bent


@compiled
def shades(
    smooth: FloatArray,
    normal: FloatArray,
    place: IntArray,
    rows: int,
    columns: int,
    out: FloatArray,
    by: FloatArray,
) -> None:
    """Write the change of colour, and its derivatives by the normal, at chosen pixels.

    Args:
        smooth: ``(120, 3)`` coefficients.
        normal: ``(n, 2)``.
        place: ``(n, 2)`` row and column, in the order of the rows for speed.
        rows: of the image.
        columns: of the image.
        out: ``(n, 3)`` overwritten.
        by: ``(n, 3, 2)`` overwritten.
    """
    row, here = np.empty((3, 60)), np.empty(60)
    last = -1
    for k in range(len(normal)):
        if place[k, 0] != last:
            last = place[k, 0]
            at_row(smooth, last, rows, row)
        at_pixel(row, place[k, 1], columns, here)
        colour_and_slope(here, normal[k, 0], normal[k, 1], out[k], by[k])


@compiled
def normals_from_colour(
    change: FloatArray,
    smooth: FloatArray,
    limit: float,
    noise: float,
    ridge: float,
    normal: FloatArray,
    fit: FloatArray,
) -> None:
    """Find the surface normal that explains each pixel's change of colour.

    Each pixel starts from flat and from its neighbours' answers, and from a ring of slopes where
    those leave too much unexplained.

    Args:
        change: ``(rows, columns, 3)`` grey levels against the untouched gel.
        smooth: coefficients, see ``harness.sim.optics.shading``.
        limit: sine of the steepest slope the coefficients support; the answer is held to it.
        noise: grey levels rms; explained well enough below twice this.
        ridge: grey levels squared, pulls towards flat.
        normal: ``(rows, columns, 2)`` overwritten: the image part of the unit normal.
        fit: ``(rows, columns, 2)`` overwritten: rms grey levels left over, and the standard
            deviation of the slope's sine for noise of one grey level.
    """
    rows, columns = change.shape[:2]
    row, here = np.empty((3, 60)), np.empty(60)
    shade, by = np.empty(3), np.empty((3, 2))
    for i in range(rows):
        at_row(smooth, i, rows, row)
        for j in range(columns):
            at_pixel(row, j, columns, here)
            seen = change[i, j]
            size = np.sqrt(seen[0] ** 2 + seen[1] ** 2 + seen[2] ** 2)
            x, y, left, spread = _descend(here, seen, 0.0, 0.0, limit, ridge, shade, by)
            for k in range(2 + _STARTS):
                # What is explained well enough stays so; the ring is tried as a whole or not at all.
                if k <= 2 and not (size > _FAINT and left > 2.0 * noise):
                    break
                if (k == 0 and j == 0) or (k == 1 and i == 0):
                    continue
                if k == 0:
                    start_x, start_y = normal[i, j - 1, 0], normal[i, j - 1, 1]
                elif k == 1:
                    start_x, start_y = normal[i - 1, j, 0], normal[i - 1, j, 1]
                else:
                    turn = 2.0 * np.pi * (k - 2) / _STARTS
                    start_x, start_y = 0.6 * limit * np.cos(turn), 0.6 * limit * np.sin(turn)
                again = _descend(here, seen, start_x, start_y, limit, ridge, shade, by)
                if again[2] < left:
                    x, y, left, spread = again
            normal[i, j, 0], normal[i, j, 1] = x, y
            fit[i, j, 0], fit[i, j, 1] = left, spread


@compiled
def _descend(
    here: FloatArray,
    seen: FloatArray,
    x: float,
    y: float,
    limit: float,
    ridge: float,
    shade: FloatArray,
    by: FloatArray,
) -> tuple[float, float, float, float]:
    h00, h01, h11 = 1.0, 0.0, 1.0
    for _ in range(_STEPS):
        colour_and_slope(here, x, y, shade, by)
        g0, g1 = ridge * x, ridge * y
        h00, h01, h11 = ridge, 0.0, ridge
        for c in range(3):
            r = shade[c] - seen[c]
            g0 += by[c, 0] * r
            g1 += by[c, 1] * r
            h00 += by[c, 0] * by[c, 0]
            h01 += by[c, 0] * by[c, 1]
            h11 += by[c, 1] * by[c, 1]
        det = h00 * h11 - h01 * h01
        dx, dy = -(h11 * g0 - h01 * g1) / det, -(h00 * g1 - h01 * g0) / det
        reach = np.sqrt(dx * dx + dy * dy)
        if reach > 0.25:
            dx, dy = dx * 0.25 / reach, dy * 0.25 / reach
        x, y = x + dx, y + dy
        size = np.sqrt(x * x + y * y)
        if size > limit:
            x, y = x * limit / size, y * limit / size
        if reach < _SETTLED:
            break
    colour_and_slope(here, x, y, shade, by)
    left = 0.0
    for c in range(3):
        left += (shade[c] - seen[c]) ** 2
    det = h00 * h11 - h01 * h01
    return x, y, np.sqrt(left / 3.0), np.sqrt((h00 + h11) / det)
