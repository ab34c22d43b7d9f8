"""Polygons of a mesh file as triangles, whichever way their corners turn."""

import numpy as np
from manifold3d import triangulate

from harness.basics.arrays import FloatArray, IntArray


def triangulated(vertices: FloatArray, corners: IntArray, lengths: IntArray) -> IntArray:
    """``(m, 3)`` corners of triangles that fill every polygon and turn as it does.

    Args:
        vertices: ``(n, 3)``.
        corners: of all polygons, one after the other.
        lengths: how many corners each has; of fewer than three there is no triangle.

    Raises:
        IndexError: a corner that is no vertex.
    """
    found, starts = [np.zeros((0, 3), dtype=np.int64)], np.cumsum(lengths) - lengths
    for length in np.unique(lengths[lengths >= 3]):
        places = starts[lengths == length][:, None] + np.arange(length)
        found.append(_triangles(vertices, corners[places]))
    return np.concatenate(found)


def _triangles(vertices: FloatArray, polygons: IntArray) -> IntArray:
    """Of ``(p, k)`` polygons: fans where they are convex."""
    corners = polygons.shape[1]
    if corners == 3:
        return polygons
    # Convex: all corners turn the same way, none of them straight on.
    places = vertices[polygons]
    sides = np.roll(places, -1, axis=1) - places
    turns = np.cross(np.roll(sides, 1, axis=1), sides)
    convex = (np.einsum("pkd,pd->pk", turns, _normals(places)) > 0.0).all(axis=1)
    second = np.arange(1, corners - 1)
    fan = np.stack([np.zeros_like(second), second, second + 1], axis=1)
    fans = polygons[convex][:, fan].reshape(-1, 3)
    others = [polygon[_clipped(vertices[polygon], fan)] for polygon in polygons[~convex]]
    return np.concatenate([fans, *others])


def _normals(corners: FloatArray) -> FloatArray:
    """``(p, 3)``: twice the area of each polygon along its normal (Newell)."""
    spokes = corners - corners[:, :1]
    return np.asarray(np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1))


def _clipped(corners: FloatArray, fan: IntArray) -> IntArray:
    """Triangles of one ``(k, 3)`` polygon that is not convex; a fan where it has no plane."""
    normal = _normals(corners[None])[0]
    length = float(np.linalg.norm(normal))
    if not (np.isfinite(length) and length > 0.0):
        return fan
    across = np.linalg.svd(normal[None] / length)[2][1:]
    if np.linalg.det(np.vstack([across, normal / length])) < 0.0:
        across = across[::-1]
    flat = (corners - corners.mean(axis=0)) @ across.T
    return np.asarray(triangulate([flat]), dtype=np.int64).reshape(-1, 3)
