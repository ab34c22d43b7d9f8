"""Which point of a surface a press touched: the definition, for one exact pose."""

import numpy as np

from harness.arrays import FloatArray
from harness.mesh import Mesh
from harness.sim.compiled import compiled


def contact_point(mesh: Mesh, gel_in_object: FloatArray, axis_in_object: FloatArray) -> FloatArray:
    """The ``(3,)`` point first met by the line through the gel's centre along the tool.

    Where the line misses the object, the surface point nearest to the gel's centre.

    Args:
        mesh: in metres.
        gel_in_object: ``(3,)`` metres, the gel's centre.
        axis_in_object: ``(3,)`` unit, towards the object.
    """
    distance = _first_hit(mesh.corners, gel_in_object, axis_in_object)
    if np.isfinite(distance):
        return np.asarray(gel_in_object + distance * axis_in_object)
    return nearest_point(mesh, gel_in_object)


def nearest_point(mesh: Mesh, point: FloatArray) -> FloatArray:
    """The ``(3,)`` point of the surface nearest to a ``(3,)`` point."""
    return np.asarray(_nearest(mesh.corners, np.ascontiguousarray(point)))


@compiled
def _first_hit(corners: FloatArray, origin: FloatArray, axis: FloatArray) -> float:
    """Möller and Trumbore (JGT 2(1), 1997), over the whole line: the tool comes from minus infinity."""
    first = np.inf
    for f in range(len(corners)):
        a = corners[f, 0]
        e1, e2 = corners[f, 1] - a, corners[f, 2] - a
        px = axis[1] * e2[2] - axis[2] * e2[1]
        py = axis[2] * e2[0] - axis[0] * e2[2]
        pz = axis[0] * e2[1] - axis[1] * e2[0]
        det = e1[0] * px + e1[1] * py + e1[2] * pz
        if det == 0.0:
            continue
        s = origin - a
        u = (s[0] * px + s[1] * py + s[2] * pz) / det
        if u < -1e-12 or u > 1.0 + 1e-12:
            continue
        qx = s[1] * e1[2] - s[2] * e1[1]
        qy = s[2] * e1[0] - s[0] * e1[2]
        qz = s[0] * e1[1] - s[1] * e1[0]
        v = (axis[0] * qx + axis[1] * qy + axis[2] * qz) / det
        if v < -1e-12 or u + v > 1.0 + 1e-12:
            continue
        distance = (e2[0] * qx + e2[1] * qy + e2[2] * qz) / det
        first = min(first, distance)
    return float(first)


@compiled
def _nearest(corners: FloatArray, point: FloatArray) -> FloatArray:
    """Ericson, Real-Time Collision Detection, 2005, section 5.1.5."""
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
