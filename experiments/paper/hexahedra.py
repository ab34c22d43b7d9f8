"""Modes of a volume of cubes, as ObjectFolder 1.0 computes them: the object as voxels, eight nodes each.

The trilinear hexahedron with 2 x 2 x 2 Gauss points (Zienkiewicz, Taylor and Zhu, The Finite Element Method,
7th edition, 2013, section 6). All cubes are alike, so that one stiffness and one mass serve them all. Steps
replace slopes and a thin wall is one or two cubes thick: what the paper leaves it for.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree

from harness.authoring.vision.places import sphere
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.materials import Material
from harness.basics.mesh import Mesh


def is_within(
    rays: RayMesh, points: FloatArray, face_normals: FloatArray, random: np.random.Generator
) -> BoolArray:
    """Mark which of ``(n, 3)`` points in m are inside a closed surface, by the first hit of a random ray."""
    directions = sphere(len(points), random)
    hits = rays.first_hits(points, directions)
    found = np.zeros(len(points), np.bool_)
    met = np.flatnonzero(hits.face >= 0)
    found[met] = np.einsum("nx,nx->n", face_normals[hits.face[met]], directions[met]) > 0.0
    return found


CELLS = 40
"""Cubes along the object's longest side; 1.0's grid has 32, between whose middles a thin wall may lie."""

NEAREST = 4
"""Nodes whose motion is averaged at a place, as 1.0 averages the sounds of four voxels."""

_CORNERS = np.array(list(product((0, 1), repeat=3)))
_RIGID = 6
_LEAST = 1.0
"""Hz: slower modes are motions of the whole body."""


@dataclass(frozen=True, eq=False)
class HexahedralModes:
    """Free vibration of cubes."""

    frequencies: FloatArray  #: ``(m,)`` Hz, ascending.
    nodes: FloatArray  #: ``(n, 3)`` m, in the object's frame.
    shapes: FloatArray  #: ``(n, m, 3)`` 1/sqrt(kg), mass-normalised.
    cubes: int  #: number of elements.

    def at(self, point: FloatArray) -> FloatArray:
        """``(m, 3)`` 1/sqrt(kg): mean over the nodes nearest to a ``(3,)`` place in m."""
        _, near = self._tree.query(point, NEAREST)
        found: FloatArray = self.shapes[near].mean(axis=0)
        return found

    @cached_property
    def _tree(self) -> "cKDTree[None]":
        return cKDTree(self.nodes)


def voxel_cubes(mesh: Mesh, cells: int = CELLS) -> tuple[IntArray, FloatArray, float]:
    """Find the cubes whose centres an object encloses.

    Returns:
        ``(c, 3)`` indices of the cubes, ``(3,)`` m corner of index 0, and the side in m.

    Raises:
        MeshRefused: a surface that encloses no cube centre.
    """
    low, high = mesh.bounds
    side = float((high - low).max()) / cells
    counts = np.ceil((high - low) / side - 1e-9).astype(np.int64)
    origin = 0.5 * (low + high) - 0.5 * side * counts
    cubes = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    middles = origin + side * (cubes + 0.5)
    inside = is_within(RayMesh(mesh), middles, mesh.face_normals, np.random.default_rng(0))
    if not inside.any():
        raise MeshRefused("the object holds no cube of a grid; close its surface, or take a finer grid")
    return cubes[inside], origin, side


def hexahedral_modes(
    mesh: Mesh, material: Material, limit: float, most: int, cells: int = CELLS
) -> HexahedralModes:
    """Compute the ``most`` lowest modes up to ``limit`` Hz of an object made of cubes.

    Raises:
        MeshRefused: a surface that encloses no cube, or cubes without a mode below the limit.
    """
    cubes, origin, side = voxel_cubes(mesh, cells)
    corners = cubes[:, None] + _CORNERS
    places, numbers = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    # Unknown ``3 n + axis`` is a node's.
    of_cube = cube_matrices(material, side)
    unknowns = (3 * numbers.reshape(len(cubes), 8)[:, :, None] + np.arange(3)).reshape(len(cubes), 24)
    rows, columns = np.repeat(unknowns, 24, axis=1).ravel(), np.tile(unknowns, (1, 24)).ravel()
    size = 3 * (int(numbers.max()) + 1)
    both = (np.tile(each.ravel(), len(cubes)) for each in of_cube)
    stiffness, mass = (coo_array((values, (rows, columns)), (size, size)).tocsc() for values in both)
    wanted = min(most + _RIGID, stiffness.shape[0] - 2)
    # A shift below zero: the body is free, and its stiffness alone has no inverse.
    shift = -((2.0 * np.pi * 0.02 * limit) ** 2)
    values, vectors = eigsh(stiffness, wanted, mass, sigma=shift)
    frequencies = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    order = np.argsort(frequencies)
    chosen = order[(frequencies[order] > _LEAST) & (frequencies[order] <= limit)]
    if not len(chosen):
        raise MeshRefused(f"cubes of {side * 1e3:.3g} mm have no mode up to {limit:g} Hz; take more of them")
    shapes = vectors[:, chosen].reshape(len(places), 3, -1).transpose(0, 2, 1)
    return HexahedralModes(
        frequencies[chosen], origin + side * places, np.ascontiguousarray(shapes), len(cubes)
    )


def cube_matrices(material: Material, side: float) -> tuple[FloatArray, FloatArray]:
    """Compute ``(24, 24)`` stiffness in N/m and consistent mass in kg of a cube, nodes in binary order."""
    # Hooke's law in Pa.
    poisson = material.poisson
    first = material.young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    shear = 0.5 * material.young / (1.0 + poisson)
    elastic = np.diag([2.0 * shear] * 3 + [shear] * 3)
    elastic[:3, :3] += first
    stiffness, mass = np.zeros((24, 24)), np.zeros((24, 24))
    weight = (0.5 * side) ** 3
    signs = 2.0 * _CORNERS - 1.0
    for at in product((-1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0)), repeat=3):
        # The trilinear functions there, ``(8,)``, and their slopes in a cube of -1 .. 1, ``(8, 3)``.
        parts = 0.5 * (1.0 + signs * np.array(at))
        values, slopes = parts.prod(axis=1), np.empty((8, 3))
        for axis in range(3):
            slopes[:, axis] = 0.5 * signs[:, axis] * np.delete(parts, axis, axis=1).prod(axis=1)
        slopes = slopes * 2.0 / side
        # Strains xx yy zz yz zx xy of the nodes' motion.
        strain = np.zeros((6, 24))
        for row, (one, other) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))):
            strain[row, one::3] += slopes[:, other]
            if one != other:
                strain[row, other::3] += slopes[:, one]
        stiffness += weight * strain.T @ elastic @ strain
        mass += weight * material.density * np.kron(np.outer(values, values), np.eye(3))
    return stiffness, mass
