"""One ray and one triangle: the kernel of all that asks what a ray meets.

Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, J. Graphics Tools 2(1), 1997. Whoever
changes the order of its sums changes pictures and walls in their last bits.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled

Meeting = tuple[float, float, float]
"""Distance along the ray, and the weights of the triangle's second and third corner."""

ON_EDGE = 1e-9
"""Share of a triangle by which it is widened, so that no ray falls between two that share an edge."""


@compiled
def meeting(o: FloatArray, d: FloatArray, p: FloatArray, wider: float) -> Meeting:
    """Where the line of a ray meets a triangle, from either side and in either direction.

    Args:
        o: ``(3,)`` m, where the ray begins.
        d: ``(3,)`` its direction, of which the distance is counted in lengths.
        p: ``(3, 3)`` m: first corner, and the ways from it to the second and third.
        wider: share of the triangle by which it is widened.

    Returns:
        The distance NaN where it passes by, or runs within the triangle's plane; NaN is neither near nor far.
    """
    px = d[1] * p[2, 2] - d[2] * p[2, 1]
    py = d[2] * p[2, 0] - d[0] * p[2, 2]
    pz = d[0] * p[2, 1] - d[1] * p[2, 0]
    volume = p[1, 0] * px + p[1, 1] * py + p[1, 2] * pz
    if volume == 0.0:
        return np.nan, 0.0, 0.0
    sx, sy, sz = o[0] - p[0, 0], o[1] - p[0, 1], o[2] - p[0, 2]
    u = (sx * px + sy * py + sz * pz) / volume
    # Written so that a NaN of a face seen edge-on is no hit.
    if not (-wider <= u <= 1.0 + wider):
        return np.nan, 0.0, 0.0
    qx = sy * p[1, 2] - sz * p[1, 1]
    qy = sz * p[1, 0] - sx * p[1, 2]
    qz = sx * p[1, 1] - sy * p[1, 0]
    v = (d[0] * qx + d[1] * qy + d[2] * qz) / volume
    if not (v >= -wider and u + v <= 1.0 + wider):
        return np.nan, 0.0, 0.0
    return (p[2, 0] * qx + p[2, 1] * qy + p[2, 2] * qz) / volume, u, v


def triangles_of(corners: FloatArray) -> FloatArray:
    """``(m, 3, 3)`` corners as ``meeting`` takes them: the first, and the ways from it to the others."""
    return np.stack([corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
