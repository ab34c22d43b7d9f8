"""Known meshes to choose from: a folder of mesh files, of ObjectFiles, or both."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objects.builtin import DESCRIPTION
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import read_mesh
from harness.sim.solid.mesh_repair import is_watertight
from harness.sim.solid.surface_samples import random_points

SAMPLES = 3000
"""Of each shape's surface, by which it is placed roughly."""

SUFFIXES = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf", ".3mf", ".msh")


@dataclass(frozen=True, eq=False)
class LibraryShape:
    """A mesh of no size: one long, upright, the middle of its box above the origin, its foot on z = 0."""

    name: str  #: of the file or the folder that it is of.
    mesh: Mesh  #: watertight.

    @cached_property
    def samples(self) -> tuple[cKDTree, FloatArray, FloatArray]:
        """Places all over it as a tree and as ``(SAMPLES, 3)``, and the normals there."""
        points, faces = random_points(self.mesh, SAMPLES, np.random.default_rng(0))
        return cKDTree(points), points, self.mesh.face_normals[faces]

    @cached_property
    def outside(self) -> float:
        """Area of its convex hull over the square of its longest side: of what touches come to, about."""
        return float(ConvexHull(self.mesh.vertices).area)

    @cached_property
    def search(self) -> NearestSurface:
        """For the exact nearest places."""
        return NearestSurface(self.mesh)

    @classmethod
    def of(cls, name: str, mesh: Mesh) -> "LibraryShape":
        """Of any watertight mesh, whose z is up.

        Raises:
            MeshRefused: it is open, and an open surface has no inside to answer with.
        """
        if not is_watertight(mesh.faces):
            raise MeshRefused(f"{name} is not closed; repair it, or leave it out of the library")
        low, high = mesh.bounds
        middle = np.array([*(0.5 * (low + high))[:2], low[2]])
        return cls(name, Mesh((mesh.vertices - middle) / float((high - low).max()), mesh.faces))


def library_of(folder: Path) -> tuple[list[LibraryShape], list[str]]:
    """All shapes of a folder in the order of their names, and why others in it were left out.

    Raises:
        WrongUse: no such folder, or no shape in it that can be used.
    """
    if not folder.is_dir():
        raise WrongUse(f"there is no folder {folder}; name one that holds meshes or ObjectFiles")
    shapes, left_out = [], []
    for path in sorted(folder.iterdir()):
        try:
            mesh = _mesh_in(path)
            if mesh is not None:
                shapes.append(LibraryShape.of(path.name, mesh))
        except MeshRefused as refused:
            left_out.append(str(refused))
    if not shapes:
        raise WrongUse(
            f"{folder} holds no closed mesh that can be read ({len(left_out)} were left out: "
            f"{'; '.join(left_out[:3]) or 'none'}); put meshes ({', '.join(SUFFIXES)}) or ObjectFiles there"
        )
    return shapes, left_out


def _mesh_in(path: Path) -> Mesh | None:
    if (path / DESCRIPTION).is_file():
        return ObjectFile.open(path).mesh
    if path.suffix.lower() not in SUFFIXES:
        return None
    # A metre long, whatever its unit: the size is what readings say.
    raw = read_mesh(path)
    longest = float(np.ptp(_finite(raw.vertices, path.name), axis=0).max())
    if not longest > 0.0:
        raise MeshRefused(f"{path.name} has all its vertices in one place; export it again")
    return take_in(path, "m", 1.0 / longest).mesh


def _finite(vertices: FloatArray, name: str) -> FloatArray:
    if not np.isfinite(vertices).all():
        raise MeshRefused(f"{name} has vertices that are not finite numbers; export it again")
    return vertices
