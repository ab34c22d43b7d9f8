"""Slope from colour: Gauss and Newton at every pixel of one image."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled
from harness.sim.optics.shading import at_pixel, at_row, colour_and_slope

_STEPS = 8
_SETTLED = 1e-4
_STARTS = 8
_FAINT = 12.0
"""Grey levels below which a colour has one explanation, the one near flat."""


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
