"""The convex hull of points: those that span it, and the hull as a closed mesh."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh


def hull_of(points: FloatArray) -> FloatArray:
    """``(m, d)`` those of ``(n, d)`` points that span their convex hull; all of a flat set."""
    try:
        return points[ConvexHull(points - points[0]).vertices]
    except QhullError:
        return np.unique(points, axis=0)


def closed_hull(points: FloatArray) -> Mesh:
    """The convex hull of ``(n, 3)`` points, its faces looking outward."""
    hull = ConvexHull(points - points[0])
    used, faces = np.unique(hull.simplices, return_inverse=True)
    faces = faces.reshape(hull.simplices.shape)
    corners = points[used][faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.einsum("ij,ij->i", outward, hull.equations[:, :3]) < 0.0
    faces[inside] = faces[inside][:, ::-1]
    return Mesh(points[used], faces)
