"""Where the nearest place of a surface is, and how far."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.faces.face_clusters import FaceGrid, build_face_grid
from harness.basics.faces.nearest_kernels import near_surface, nearest_places, shares_on_faces
from harness.basics.mesh import Mesh

_OWN = 1e-3
"""Of the diagonal, by which a place that a part was made at may be off the object's surface."""


@dataclass(frozen=True, eq=False)
class SurfaceSearch:
    """A surface, sorted for searching on first use."""

    mesh: Mesh

    def within(self, points: FloatArray, reach: float) -> tuple[FloatArray, IntArray]:
        """``(n, 3)`` nearest places closer than ``reach`` m, and their faces; -1 where there is none."""
        grid, mesh = self._grid, self.mesh
        nowhere, reaches = np.zeros_like(points), np.full(len(points), reach)
        normals = mesh.face_normals
        lists = (grid.origin, grid.cell, grid.shape, grid.starts, grid.faces)
        return nearest_places(points, nowhere, -1.0, reaches, mesh.corners, normals, *lists)

    def nearest(self, points: FloatArray, first: float) -> tuple[FloatArray, IntArray]:
        """``(n, 3)`` nearest places and their faces, however far; ``first`` m is where they may well be."""
        places, faces = self.within(points, first)
        reach = first
        while (missed := np.nonzero(faces < 0)[0]).size:
            reach *= 4.0
            places[missed], faces[missed] = self.within(points[missed], reach)
        return places, faces

    def shares(self, places: FloatArray, faces: IntArray) -> FloatArray:
        """``(n, 3)`` of each corner of the faces at places on them."""
        return shares_on_faces(places, self.mesh.corners, faces)

    def require_within(self, points: FloatArray, most: float, what: str) -> None:
        """Refuse points that are farther than ``most`` m.

        Raises:
            OutOfDomain: it names the farthest one, its distance and the limit.
        """
        # A point at the very limit counts as within it.
        grid, limit = self._grid, most * (1.0 + 1e-9)
        lists = (grid.origin, grid.cell, grid.shape, grid.starts, grid.faces)
        out = np.nonzero(~near_surface(points, limit, self.mesh.corners, *lists))[0]
        if out.size:
            places = self.nearest(points[out], most)[0]
            gaps = np.linalg.norm(places - points[out], axis=1)
            worst = int(np.argmax(gaps))
            x, y, z = points[out[worst]]
            raise OutOfDomain(
                f"{what}: {out.size} of {len(points)} points are off the surface, the farthest, "
                f"({x:.4f}, {y:.4f}, {z:.4f}) m, by {gaps[worst] * 1e3:.3g} mm; the limit is "
                f"{most * 1e3:.3g} mm. Are they in metres and in the mesh's frame? Else move them "
                "onto the surface"
            )

    def spread(self, count: int, seed: int = 0) -> tuple[FloatArray, FloatArray]:
        """``(count, 3)`` random places, uniform over the surface, and the unit normals there."""
        random = np.random.default_rng(seed)
        areas = self.mesh.face_areas
        picked = random.choice(len(areas), count, p=areas / areas.sum())
        shares = random.dirichlet(np.ones(3), count)
        places: FloatArray = np.einsum("nc,ncd->nd", shares, self.mesh.corners[picked])
        return places, self.mesh.face_normals[picked]

    @cached_property
    def _grid(self) -> FaceGrid:
        return build_face_grid(self.mesh)


def require_own(surface: SurfaceSearch, points: FloatArray, name: str) -> None:
    """Refuse a part of an ObjectFile that was made at places of another object.

    Args:
        surface: of the object.
        points: ``(n, 3)`` m, places of the surface that the part was made at.
        name: of the part's file.

    Raises:
        DataRefused: one of them is off the surface; how far the farthest is.
    """
    most = _OWN * surface.mesh.diagonal
    _, faces = surface.within(points, most)
    off = points[faces < 0]
    if len(off):
        places, _ = surface.nearest(off, most)
        far = float(np.linalg.norm(places - off, axis=1).max())
        raise DataRefused(
            f"{name} is of another object: {len(off)} of the {len(points)} places that it was made at are "
            f"off this surface, by {far * 1e3:.3g} mm at most, where {most * 1e3:.3g} mm is the limit; build "
            "the object again"
        )


def checked_points(points: AnyArray) -> FloatArray:
    """``(n, 3)`` finite numbers as a float64 array.

    Raises:
        WrongUse: they are not that.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise WrongUse(f"points of shape {points.shape} must be (n, 3) finite numbers in metres")
    return points
