"""A mesh's outline and depth through a pinhole, on a grid of sub-pixels.

Inverse depth is linear in the picture, so that a triangle is a plane there. Triangles that reach behind the
camera are cut first.
"""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled, copy_line

NEAREST = 1e-6
"""m before the camera: what is nearer is not seen."""

_ON_EDGE = 1e-7
"""Sub-pixels by which a triangle is widened, so that no place falls between two that share an edge."""


@compiled
def placed(
    vertices: FloatArray, camera_from_object: FloatArray, focal: float, x: float, y: float, out: FloatArray
) -> None:
    """Vertices as places (x, y) with inverse depth; depth itself, negated, where they are not in front.

    Args:
        vertices: ``(n, 3)`` m, object frame.
        camera_from_object: ``(4, 4)``.
        focal: sub-pixels.
        x: of the axis in sub-pixels, counted so that centres are whole numbers.
        y: the same.
        out: ``(n, 6)``: place and inverse depth (or 0), then the place in the camera's frame.
    """
    m = camera_from_object
    for n in range(len(vertices)):
        a, b, c = vertices[n, 0], vertices[n, 1], vertices[n, 2]
        for row in range(3):
            out[n, 3 + row] = m[row, 0] * a + m[row, 1] * b + m[row, 2] * c + m[row, 3]
        _to_picture(out[n, 3], out[n, 4], out[n, 5], focal, x, y, out[n])


@compiled
def _to_picture(a: float, b: float, c: float, focal: float, x: float, y: float, out: FloatArray) -> None:
    if c >= NEAREST:
        out[2] = 1.0 / c
        out[0], out[1] = focal * a * out[2] + x, focal * b * out[2] + y
    else:
        out[:3] = 0.0


@compiled
def draw(
    seen: FloatArray,
    faces: AnyArray,
    focal: float,
    x: float,
    y: float,
    first: int,
    last: int,
    closed: bool,
    nearness: AnyArray,
    front: AnyArray,
) -> None:
    """The greatest inverse depth of each sub-pixel in some rows; 0 stays where nothing is.

    Args:
        seen: of ``placed``.
        faces: ``(m, 3)``.
        focal: as in ``placed``, and so are ``x`` and ``y``.
        x: sub-pixels.
        y: sub-pixels.
        first: row of sub-pixels.
        last: row, not drawn itself.
        closed: whether faces seen from behind are hidden by others, and left out.
        nearness: ``(rows, columns)`` float32 1/m, raised.
        front: ``(rows, columns)`` int32, written: whose it is; ``(0, 0)`` where nobody asks.
    """
    cut, corner = np.empty((4, 3)), np.empty((3, 3))
    for m in range(len(faces)):
        in_front = 0
        for c in range(3):
            in_front += 1 if seen[faces[m, c], 2] > 0.0 else 0
        if in_front == 3:
            p, q, r = seen[faces[m, 0]], seen[faces[m, 1]], seen[faces[m, 2]]
            # Most faces of a fine mesh lie between the sub-pixels' centres, and need no more than this.
            if _lies_between(min(p[1], min(q[1], r[1])), max(p[1], max(q[1], r[1])), first, last):
                continue
            if _lies_between(min(p[0], min(q[0], r[0])), max(p[0], max(q[0], r[0])), 0, nearness.shape[1]):
                continue
            for c in range(3):
                corner[c] = seen[faces[m, c], :3]
            _fill(corner, m, first, last, closed, nearness, front)
        elif in_front > 0:
            count = _cut(seen, faces[m], focal, x, y, cut)
            for c in range(2, count):
                corner[0], corner[1], corner[2] = cut[0], cut[c - 1], cut[c]
                _fill(corner, m, first, last, closed, nearness, front)


@compiled
def _lies_between(low: float, high: float, first: int, last: int) -> bool:
    """Whether no whole number from ``first`` to before ``last`` is between two, both widened a little."""
    begin = max(np.ceil(max(low, first - 1.0) - _ON_EDGE), first)
    return bool(begin > min(np.floor(min(high, last + 1.0) + _ON_EDGE), last - 1))


@compiled
def _cut(seen: FloatArray, face: AnyArray, focal: float, x: float, y: float, out: FloatArray) -> int:
    """Corners of what is left of a triangle in front of the camera: three or four."""
    count = 0
    for c in range(3):
        a, b = seen[face[c]], seen[face[(c + 1) % 3]]
        if a[5] >= NEAREST:
            copy_line(out[count], a[:3])
            count += 1
        if (a[5] >= NEAREST) != (b[5] >= NEAREST):
            share = (NEAREST - a[5]) / (b[5] - a[5])
            # The border's own depth, not the interpolated one that rounding may put behind it.
            _to_picture(
                a[3] + share * (b[3] - a[3]), a[4] + share * (b[4] - a[4]), NEAREST, focal, x, y, out[count]
            )
            count += 1
    return count


