"""What ``osf-v`` networks are told too: whether the light reaches a ray's surface, and its normal."""

import numpy as np

from harness.arrays import AnyArray, FloatArray
from harness.mesh import Mesh
from harness.objectfile.vision_faces import FaceCubes
from harness.objectfile.vision_lamp import LampGrid
from harness.objectfile.vision_told import tell
from harness.objectfile.vision_work import Crew, Room
from harness.sim.appearance import plain
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
        closed: of ``is_closed``.
    """

    def __init__(self, mesh: Mesh, count: int, crew: Crew, room: Room, closed: bool = False) -> None:
        self._count, self._crew, self._room, self._closed = count, crew, room, closed
        self._grid: LampGrid | None = None
        self._from_outside = False
        if count:
            self._cubes, self._mesh = FaceCubes.of(mesh), mesh
            self._surface = (mesh.corners, mesh.face_normals, plain(mesh, (1.0, 1.0, 1.0)).normals)

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
        lamp, size, count = np.array(light, np.float64), self._mesh.diagonal, len(ways)
        low, high = self._mesh.bounds
        grid = self._under(lamp, self._closed and bool(((eye < low) | (eye > high)).any()))
        faces, faced = (self._room.take(f"told {kind}", (count,), kind) for kind in ("int64", "float64"))
        lifted = self._room.take("lifted", (count, 3), np.float64)

        def work(first: int, last: int) -> None:
            at, seen = slice(first, last), np.empty(last - first, np.bool_)
            tell(
                *(eye, ways[at], begin[at], likely[at], self._cubes.lists, self._surface, lamp, size),
                *(faces[at], lifted[at], faced[at], told[at]),
            )
            grid.sees(lifted[at], LEAST * size, faces[at], faced[at], seen)
            told[at, 0] = seen

        self._crew.share(work, count, 4 * self._crew.threads, _LEAST)
        return told

    def _under(self, lamp: FloatArray, from_outside: bool) -> LampGrid:
        """The faces as a lamp sees them, again if it has moved, or the eye from outside of the mesh into it.

        What is seen from outside of a closed surface is seen on its outside.
        """
        same = self._grid is not None and np.array_equal(self._grid.turn[:, 2], lamp)
        if self._grid is None or not same or from_outside != self._from_outside:
            self._grid = LampGrid.of(self._mesh, lamp, from_outside=from_outside)
            self._from_outside = from_outside
        return self._grid
