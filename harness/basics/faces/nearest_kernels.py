"""Where a surface is from a point, in machine code: nearest places, and where on a face a place is."""

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line


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
            return float(squared_gap(point, out))
    for first in range(3):
        start, end = corners[first], corners[(first + 1) % 3]
        length = squared_gap(start, end)
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
def squared_gap(a: FloatArray, b: FloatArray) -> float:
    """M², between two places; written out, as ``np.sum`` of three numbers makes an array of them."""
    return float((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@compiled
def _cells_within(
    point: FloatArray,
    reach: float,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    low: IntArray,
    high: IntArray,
) -> None:
    """Fill in the first and last cell along each axis of the grid that are within ``reach`` m of a point."""
    for axis in range(3):
        first = np.floor((point[axis] - reach - origin[axis]) / cell)
        last = np.floor((point[axis] + reach - origin[axis]) / cell)
        low[axis] = int(min(max(first, 0.0), shape[axis] - 1.0))
        high[axis] = int(min(max(last, 0.0), shape[axis] - 1.0))


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
        _cells_within(points[n], reach[n], origin, cell, shape, low, high)
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
                            copy_line(places[n], here)
                            found[n] = f
    return places, found


@compiled
def near_surface(
    points: FloatArray,
    most: float,
    corners: FloatArray,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    starts: IntArray,
    faces: IntArray,
) -> BoolArray:
    """``(n,)``: whether some face is no farther than ``most`` m from each of ``(n, 3)`` points.

    A point's own cell is asked first: that of a point on the surface holds the face it lies on.

    Args:
        points: ``(n, 3)`` m, finite.
        most: m.
        corners: ``(m, 3, 3)`` of the faces.
        origin: of a ``FaceGrid``, as are ``cell``, ``shape``, ``starts`` and ``faces``.
        cell: m.
        shape: ``(3,)`` cells.
        starts: of each cell's list.
        faces: of all lists.
    """
    near = np.zeros(len(points), np.bool_)
    low, high, here = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    limit = most * most
    for n in range(len(points)):
        for step in range(2):
            reach = 0.0 if step == 0 else most
            _cells_within(points[n], reach, origin, cell, shape, low, high)
            for i in range(low[0], high[0] + 1):
                for j in range(low[1], high[1] + 1):
                    for k in range(low[2], high[2] + 1):
                        if near[n]:
                            break
                        c = (i * shape[1] + j) * shape[2] + k
                        for at in range(starts[c], starts[c + 1]):
                            if nearest_on_triangle(points[n], corners[faces[at]], here) <= limit:
                                near[n] = True
                                break
            if near[n]:
                break
    return near


@compiled
def shares_on_faces(places: FloatArray, corners: FloatArray, chosen: IntArray) -> FloatArray:
    """``(n, 3)`` barycentric coordinates, from 0 to 1, of ``(n, 3)`` places on chosen faces.

    A face without area counts as its longest edge.

    Args:
        places: ``(n, 3)`` m, each on its face.
        corners: ``(m, 3, 3)`` of all faces.
        chosen: ``(n,)`` faces.
    """
    shares = np.zeros((len(places), 3))
    for n in range(len(places)):
        face = corners[chosen[n]]
        u, v, w = face[1] - face[0], face[2] - face[0], places[n] - face[0]
        uu, uv, vv = np.sum(u * u), np.sum(u * v), np.sum(v * v)
        wu, wv = np.sum(w * u), np.sum(w * v)
        area = uu * vv - uv * uv
        if area > 1e-14 * uu * vv:
            shares[n, 1] = min(max((vv * wu - uv * wv) / area, 0.0), 1.0)
            shares[n, 2] = min(max((uu * wv - uv * wu) / area, 0.0), 1.0 - shares[n, 1])
            shares[n, 0] = 1.0 - shares[n, 1] - shares[n, 2]
            continue
        longest = -1.0
        for first in range(3):
            second = (first + 1) % 3
            along = face[second] - face[first]
            length = np.sum(along * along)
            if length > longest:
                longest = length
                share = np.sum((places[n] - face[first]) * along) / length if length > 0.0 else 0.0
                share = min(max(share, 0.0), 1.0)
                shares[n] = 0.0
                shares[n, first], shares[n, second] = 1.0 - share, share
    return shares