@compiled
def _fill(
    p: FloatArray, face: int, first: int, last: int, closed: bool, nearness: AnyArray, front: AnyArray
) -> None:
    """One triangle, row by row between its long edge and the two short ones."""
    columns = nearness.shape[1]
    x_low, x_high = min(p[0, 0], min(p[1, 0], p[2, 0])), max(p[0, 0], max(p[1, 0], p[2, 0]))
    if x_high < -_ON_EDGE or x_low > columns - 1 + _ON_EDGE:
        return
    ax, ay, bx, by = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
    area = ax * by - bx * ay
    if area == 0.0 or (closed and area > 0.0):
        return  # seen edge-on, where its edges are drawn by its neighbours, or from behind
    az, bz = p[1, 2] - p[0, 2], p[2, 2] - p[0, 2]
    slope_x, slope_y = (az * by - bz * ay) / area, (bz * ax - az * bx) / area
    most = max(p[0, 2], max(p[1, 2], p[2, 2]))
    top, middle, bottom = 0, 1, 2
    if p[middle, 1] < p[top, 1]:
        top, middle = middle, top
    if p[bottom, 1] < p[middle, 1]:
        middle, bottom = bottom, middle
    if p[middle, 1] < p[top, 1]:
        top, middle = middle, top
    x0, x1, x2 = p[top, 0], p[middle, 0], p[bottom, 0]
    y0, y1, y2 = p[top, 1], p[middle, 1], p[bottom, 1]
    # A horizontal edge has no share along it: its two ends are those of the other edges there.
    long_share = 1.0 / (y2 - y0) if y2 - y0 > _ON_EDGE else 0.0
    upper_share = 1.0 / (y1 - y0) if y1 - y0 > _ON_EDGE else 0.0
    lower_share = 1.0 / (y2 - y1) if y2 - y1 > _ON_EDGE else 0.0
    begin = max(int(np.ceil(max(y0, -1.0) - _ON_EDGE)), first)
    end = min(int(np.floor(min(y2, last + 1.0) + _ON_EDGE)), last - 1)
    for i in range(begin, end + 1):
        if long_share == 0.0:
            left, right = x_low, x_high
        else:
            u = x0 + min(max((i - y0) * long_share, 0.0), 1.0) * (x2 - x0)
            if i < y1:
                v = x0 + min(max((i - y0) * upper_share, 0.0), 1.0) * (x1 - x0)
                v = v if upper_share > 0.0 else x1
            else:
                v = x1 + min(max((i - y1) * lower_share, 0.0), 1.0) * (x2 - x1)
            left, right = min(u, v), max(u, v)
        start = int(np.ceil(max(left, 0.0) - _ON_EDGE))
        stop = int(np.floor(min(right, columns - 1.0) + _ON_EDGE))
        near = p[0, 2] + slope_y * (i - p[0, 1]) - slope_x * p[0, 0]
        row = nearness[i]
        if len(front) == 0:
            for j in range(max(start, 0), stop + 1):
                value = np.float32(min(near + slope_x * j, most))
                row[j] = max(row[j], value)
        else:
            for j in range(max(start, 0), stop + 1):
                value = np.float32(min(near + slope_x * j, most))
                if value > row[j]:
                    row[j], front[i, j] = value, face


@compiled
def look_through(
    nearness: AnyArray,
    front: AnyArray,
    side: int,
    offsets: AnyArray,
    first: int,
    last: int,
    cover: AnyArray,
    places: AnyArray,
    depth: AnyArray,
    faces: AnyArray,
) -> None:
    """How much of each pixel in some rows is covered, and the covered sub-pixel nearest to its centre.

    Args:
        nearness: ``(rows * side, columns * side)`` 1/m.
        front: of ``draw``.
        side: sub-pixels along a pixel, odd.
        offsets: ``(side * side, 2)`` row and column of each, from the centre outwards.
        first: row of pixels.
        last: row, not looked at itself.
        cover: ``(rows, columns)`` float32 0 to 1, written.
        places: ``(rows, columns, 2)`` float32 x and y in pixels, written where something is.
        depth: ``(rows, columns)`` float32 m, written; 0 where nothing is.
        faces: ``(rows, columns)`` int32, written where something is; ``(0, 0)`` where nobody asks.
    """
    middle = side // 2
    for i in range(first, last):
        for j in range(cover.shape[1]):
            count = 0
            for k in range(side):
                line = nearness[i * side + k]
                for m in range(j * side, (j + 1) * side):
                    count += 1 if line[m] > np.float32(0.0) else 0
            cover[i, j] = count / (side * side)
            if count == 0:
                depth[i, j] = 0.0
                continue
            at = 0
            while not nearness[i * side + offsets[at, 0], j * side + offsets[at, 1]] > np.float32(0.0):
                at += 1
            row, column = offsets[at, 0], offsets[at, 1]
            depth[i, j] = np.float32(1.0) / nearness[i * side + row, j * side + column]
            if len(faces):
                faces[i, j] = front[i * side + row, j * side + column]
            places[i, j, 0] = j + 0.5 + (column - middle) / side
            places[i, j, 1] = i + 0.5 + (row - middle) / side
