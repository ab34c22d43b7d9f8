"""One triangle drawn into a z-buffer, row by row."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.gel.depth_lanes import EIGHT, hold_nearer

ON_EDGE = 1e-7
"""Pixels by which a triangle is widened, so that no line falls between two that share an edge."""

_BYTES = 8

Corners = tuple[float, float, float, float, float, float]
"""x and y of three corners in pixels, from the least y to the greatest."""

Steps = tuple[float, float, float]
"""Columns a row, along the edges from the first corner to the last and to the second, and between those."""

Line = tuple[float, float, float, float]
"""z at the first pixel of a part of a row, its step from pixel to pixel, the least and the greatest there."""


@compiled
def draw(
    p: FloatArray,
    k: int,
    area: float,
    span: FloatArray,
    depth: FloatArray,
    face: IntArray,
    index: int,
    wants_face: bool,
) -> None:
    """Hold the depth of every pixel in a triangle to its own where that is nearer.

    Args:
        p: ``(9, n)`` x and y in pixels, whole at their centres, and z in metres of each corner in turn.
        k: which of the n.
        area: twice the triangle's own, in pixels, with its sign; not 0.
        span: ``(2,)`` metres, least and greatest z that is seen.
        depth: ``(rows, columns)`` metres, overwritten.
        face: the same shape, the least index of the nearest; or anything, and left alone.
        index: of the triangle.
        wants_face: whether ``face`` is written.
    """
    rows, columns = depth.shape
    corners = _sorted(p, k)
    steps = _steps(corners)
    z_low, z_high = min(p[2, k], p[5, k], p[8, k]), max(p[2, k], p[5, k], p[8, k])
    ax, ay, az = p[3, k] - p[0, k], p[4, k] - p[1, k], p[5, k] - p[2, k]
    bx, by, bz = p[6, k] - p[0, k], p[7, k] - p[1, k], p[8, k] - p[2, k]
    slope_x, slope_y = (az * by - bz * ay) / area, (bz * ax - az * bx) / area
    quick = z_low >= span[0] and z_high <= span[1] and not wants_face and depth.size >= EIGHT
    place = depth.ctypes.data
    top = max(int(np.ceil(corners[1] - ON_EDGE)), 0)
    for i in range(top, min(int(np.floor(corners[5] + ON_EDGE)), rows - 1) + 1):
        first, last = _columns(i, columns, corners, steps)
        if first > last:
            continue
        z_row = p[2, k] + slope_y * (i - p[1, k]) - slope_x * p[0, k]
        if quick:
            z_first = z_row + slope_x * first
            line = z_first, slope_x, z_low, z_high
            _hold(place, rows * columns, i * columns + first, last - first + 1, line)
            continue
        for j in range(first, last + 1):
            z = min(max(z_row + slope_x * j, z_low), z_high)
            if z < span[0] or z > span[1] or z > depth[i, j]:
                continue
            if wants_face:
                face[i, j] = index if z < depth[i, j] else min(index, face[i, j])
            depth[i, j] = z


@compiled
def _sorted(p: FloatArray, k: int) -> Corners:
    a, b, c = 0, 3, 6
    if p[a + 1, k] > p[b + 1, k]:
        a, b = b, a
    if p[b + 1, k] > p[c + 1, k]:
        b, c = c, b
    if p[a + 1, k] > p[b + 1, k]:
        a, b = b, a
    return p[a, k], p[a + 1, k], p[b, k], p[b + 1, k], p[c, k], p[c + 1, k]


@compiled
def _steps(of: Corners) -> Steps:
    # From the lower end up, so that two triangles compute a shared edge alike, to the bit.
    xa, ya, xb, yb, xc, yc = of
    return _step(xa, ya, xc, yc), _step(xa, ya, xb, yb), _step(xb, yb, xc, yc)


@compiled
def _step(x0: float, y0: float, x1: float, y1: float) -> float:
    height = y1 - y0
    return (x1 - x0) / height if height > ON_EDGE else 0.0


@compiled
def _columns(i: int, columns: int, of: Corners, steps: Steps) -> tuple[int, int]:
    """The first and the last column of a row; the last before the first where there is none."""
    xa, ya, xb, yb, xc, yc = of
    x_low, x_high = min(xa, xb, xc), max(xa, xb, xc)
    left, right = _reach(i, xa, ya, xc, yc, steps[0], x_high, x_low)
    # An edge counts a little past its ends: beside a corner both that end there do.
    if i <= yb + ON_EDGE:
        left, right = _reach(i, xa, ya, xb, yb, steps[1], left, right)
    if i >= yb - ON_EDGE:
        left, right = _reach(i, xb, yb, xc, yc, steps[2], left, right)
    first = int(np.ceil(max(left, x_low, 0.0) - ON_EDGE))
    last = int(np.floor(min(right, x_high, columns - 1.0) + ON_EDGE))
    return first, last


@compiled
def _reach(
    i: int, x0: float, y0: float, x1: float, y1: float, step: float, left: float, right: float
) -> tuple[float, float]:
    """The columns from ``left`` to ``right``, widened to those in which a row meets an edge."""
    if y1 - y0 <= ON_EDGE:
        return min(left, x0, x1), max(right, x0, x1)
    x = x0 + (i - y0) * step
    return min(left, x), max(right, x)


@compiled
def _hold(place: int, pixels: int, at: int, count: int, line: Line) -> None:
    """Hold ``count`` pixels from the one at ``at`` to a line, of all ``pixels`` laid out from an address."""
    z_first, step, z_low, z_high = line
    for start in range(at, at + count, EIGHT):
        # The last eight of a picture may begin before the row does: those pixels are left as they are.
        within = min(start, pixels - EIGHT)
        before, length = np.float64(within - at), np.float64(count)
        hold_nearer(place + _BYTES * within, z_first, step, z_low, z_high, before, length)
