"""Whether a surface is near a point, and where on a face a place is, in machine code."""

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.nearest_kernels import nearest_on_triangle


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
            for axis in range(3):
                first = np.floor((points[n, axis] - reach - origin[axis]) / cell)
                last = np.floor((points[n, axis] + reach - origin[axis]) / cell)
                low[axis] = int(min(max(first, 0.0), shape[axis] - 1.0))
                high[axis] = int(min(max(last, 0.0), shape[axis] - 1.0))
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
