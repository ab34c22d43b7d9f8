"""A mesh prepared for rays: which face is met, where on it, and what is in the light's way."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.faces.face_grid import build_face_grid
from harness.basics.faces.ray_kernels import Grid, first_hits, free_rays
from harness.basics.faces.ray_triangle import triangles_of
from harness.basics.mesh import Mesh

LEAST = 1e-7
"""Shares of the object's size: a blocker nearer than this to where a ray begins is that place itself."""


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays met first."""

    distance: FloatArray  #: ``(n,)`` m along the ray; +inf where nothing was met.
    face: IntArray  #: ``(n,)`` index; -1 where nothing was met.
    weights: FloatArray  #: ``(n, 2)`` of the face's second and third corner, 0 to 1.


class RayMesh:
    """A mesh prepared once for any number of rays; read-only and safe to share by threads.

    Faces stop rays from both sides.
    """

    mesh: Mesh  #: in metres, in the object's frame.
    least: float  #: m, how far from where a ray begins a blocker is one.

    def __init__(self, mesh: Mesh) -> None:
        """Sort the faces.

        Raises:
            MeshRefused: no face, or a corner that is not finite.
        """
        grid = build_face_grid(mesh)
        self.mesh = mesh
        self.least = LEAST * mesh.diagonal
        self._grid: Grid = (grid.origin, grid.cell, grid.shape, grid.starts, grid.faces)
        self._triangles = read_only(triangles_of(mesh.corners))

    def first_hits(self, origins: FloatArray, directions: FloatArray) -> Hits:
        """What rays meet first.

        Args:
            origins: ``(n, 3)`` m in the object's frame; or ``(3,)`` where all begin.
            directions: ``(n, 3)`` of any length but zero.

        Raises:
            OutOfDomain: a ray that is not finite, or has no direction.
        """
        unit = _unit(directions)
        starts = _finite(np.atleast_2d(origins), "where a ray begins")
        _require_match(len(starts), len(unit))
        count = len(unit)
        distance, face = np.empty(count), np.empty(count, np.int64)
        weights = np.empty((count, 2))
        first_hits(starts, unit, self._triangles, self._grid, distance, face, weights)
        # Rays on an edge are met by faces a little wider than they are.
        return Hits(distance, face, np.clip(weights, 0.0, 1.0))

    def free(self, origins: FloatArray, directions: FloatArray, from_faces: IntArray) -> BoolArray:
        """Whether the way is free: a light there is seen from here.

        Args:
            origins: ``(n, 3)`` m in the object's frame.
            directions: ``(n, 3)``, or ``(3,)`` for all, of any length but zero.
            from_faces: ``(n,)`` the face that each begins on, which does not stop it; -1 for none.

        Returns:
            ``(n,)``: nothing is met farther than ``least``.

        Raises:
            OutOfDomain: a ray that is not finite, or has no direction.
        """
        unit = _unit(np.atleast_2d(directions))
        starts = _finite(np.atleast_2d(origins), "where a ray begins")
        _require_match(len(unit), len(starts))
        if len(from_faces) != len(starts):
            raise OutOfDomain(
                f"{len(starts)} rays and {len(from_faces)} faces that they begin on; give one each"
            )
        return free_rays(starts, unit, from_faces, self.least, self._triangles, self._grid)


def _unit(directions: FloatArray) -> FloatArray:
    given = _finite(directions, "a ray's direction")
    # By the largest first: squares of very short and very long ones are no numbers.
    most = np.max(np.abs(given), axis=1, initial=0.0)
    if not np.all(most > 0.0):
        raise OutOfDomain(
            f"ray {int(np.argmin(most))} of {len(given)} has no direction; give one that is not zero"
        )
    scaled = given / most[:, None]
    unit: FloatArray = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return unit


def _finite(rows: FloatArray, what: str) -> FloatArray:
    given = np.ascontiguousarray(rows, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3:
        raise OutOfDomain(f"rays of shape {given.shape} were given; give (n, 3)")
    good = np.all(np.isfinite(given), axis=1)
    if not np.all(good):
        worst = int(np.argmin(good))
        raise OutOfDomain(
            f"{what} is {given[worst].tolist()} (ray {worst} of {len(given)}); give finite numbers"
        )
    return given


def _require_match(few: int, many: int) -> None:
    if few not in (1, many):
        raise OutOfDomain(f"{few} and {many} ends of rays were given; give as many of both, or one for all")
