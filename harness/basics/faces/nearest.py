"""The point of a mesh's surface that is nearest to a place, and what a place on a face is made of."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled
from harness.basics.mesh import Mesh


def nearest_point(mesh: Mesh, point: FloatArray) -> FloatArray:
    """The ``(3,)`` point of the surface nearest to a ``(3,)`` point."""
    return np.asarray(_nearest(mesh.corners, np.ascontiguousarray(point)))


def plane_shares(corners: FloatArray, place: FloatArray) -> FloatArray:
    """``(3,)`` how much of each of ``(3, 3)`` corners a place in a triangle's plane is made of."""
    edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    second, third = np.linalg.lstsq(edges, place - corners[0], rcond=None)[0]
    return np.array([1.0 - second - third, second, third])


@compiled
def _nearest(corners: FloatArray, point: FloatArray) -> FloatArray:
    """Ericson, Real-Time Collision Detection, 2005, section 5.1.5.

    Not by ``nearest_on_triangle``, a rounding away from it: estimates are written with this one.
    """
    best: FloatArray = corners[0, 0].copy()
    best_gap = np.inf
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        ab, ac, ap = b - a, c - a, point - a
        d1, d2 = np.dot(ab, ap), np.dot(ac, ap)
        bp, cp = point - b, point - c
        d3, d4 = np.dot(ab, bp), np.dot(ac, bp)
        d5, d6 = np.dot(ab, cp), np.dot(ac, cp)
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if d1 <= 0.0 and d2 <= 0.0:
            close = a.copy()
        elif d3 >= 0.0 and d4 <= d3:
            close = b.copy()
        elif d6 >= 0.0 and d5 <= d6:
            close = c.copy()
        elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            close = a + ab * (d1 / (d1 - d3))
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            close = a + ac * (d2 / (d2 - d6))
        elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            close = b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
        else:
            scale = va + vb + vc
            close = a + ab * (vb / scale) + ac * (vc / scale)
        gap = np.sum((close - point) ** 2)
        if gap < best_gap:
            best, best_gap = close, gap
    return best
