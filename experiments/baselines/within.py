"""Which places a closed surface encloses."""

import numpy as np

from harness.authoring.vision.places import sphere
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.faces.ray_mesh import RayMesh


def is_within(
    rays: RayMesh, points: FloatArray, face_normals: FloatArray, random: np.random.Generator
) -> BoolArray:
    """``(n,)``: whether a ray from each ``(n, 3)`` place leaves the surface where it first meets it.

    Args:
        rays: of a closed surface.
        points: m.
        face_normals: ``(f, 3)`` outward, of the surface.
        random: draws a direction for each place.
    """
    directions = sphere(len(points), random)
    hits = rays.first_hits(points, directions)
    found = np.zeros(len(points), np.bool_)
    met = np.flatnonzero(hits.face >= 0)
    found[met] = np.einsum("nx,nx->n", face_normals[hits.face[met]], directions[met]) > 0.0
    return found
