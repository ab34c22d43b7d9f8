"""Surfaces whose picture is known in closed form."""

import numpy as np
import trimesh

from harness.basics.mesh import Mesh


def ball(radius: float, subdivisions: int = 4) -> Mesh:
    """A ball about the origin, of ``20 * 4**subdivisions`` faces with corners on the sphere."""
    made = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces))


def square(side: float, z: float = 0.0) -> Mesh:
    """Two faces about the z axis that face up."""
    h = 0.5 * side
    vertices = np.array([[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]))


def cuboid(x: float, y: float, z: float) -> Mesh:
    """A box about the origin, of twelve faces."""
    made = trimesh.creation.box((x, y, z))
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces))


def together(*meshes: Mesh) -> Mesh:
    """Some surfaces as one."""
    before = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.vstack([mesh.vertices for mesh in meshes]),
        np.vstack([mesh.faces + first for mesh, first in zip(meshes, before[:-1], strict=True)]),
    )
