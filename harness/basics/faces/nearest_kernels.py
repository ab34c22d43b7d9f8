"""Where a surface is from a point, in machine code: nearest places, walls and columns."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_SEAM = 1e-9
"""By which a triangle is larger for a ray, so that none slips through between two of them."""


@compiled
def nearest_on_triangle(point: FloatArray, corners: FloatArray, out: FloatArray) -> float:
    """Fill ``out`` with the place of a triangle nearest to a point; returns the squared distance.

    Ericson, Real-Time Collision Detection, 2005, section 5.1.5. A triangle without area counts
    as its longest edges.
    """
    best = np.inf
    a, b, c = corners[0], corners[1], corners[2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = point[0] - a[0], point[1] - a[1], point[2] - a[2]
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    wu, wv = wx * ux + wy * uy + wz * uz, wx * vx + wy * vy + wz * vz
    area = uu * vv - uv * uv
    if area > 1e-14 * uu * vv:
        s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            out[0], out[1], out[2] = a[0] + s * ux + t * vx, a[1] + s * uy + t * vy, a[2] + s * uz + t * vz
            return float(_squared(point, out))
    for first in range(3):
        start, end = corners[first], corners[(first + 1) % 3]
        length = _squared(start, end)
        share = 0.0
        if length > 0.0:
            for axis in range(3):
                share += (point[axis] - start[axis]) * (end[axis] - start[axis])
            share = min(max(share / length, 0.0), 1.0)
        gap = 0.0
        for axis in range(3):
            gap += (start[axis] + share * (end[axis] - start[axis]) - point[axis]) ** 2
        if gap < best:
            best = gap
            for axis in range(3):
                out[axis] = start[axis] + share * (end[axis] - start[axis])
    return best


@compiled
def _squared(a: FloatArray, b: FloatArray) -> float:
    return float((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@compiled
def nearest_places(
    points: FloatArray,
    directions: FloatArray,
    least_cosine: float,
    reach: FloatArray,
    corners: FloatArray,
    normals: FloatArray,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    starts: IntArray,
    faces: IntArray,
) -> tuple[FloatArray, IntArray]:
    """The nearest place of a surface that faces the right way.

    Args:
        points: ``(n, 3)`` m.
        directions: ``(n, 3)`` unit; a face counts whose normal makes an angle with it of which the
            cosine is at least ``least_cosine``.
        least_cosine: -1 for any face.
        reach: ``(n,)`` m, beyond which nothing counts.
        corners: ``(m, 3, 3)`` of the faces.
        normals: ``(m, 3)`` of the faces.
        origin: of a ``FaceGrid``, as are ``cell``, ``shape``, ``starts`` and ``faces``.
        cell: m.
        shape: cells along each side.
        starts: of each cell's list.
        faces: the lists.

    Returns:
        ``(n, 3)`` places and ``(n,)`` faces; where there is none the point itself and -1.
    """
    places = points.copy()
    found = np.full(len(points), -1, np.int64)
    low, high, here = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    for n in range(len(points)):
        best = reach[n] ** 2
        for axis in range(3):
            first = np.floor((points[n, axis] - reach[n] - origin[axis]) / cell)
            last = np.floor((points[n, axis] + reach[n] - origin[axis]) / cell)
            low[axis] = int(min(max(first, 0.0), shape[axis] - 1.0))
            high[axis] = int(min(max(last, 0.0), shape[axis] - 1.0))
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    c = (i * shape[1] + j) * shape[2] + k
                    for at in range(starts[c], starts[c + 1]):
                        f = faces[at]
                        cosine = (
                            normals[f, 0] * directions[n, 0]
                            + normals[f, 1] * directions[n, 1]
                            + normals[f, 2] * directions[n, 2]
                        )
                        if cosine < least_cosine:
                            continue
                        gap = nearest_on_triangle(points[n], corners[f], here)
                        if gap < best:
                            best = gap
                            places[n] = here
                            found[n] = f
    return places, found


@compiled
def first_hits(origins: FloatArray, directions: FloatArray, corners: FloatArray) -> FloatArray:
    """``(n,)`` how far along each ray the first triangle is; infinite where there is none.

    Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, J. Graphics Tools 2(1), 1997.
    """
    far = np.full(len(origins), np.inf)
    for n in range(len(origins)):
        ox, oy, oz = origins[n, 0], origins[n, 1], origins[n, 2]
        dx, dy, dz = directions[n, 0], directions[n, 1], directions[n, 2]
        for f in range(len(corners)):
            ax, ay, az = corners[f, 0, 0], corners[f, 0, 1], corners[f, 0, 2]
            e1x, e1y, e1z = corners[f, 1, 0] - ax, corners[f, 1, 1] - ay, corners[f, 1, 2] - az
            e2x, e2y, e2z = corners[f, 2, 0] - ax, corners[f, 2, 1] - ay, corners[f, 2, 2] - az
            px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
            volume = e1x * px + e1y * py + e1z * pz
            if volume == 0.0:
                continue
            sx, sy, sz = ox - ax, oy - ay, oz - az
            u = (sx * px + sy * py + sz * pz) / volume
            if u < -_SEAM or u > 1.0 + _SEAM:
                continue
            qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
            v = (dx * qx + dy * qy + dz * qz) / volume
            if v < -_SEAM or u + v > 1.0 + _SEAM:
                continue
            t = (e2x * qx + e2y * qy + e2z * qz) / volume
            if 0.0 < t < far[n]:
                far[n] = t
    return far


@compiled
def column_crossings(
    corners: FloatArray, low: FloatArray, pitch: FloatArray, sides: IntArray
) -> tuple[IntArray, FloatArray, IntArray]:
    """Where vertical lines on a grid cross the faces.

    Args:
        corners: ``(m, 3, 3)`` m.
        low: ``(2,)`` m, x and y of the first line.
        pitch: ``(2,)`` m between the lines.
        sides: ``(2,)`` how many lines.

    Returns:
        Of each crossing the line, the height, and +1 where the face looks up, -1 where down.
    """
    lines, heights, signs = [0], [0.0], [0]
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        i0 = max(int(np.ceil((min(a[0], b[0], c[0]) - low[0]) / pitch[0])), 0)
        i1 = min(int(np.floor((max(a[0], b[0], c[0]) - low[0]) / pitch[0])), sides[0] - 1)
        j0 = max(int(np.ceil((min(a[1], b[1], c[1]) - low[1]) / pitch[1])), 0)
        j1 = min(int(np.floor((max(a[1], b[1], c[1]) - low[1]) / pitch[1])), sides[1] - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                x, y = low[0] + i * pitch[0], low[1] + j * pitch[1]
                s = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
                t = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
                if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
                    lines.append(i * sides[1] + j)
                    heights.append(a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]))
                    signs.append(1 if area > 0.0 else -1)
    return np.array(lines)[1:], np.array(heights)[1:], np.array(signs)[1:]
