"""What ``osf-v`` networks are told too: whether the light reaches a ray's surface, and its normal."""

import numpy as np

from harness.arrays import AnyArray, FloatArray
from harness.mesh import Mesh
from harness.pinhole import DirectionalLight
from harness.sim.appearance import plain
from harness.sim.lambert import irradiance, places_seen, sees_light
from harness.sim.ray_mesh import RayMesh


class SurfaceExtras:
    """Visibility and normal at the first place of a mesh that a ray meets.

    Args:
        mesh: in metres.
        count: of further inputs: 4, or 0 for networks that are told nothing more.
    """

    def __init__(self, mesh: Mesh, count: int) -> None:
        self._count = count
        if count:
            self._rays, self._appearance = RayMesh(mesh), plain(mesh, (1.0, 1.0, 1.0))

    def __call__(self, eye: FloatArray, ways: FloatArray, light: FloatArray) -> AnyArray:
        """``(n, 4)`` float32: 1 where the light is seen, else 0; unit normal on the side that is seen.

        All are 0 for a ray that meets nothing.

        Args:
            eye: ``(3,)`` m, where rays begin.
            ways: ``(n, 3)`` unit.
            light: ``(3,)`` unit, towards the lamp.
        """
        told = np.zeros((len(ways), self._count), np.float32)
        if not told.size:
            return told
        hits = self._rays.first_hits(eye, ways)
        met = np.flatnonzero(hits.face >= 0)
        places = places_seen(self._appearance, hits.face[met], hits.weights[met], ways[met])
        lamp = DirectionalLight(light)
        faced = irradiance(places, lamp, self._appearance.mesh.diagonal) > 0.0
        told[met, 0] = sees_light(self._rays, places, lamp, faced)
        told[met, 1:] = places.normals
        return told
