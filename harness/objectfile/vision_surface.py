"""What ``osf-v`` networks are told too: whether the light reaches a ray's surface, and its normal."""

import numpy as np

from harness.arrays import AnyArray, FloatArray
from harness.mesh import Mesh
from harness.objectfile.vision_faces import FaceCubes, first_met
from harness.objectfile.vision_lamp import LampGrid
from harness.objectfile.vision_work import Crew, Room
from harness.sim.appearance import plain
from harness.sim.lambert_kernels import faced_places, lit_by
from harness.sim.ray_mesh import LEAST

_EARLY = 0.25
"""Cubes before the known depth from which on a ray is followed: depth is kept as float32."""

_LEAST = 128
"""Rays that another thread is asked to follow: fewer are followed sooner than it wakes."""

_UNKNOWN = np.empty(0, np.int32)


class SurfaceExtras:
    """Visibility and normal at the first place of a mesh that a ray meets.

    Args:
        mesh: in metres.
        count: of further inputs: 4, or 0 for networks that are told nothing more.
        crew: shares the rays.
        room: that arrays are taken from.
    """

    def __init__(self, mesh: Mesh, count: int, crew: Crew, room: Room) -> None:
        self._count, self._crew, self._room = count, crew, room
        self._grid: LampGrid | None = None
        if count:
            self._cubes, self._appearance = FaceCubes.of(mesh), plain(mesh, (1.0, 1.0, 1.0))

    def __call__(
        self,
        eye: FloatArray,
        ways: FloatArray,
        light: FloatArray,
        depth: FloatArray,
        likely: AnyArray = _UNKNOWN,
    ) -> AnyArray:
        """``(n, 4)`` float32: 1 where the light is seen, else 0; unit normal on the side that is seen.

        All are 0 for a ray that meets nothing.

        Args:
            eye: ``(3,)`` m, where rays begin.
            ways: ``(n, 3)`` unit.
            light: ``(3,)`` unit, towards the lamp.
            depth: ``(n,)`` m along each ray where the mesh is; infinite where that is not known.
            likely: ``(n,)`` int32 faces that an outline knows them to meet; or ``(0,)``.
        """
        told = np.empty((len(ways), self._count), np.float32)
        if not told.size:
            return told
        begin = np.where(np.isfinite(depth), np.maximum(depth - _EARLY * self._cubes.edge, 0.0), 0.0)
        arrays = [self._room.take(f"extras {k}", (len(ways), 3), np.float64) for k in range(4)]
        weights = self._room.take("extras weights", (len(ways), 2), np.float64)
        faces = self._room.take("extras faces", (len(ways),), np.int64)
        lamp = np.array(light, np.float64)
        grid = self._under(lamp)

        def work(first: int, last: int) -> None:
            part = slice(first, last)
            places = [each[part] for each in arrays]
            first_met(
                eye, ways[part], begin[part], likely[part], self._cubes.lists, faces[part], weights[part]
            )
            self._tell(ways[part], lamp, grid, faces[part], weights[part], places, told[part])

        self._crew.share(work, len(ways), 4 * self._crew.threads, _LEAST)
        return told

    def _under(self, lamp: FloatArray) -> LampGrid:
        """The faces as a lamp sees them, again if it has moved."""
        if self._grid is None or not np.array_equal(self._grid.turn[:, 2], lamp):
            self._grid = LampGrid.of(self._appearance.mesh, lamp)
        return self._grid

    def _tell(
        self,
        ways: FloatArray,
        lamp: FloatArray,
        grid: LampGrid,
        faces: AnyArray,
        weights: FloatArray,
        places: list[FloatArray],
        told: AnyArray,
    ) -> None:
        """Fill in what is told of the places that rays met; ``places`` is room for them."""
        mesh, (points, normals, flat, lifted) = self._appearance.mesh, places
        # Of a ray that meets nothing the last face is looked at, and nothing of it is told.
        faced_places(
            *(faces, weights, ways, mesh.corners, mesh.face_normals, self._appearance.normals),
            *(points, normals, flat, lifted),
        )
        faced = lit_by(lamp[None], points, normals, flat, lifted, mesh.diagonal)
        seen = np.empty(len(ways), np.bool_)
        grid.sees(lifted, LEAST * mesh.diagonal, faces, faced, seen)
        told[:, 0], told[:, 1:] = seen, normals
        told[faces < 0] = 0.0
