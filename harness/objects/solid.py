"""Closed triangle surfaces made from rings of points, and their union."""

import operator
from collections.abc import Callable
from functools import reduce
from typing import Literal

import numpy as np
from manifold3d import Manifold
from manifold3d import Mesh as ManifoldMesh

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh, signed_volume

_GOLDEN = 0.6180339887498949

Ring = Callable[[float, FloatArray], FloatArray]
"""(distance from the axis, ``(n,)`` shares of the way round) -> ``(n, 2)`` points, counter-clockwise."""


def circle(radius: float, share: FloatArray) -> FloatArray:
    """``(n, 2)`` points on a circle at ``(n,)`` shares of a full turn."""
    angle = 2.0 * np.pi * share
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def lathe(profile: FloatArray, edge: float, phase: float, ring: Ring = circle) -> Mesh:
    """The closed surface of a profile carried round the z axis.

    Args:
        profile: ``(n, 2)`` (distance from the axis, height), from the axis, out, and back to it.
        edge: longest edge along a ring, in the profile's unit.
        phase: share of a turn by which the vertices are shifted; the shape is the same for all.
        ring: outline at a distance from the axis; a circle by default.

    Returns:
        A watertight mesh, outward.
    """
    rings = [_ring_points(ring, d, z, edge, phase + i * _GOLDEN) for i, (d, z) in enumerate(profile)]
    starts = np.cumsum([0, *(len(points) for points in rings)])
    faces = [_stitched(rings[i], rings[i + 1], starts[i], starts[i + 1]) for i in range(len(rings) - 1)]
    return Mesh(np.vstack(rings), np.vstack(faces))


def tube(centres: FloatArray, halves: FloatArray, edge: float) -> Mesh:
    """A closed elliptic tube whose centre line lies in the plane y = 0.

    Args:
        centres: ``(n, 2)`` (x, z) of the centre line.
        halves: ``(n, 2)`` half axes of the section, in the plane of the line and across it.
        edge: longest edge round a section, in the same unit.

    Returns:
        A watertight mesh with flat ends, outward.
    """
    along = np.gradient(centres, axis=0, edge_order=2)
    along /= np.linalg.norm(along, axis=1)[:, None]
    count = max(12, int(np.ceil(2.0 * np.pi * float(halves.max()) / edge)))
    vertices = []
    for i, (centre, tangent, half) in enumerate(zip(centres, along, halves, strict=True)):
        angle = 2.0 * np.pi * (np.arange(count) + 0.5 * (i % 2)) / count
        inward = np.cos(angle) * half[0]
        vertices.append(
            np.column_stack(
                [centre[0] - tangent[1] * inward, np.sin(angle) * half[1], centre[1] + tangent[0] * inward]
            )
        )
    sides = [_tube_sides(i, count) for i in range(len(centres) - 1)]
    last = count * (len(centres) - 1)
    hub = count * len(centres)
    around, following = np.arange(count), np.roll(np.arange(count), -1)
    caps = [
        np.column_stack([np.full(count, hub), following, around]),
        np.column_stack([np.full(count, hub + 1), last + around, last + following]),
    ]
    ends = np.array([[centres[k, 0], 0.0, centres[k, 1]] for k in (0, -1)])
    return outward(Mesh(np.vstack([*vertices, ends]), np.vstack([*sides, *caps])))


def outward(mesh: Mesh) -> Mesh:
    """A closed mesh with its faces turned so that its volume is positive."""
    return mesh if signed_volume(mesh) > 0.0 else Mesh(mesh.vertices, mesh.faces[:, ::-1])


def union(meshes: list[Mesh], smallest: float = 5e-3) -> Mesh:
    """The closed surface of overlapping closed meshes joined into one.

    Args:
        meshes: closed and outward.
        smallest: in their unit; edges left by the cut are collapsed where that moves the
            surface less than this.
    """
    return from_manifold(reduce(operator.add, [to_manifold(mesh) for mesh in meshes]).simplify(smallest))


def to_manifold(mesh: Mesh) -> Manifold:
    """The same surface for Boolean operations.

    Raises:
        ValueError: the mesh is not closed.
    """
    solid = Manifold(
        ManifoldMesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)),
    )
    if solid.is_empty():
        raise ValueError(f"a solid of {len(mesh.faces)} faces is not closed: {solid.status()}")
    return solid


def from_manifold(solid: Manifold) -> Mesh:
    """A mesh, in whatever unit the solid had."""
    raw = solid.to_mesh()
    return Mesh(
        np.asarray(raw.vert_properties)[:, :3].astype(np.float64), np.asarray(raw.tri_verts, np.int64)
    )


def _ring_points(ring: Ring, distance: float, height: float, edge: float, phase: float) -> FloatArray:
    if distance < 1e-9:
        return np.array([[0.0, 0.0, height]])
    perimeter = ring(distance, np.linspace(0.0, 1.0, 65))
    length = float(np.linalg.norm(np.diff(perimeter, axis=0), axis=1).sum())
    count = max(6, int(np.ceil(length / edge)))
    share = (np.arange(count) + phase % 1.0) / count
    return np.column_stack([ring(distance, share), np.full(count, height)])


def _stitched(lower: FloatArray, upper: FloatArray, lower_start: int, upper_start: int) -> IntArray:
    """Faces between two rings, each edge joined to the vertex opposite its middle."""
    lower_order, lower_middles = _around(lower)
    upper_order, upper_middles = _around(upper)
    faces = []
    if len(lower) > 1:
        facing = _current(upper_middles, lower_middles, "left") % len(upper)
        a, b = lower_start + lower_order, lower_start + np.roll(lower_order, -1)
        faces.append(np.column_stack([a, b, upper_start + upper_order[facing]]))
    if len(upper) > 1:
        facing = _current(lower_middles, upper_middles, "right") % len(lower)
        a, b = upper_start + upper_order, upper_start + np.roll(upper_order, -1)
        faces.append(np.column_stack([lower_start + lower_order[facing], b, a]))
    return np.vstack(faces)


def _around(points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Vertices by rising angle, and the angle halfway from each to the next (within one turn)."""
    angle = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2.0 * np.pi)
    order = np.argsort(angle)
    following = np.roll(angle[order], -1)
    following[-1] += 2.0 * np.pi
    return order, 0.5 * (angle[order] + following)


def _current(middles: FloatArray, at: FloatArray, side: Literal["left", "right"]) -> IntArray:
    """How many of the rising ``middles`` a walk round the axis has passed at each angle ``at``."""
    if len(middles) == 1:
        return np.zeros(len(at), dtype=np.int64)
    first = middles[0]
    passed: IntArray = np.searchsorted(middles, first + np.mod(at - first, 2.0 * np.pi), side)
    return passed


def _tube_sides(section: int, count: int) -> IntArray:
    """Faces between one section of a tube and the next, which is turned by half a vertex."""
    here = np.arange(count)
    before, after = (here - 1) % count, (here + 1) % count
    a, b = section * count, (section + 1) * count
    if section % 2 == 0:
        up, down = (a + here, a + after, b + here), (a + here, b + here, b + before)
    else:
        up, down = (a + here, b + after, b + here), (a + here, a + after, b + after)
    return np.vstack([np.column_stack(up), np.column_stack(down)])
