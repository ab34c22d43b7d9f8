"""Flat plates with rounded edges, cut to an outline."""

import numpy as np
from manifold3d import CrossSection, triangulate

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.objects.outline import walked
from harness.objects.solid import outward

_STEPS_ROUND = 4


def slab(area: CrossSection, thickness: float, rounding: float, edge: float) -> Mesh:
    """A plate with the outline of ``area``, centred on z = 0.

    Args:
        area: outline, with holes; its convex corners have a radius above ``rounding``.
        thickness: mm.
        rounding: mm, radius of the edges between faces and sides.
        edge: mm between vertices along the outline.

    Returns:
        A watertight mesh, outward; its two flat faces have no vertices inside.
    """
    insets, heights = _section(thickness, rounding, edge)
    loops = [walked(np.asarray(contour), edge, closed=True) for contour in area.to_polygons()]
    normals = [_outward_normals(loop) for loop in loops]
    sizes = [len(loop) for loop in loops]
    total = sum(sizes)
    layers = [
        np.column_stack([np.vstack(loops) - inset * np.vstack(normals), np.full(total, height)])
        for inset, height in zip(insets, heights, strict=True)
    ]
    cap = _cap([layers[0][start : start + size, :2] for start, size in _runs(sizes)])
    sides = [
        _strip(start + k * total, size, total) for start, size in _runs(sizes) for k in range(len(layers) - 1)
    ]
    faces = np.vstack([cap[:, ::-1], cap + total * (len(layers) - 1), *sides])
    return outward(Mesh(np.vstack(layers), faces))


def _section(thickness: float, rounding: float, edge: float) -> tuple[FloatArray, FloatArray]:
    """Inset from the outline and height of every layer of vertices, bottom to top."""
    angle = np.linspace(0.0, 0.5 * np.pi, _STEPS_ROUND + 1)
    inset = rounding * (1.0 - np.sin(angle))
    height = -0.5 * thickness + rounding * (1.0 - np.cos(angle))
    straight = np.linspace(height[-1], -height[-1], max(2, int(np.ceil(2.0 * -height[-1] / edge)) + 1))
    insets = np.concatenate([inset, np.zeros(len(straight) - 2), inset[::-1]])
    return insets, np.concatenate([height[:-1], straight, -height[:-1][::-1]])


def _outward_normals(loop: FloatArray) -> FloatArray:
    """Unit normals to the right of a closed line: away from the material of outlines and holes alike."""
    tangent = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return np.column_stack([tangent[:, 1], -tangent[:, 0]])


def _runs(sizes: list[int]) -> list[tuple[int, int]]:
    return list(zip(np.cumsum([0, *sizes[:-1]]).tolist(), sizes, strict=True))


def _cap(loops: list[FloatArray]) -> IntArray:
    return np.asarray(triangulate(loops), dtype=np.int64)


def _strip(start: int, size: int, stride: int) -> IntArray:
    """Faces between a loop of one layer and the same loop of the next."""
    here = start + np.arange(size)
    following = start + np.roll(np.arange(size), -1)
    return np.vstack(
        [
            np.column_stack([here, following, following + stride]),
            np.column_stack([here, following + stride, here + stride]),
        ]
    )
