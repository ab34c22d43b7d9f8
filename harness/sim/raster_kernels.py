"""The z-buffer's loops."""

import numpy as np

from harness.arrays import FloatArray, IntArray
from harness.sim.compiled import compiled
from harness.sim.face_grid import faces_in_box

Grid = tuple[FloatArray, float, IntArray, IntArray, IntArray]

Edge = tuple[float, float, float, float, float]

_ON_EDGE = 1e-7
"""Pixels by which a triangle is widened, so that no line falls between two that share an edge."""


@compiled
def rasterise(
    vertices: FloatArray,
    faces: IntArray,
    grid: Grid,
    view_from_object: FloatArray,
    corner: FloatArray,
    pitch: float,
    span: FloatArray,
    depth: FloatArray,
    face: IntArray,
) -> None:
    """Fill ``depth`` with the least z in ``span`` of each pixel's line, +inf where there is none.

    Args:
        vertices: ``(v, 3)`` metres, object frame.
        faces: ``(f, 3)``.
        grid: origin, cell, shape, starts and faces of a ``FaceGrid``.
        view_from_object: ``(n, 4, 4)`` rigid.
        corner: ``(2,)`` metres, x and y of the image's first corner.
        pitch: metres a pixel.
        span: ``(2,)`` metres, least and greatest z that is seen.
        depth: ``(n, rows, columns)``, overwritten.
        face: the same shape, overwritten with face indices or -1; or empty, and left alone.
    """
    rows, columns = depth.shape[1], depth.shape[2]
    low = np.array([corner[0], corner[1], span[0]])
    high = np.array([corner[0] + columns * pitch, corner[1] + rows * pitch, span[1]])
    stamps = np.zeros(len(faces), np.int64)
    found = np.empty(len(faces), np.int64)
    wants_face = face.size > 0
    for n in range(len(view_from_object)):
        depth[n] = np.inf
        if wants_face:
            face[n] = -1
        count = faces_in_box(
            view_from_object[n], low, high, grid[0], grid[1], grid[2], grid[3], grid[4], n + 1, stamps, found
        )
        corners = np.empty((3, 3))
        for at in range(count):
            _to_pixels(vertices, faces[found[at]], view_from_object[n], corner, pitch, corners)
            _draw(corners, span, depth[n], face[n] if wants_face else face[:, :, 0], found[at], wants_face)


@compiled
def _to_pixels(
    vertices: FloatArray, triangle: IntArray, r: FloatArray, corner: FloatArray, pitch: float, out: FloatArray
) -> None:
    # Columns and rows such that pixel centres are whole numbers; z stays in metres.
    per_pixel = 1.0 / pitch
    for c in range(3):
        x, y, z = vertices[triangle[c], 0], vertices[triangle[c], 1], vertices[triangle[c], 2]
        out[c, 0] = (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + r[0, 3] - corner[0]) * per_pixel - 0.5
        out[c, 1] = (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + r[1, 3] - corner[1]) * per_pixel - 0.5
        out[c, 2] = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + r[2, 3]


@compiled
def _draw(
    p: FloatArray, span: FloatArray, depth: FloatArray, face: IntArray, index: int, wants_face: bool
) -> None:
    rows, columns = depth.shape
    y_low = min(p[0, 1], p[1, 1], p[2, 1])
    y_high = max(p[0, 1], p[1, 1], p[2, 1])
    x_low = min(p[0, 0], p[1, 0], p[2, 0])
    x_high = max(p[0, 0], p[1, 0], p[2, 0])
    z_low = min(p[0, 2], p[1, 2], p[2, 2])
    z_high = max(p[0, 2], p[1, 2], p[2, 2])
    if (
        x_high < -_ON_EDGE
        or y_high < -_ON_EDGE
        or x_low > columns - 1 + _ON_EDGE
        or y_low > rows - 1 + _ON_EDGE
    ):
        return
    if z_low > span[1] or z_high < span[0]:
        return
    ax, ay, bx, by = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
    area = ax * by - bx * ay
    if area == 0.0:
        return  # seen edge-on: its edges are drawn by its neighbours
    az, bz = p[1, 2] - p[0, 2], p[2, 2] - p[0, 2]
    slope_x, slope_y = (az * by - bz * ay) / area, (bz * ax - az * bx) / area
    whole = z_low >= span[0] and z_high <= span[1]
    edges = _edges(p)
    for i in range(
        max(int(np.ceil(y_low - _ON_EDGE)), 0), min(int(np.floor(y_high + _ON_EDGE)), rows - 1) + 1
    ):
        left, right = x_high, x_low
        for c in range(3):
            y0, y1, x0, x1, slope = edges[c]
            if i < y0 - _ON_EDGE or i > y1 + _ON_EDGE:
                continue
            x = x0 + (i - y0) * slope
            if y1 - y0 <= _ON_EDGE:
                left, right = min(left, x0, x1), max(right, x0, x1)
            else:
                left, right = min(left, x), max(right, x)
        first = int(np.ceil(max(left, x_low, 0.0) - _ON_EDGE))
        last = int(np.floor(min(right, x_high, columns - 1.0) + _ON_EDGE))
        if first > last:
            continue
        z_row = p[0, 2] + slope_y * (i - p[0, 1]) - slope_x * p[0, 0]
        if whole and not wants_face:
            _nearer(depth[i, first : last + 1], z_row + slope_x * first, slope_x, z_low, z_high)
            continue
        for j in range(first, last + 1):
            z = min(max(z_row + slope_x * j, z_low), z_high)
            if z < depth[i, j] and z >= span[0] and z <= span[1]:
                depth[i, j] = z
                if wants_face:
                    face[i, j] = index


@compiled
def _edges(
    p: FloatArray,
) -> tuple[Edge, Edge, Edge]:
    return _edge(p, 0, 1), _edge(p, 1, 2), _edge(p, 2, 0)


@compiled
def _edge(p: FloatArray, c: int, d: int) -> Edge:
    # Lower end first, so that two triangles compute a shared edge alike, to the bit.
    if p[c, 1] > p[d, 1]:
        c, d = d, c
    height = p[d, 1] - p[c, 1]
    slope = (p[d, 0] - p[c, 0]) / height if height > _ON_EDGE else 0.0
    return p[c, 1], p[d, 1], p[c, 0], p[d, 0], slope


@compiled
def _nearer(part: FloatArray, z_first: float, slope: float, z_low: float, z_high: float) -> None:
    # In this form the compiler takes eight pixels at a time (a 32-bit count, no jump).
    for j in range(len(part)):
        z: float = z_first + slope * np.float64(np.int32(j))
        # Rounding on a steep triangle must not leave the triangle.
        z = z if z > z_low else z_low
        z = z if z < z_high else z_high
        old = part[j]
        part[j] = z if z < old else old
