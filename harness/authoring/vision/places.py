"""Places of a surface, and directions, drawn at random."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh


def surface_places(mesh: Mesh, count: int, random: np.random.Generator) -> tuple[IntArray, FloatArray]:
    """``(n,)`` faces and ``(n, 2)`` weights of their second and third corners, uniform over the area."""
    share = np.cumsum(mesh.face_areas)
    faces = np.searchsorted(share, random.random(count) * share[-1], side="right")
    weights = random.random((count, 2))
    # The far half of the square of weights, folded onto the triangle.
    folded = np.where(weights.sum(axis=1, keepdims=True) > 1.0, 1.0 - weights, weights)
    return np.minimum(faces, len(share) - 1).astype(np.int64), folded


def sphere(count: int, random: np.random.Generator) -> FloatArray:
    """``(n, 3)`` unit, uniform."""
    drawn = random.standard_normal((count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def uniform_about(normals: FloatArray, random: np.random.Generator) -> FloatArray:
    """``(n, 3)`` unit, uniform over the half-sphere about each unit normal."""
    drawn = sphere(len(normals), random)
    away = np.sign(np.einsum("nx,nx->n", drawn, normals))
    return np.asarray(drawn * np.where(away < 0.0, -1.0, 1.0)[:, None])
