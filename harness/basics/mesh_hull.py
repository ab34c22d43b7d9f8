"""The convex hull of points as a closed mesh."""

import numpy as np
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh


def closed_hull(points: FloatArray) -> Mesh:
    """The convex hull of ``(n, 3)`` points, its faces looking outward."""
    hull = ConvexHull(points)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    faces = faces.reshape(hull.simplices.shape)
    corners = points[used][faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.einsum("ij,ij->i", outward, hull.equations[:, :3]) < 0.0
    faces[inside] = faces[inside][:, ::-1]
    return Mesh(points[used], faces)
