"""Further inputs of ``osf-v`` networks: whether the light reaches a ray's surface, and its normal."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.faces.ray_mesh import LEAST
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage.faces import FaceCubes
from harness.objectfile.vision.light import LampGrid
from harness.objectfile.vision.surface_inputs import Surface, surface_inputs
from harness.objectfile.vision.threads import Workspace
from harness.sim.light.appearance import plain

_EARLY = 0.25
"""Cubes before the known depth from which on a ray is followed: depth is kept as float32."""


@dataclass(frozen=True, eq=False)
class LitSurface:
    """A mesh under a lamp, as an eye sees it.

    Attributes:
        eye: ``(3,)`` m, where rays begin.
        lamp: ``(3,)`` unit, towards it.
        size: m, of the mesh.
        cubes: of the mesh.
        surface: corners and normals of the mesh.
        grid: of the mesh, across the light.
    """

    eye: FloatArray
    lamp: FloatArray
    size: float
    cubes: FaceCubes
    surface: Surface
    grid: LampGrid

    def surface_inputs(
        self, ways: FloatArray, depth: FloatArray, likely: AnyArray, told: AnyArray, room: Workspace
    ) -> None:
        """Fill in the inputs of some rays: 1 where the light is seen, else 0; the unit normal that is seen.

        All four are 0 for a ray that meets nothing.

        Args:
            ways: ``(n, 3)`` unit.
            depth: ``(n,)`` m along each where the mesh is; infinite where that is not known.
            likely: ``(n,)`` int32 faces that an outline knows them to meet; or ``(0,)``.
            told: ``(n, 4)`` float32, written.
            room: that arrays are taken from.
        """
        count = len(ways)
        begin = np.where(np.isfinite(depth), np.maximum(depth - _EARLY * self.cubes.edge, 0.0), 0.0)
        faces, faced, seen = (
            room.take(f"told {kind}", (count,), kind) for kind in ("int64", "float64", "bool")
        )
        lifted = room.take("lifted", (count, 3), np.float64)
        surface_inputs(
            *(self.eye, ways, begin, likely, self.cubes.lists, self.surface, self.lamp, self.size),
            *(faces, lifted, faced, told),
        )
        self.grid.sees(lifted, LEAST * self.size, faces, faced, seen)
        told[:, 0] = seen


class SurfaceExtras:
    """Visibility and normal at the first place of a mesh that a ray meets.

    Args:
        mesh: in metres.
        count: of further inputs: 4, or 0 for networks with no further inputs.
        closed: of ``is_closed``.
    """

    def __init__(self, mesh: Mesh, count: int, closed: bool = False) -> None:
        self.count, self._closed = count, closed
        self._grid: LampGrid | None = None
        self._from_outside = False
        if count:
            self._cubes, self._mesh = FaceCubes.of(mesh), mesh
            self._surface = (mesh.corners, mesh.face_normals, plain(mesh, (1.0, 1.0, 1.0)).normals)

    def under(self, eye: FloatArray, light: FloatArray) -> LitSurface | None:
        """The mesh under a lamp; None for networks without such inputs.

        Args:
            eye: ``(3,)`` m, where rays will begin.
            light: ``(3,)`` unit, towards the lamp.
        """
        if not self.count:
            return None
        lamp, (low, high) = np.array(light, np.float64), self._mesh.bounds
        grid = self._listed(lamp, self._closed and bool(((eye < low) | (eye > high)).any()))
        return LitSurface(eye, lamp, self._mesh.diagonal, self._cubes, self._surface, grid)

    def _listed(self, lamp: FloatArray, from_outside: bool) -> LampGrid:
        """The faces as a lamp sees them, again if it has moved, or the eye from outside of the mesh into it.

        What is seen from outside of a closed surface is seen on its outside.
        """
        same = self._grid is not None and np.array_equal(self._grid.turn[:, 2], lamp)
        if self._grid is None or not same or from_outside != self._from_outside:
            self._grid = LampGrid.of(self._mesh, lamp, from_outside=from_outside)
            self._from_outside = from_outside
        return self._grid
