"""Which face is in front at one place of every pixel, for faces about as small as pixels are.

Inverse depth is linear in the picture, so that a triangle is a plane there.
"""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled
from harness.objectfile.vision.coverage.contour import EMPTY
from harness.objectfile.vision.prefetch import AHEAD, bring_row

_ON_EDGE = 1e-7
"""Pixels by which a triangle is widened, so that no place falls between two that share an edge."""


@compiled
def projected(
    vertices: FloatArray, camera_from_object: FloatArray, focal: float, x: float, y: float, seen: FloatArray
) -> float:
    """Vertices as places in the picture with inverse depth; the least depth of all, m, is returned.

    Args:
        vertices: ``(n, 3)`` m, object frame.
        camera_from_object: ``(4, 4)``.
        focal: in any unit, which is that of places then.
        x: of the axis.
        y: of the axis.
        seen: ``(n, 3)`` x, y and 1/m, written; without meaning where depth is not positive.
    """
    m, least = camera_from_object, np.inf
    for n in range(len(vertices)):
        a, b, c = vertices[n, 0], vertices[n, 1], vertices[n, 2]
        depth = m[2, 0] * a + m[2, 1] * b + m[2, 2] * c + m[2, 3]
        near = 1.0 / depth if depth != 0.0 else 0.0
        seen[n, 0] = focal * near * (m[0, 0] * a + m[0, 1] * b + m[0, 2] * c + m[0, 3]) + x
        seen[n, 1] = focal * near * (m[1, 0] * a + m[1, 1] * b + m[1, 2] * c + m[1, 3]) + y
        seen[n, 2] = near
        least = min(least, depth)
    return least


@compiled
def find_front(
    seen: FloatArray,
    faces: AnyArray,
    some: AnyArray,
    places: AnyArray,
    offsets: AnyArray,
    side: int,
    nearness: AnyArray,
    front: AnyArray,
) -> None:
    """The greatest inverse depth of some faces at the chosen places of pixels, and whose it is.

    Args:
        seen: ``(n, 3)`` x and y of vertices in sub-pixels, whose centres are whole numbers, and 1/m.
        faces: ``(m, 3)`` uint32.
        some: ``(k,)`` int32, of the faces; the first of any that are equally near is taken.
        places: ``(rows, columns)`` which of ``offsets`` is looked at; ``EMPTY`` for none.
        offsets: ``(k, 2)`` row and column of sub-pixels in a pixel.
        side: sub-pixels along a pixel.
        nearness: ``(rows, columns)`` float32 1/m, raised; 0 where there is nothing.
        front: ``(rows, columns)`` int32, written.
    """
    rows, columns = places.shape
    scale = float(side)
    for n in range(len(some)):
        m = some[n]
        if n + AHEAD < len(some):
            for corner in range(3):
                bring_row(seen, faces[some[n + AHEAD], corner])
        a, b, c = faces[m, 0], faces[m, 1], faces[m, 2]
        x0, x1, x2, y0, y1, y2 = seen[a, 0], seen[b, 0], seen[c, 0], seen[a, 1], seen[b, 1], seen[c, 1]
        i0, i1 = _pixels(min(y0, min(y1, y2)), max(y0, max(y1, y2)), scale, rows)
        j0, j1 = _pixels(min(x0, min(x1, x2)), max(x0, max(x1, x2)), scale, columns)
        if i0 > i1 or j0 > j1:
            continue
        ax, ay, bx, by = x1 - x0, y1 - y0, x2 - x0, y2 - y0
        area = ax * by - bx * ay
        if area == 0.0:
            continue
        one = 1.0 / area
        ux, uy, vx, vy = by * one, -bx * one, -ay * one, ax * one
        z0, z1, z2 = seen[a, 2], seen[b, 2], seen[c, 2]
        az, bz, most = z1 - z0, z2 - z0, max(z0, max(z1, z2))
        wider = _ON_EDGE * max(abs(ux) + abs(uy), abs(vx) + abs(vy))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                at = places[i, j]
                if at == EMPTY:
                    continue
                dy, dx = i * scale + offsets[at, 0] - y0, j * scale + offsets[at, 1] - x0
                u, v = ux * dx + uy * dy, vx * dx + vy * dy
                if u >= -wider and v >= -wider and u + v <= 1.0 + 2.0 * wider:
                    value = np.float32(min(z0 + u * az + v * bz, most))
                    if value > nearness[i, j]:
                        nearness[i, j], front[i, j] = value, m


@compiled
def nearest_of(nearness: AnyArray, front: AnyArray) -> None:
    """Put what further parts of the faces left into the first: as if all had gone there in their order.

    Args:
        nearness: ``(parts, rows, columns)`` of ``find_front``; parts in the faces' order.
        front: of the same shape.
    """
    parts, rows, columns = nearness.shape
    for k in range(1, parts):
        for i in range(rows):
            for j in range(columns):
                if nearness[k, i, j] > nearness[0, i, j]:
                    nearness[0, i, j], front[0, i, j] = nearness[k, i, j], front[k, i, j]


@compiled
def _pixels(low: float, high: float, scale: float, count: int) -> tuple[int, int]:
    """First and last of so many pixels that have a sub-pixel from ``low`` to ``high``."""
    begin = np.ceil(max(low, 0.0) - _ON_EDGE)
    end = np.floor(min(high, count * scale - 1.0) + _ON_EDGE)
    if begin > end:
        return 0, -1
    return int((begin + 0.5) / scale), int((end + 0.5) / scale)


@compiled
def gathered(
    count: AnyArray,
    places: AnyArray,
    nearness: AnyArray,
    front: AnyArray,
    side: int,
    offsets: AnyArray,
    most: int,
) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray, AnyArray]:
    """Pixels that show anything, as an ``Outline`` has them; what rounding left to no face is left out.

    Args:
        count: ``(rows, columns)`` covered sub-pixels of each pixel.
        places: of ``find_front``, and so are the next three.
        nearness: 1/m.
        front: faces.
        side: sub-pixels along a pixel.
        offsets: of places.
        most: pixels that are covered.
    """
    pixels, cover = np.empty(most, np.int64), np.empty(most, np.float32)
    middles, depth, faces = (
        np.empty((most, 2), np.float32),
        np.empty(most, np.float32),
        np.empty(most, np.int32),
    )
    n, columns = 0, count.shape[1]
    for i in range(count.shape[0]):
        for j in range(columns):
            if places[i, j] == EMPTY or not nearness[i, j] > np.float32(0.0):
                continue
            row, column = offsets[places[i, j], 0], offsets[places[i, j], 1]
            pixels[n], cover[n] = i * columns + j, count[i, j] / (side * side)
            middles[n, 0] = j + 0.5 + (column - side // 2) / side
            middles[n, 1] = i + 0.5 + (row - side // 2) / side
            depth[n], faces[n] = np.float32(1.0) / nearness[i, j], front[i, j]
            n += 1
    return pixels[:n], cover[:n], middles[:n], depth[:n], faces[:n]
