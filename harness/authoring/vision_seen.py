"""What the rays of a picture asked a network, kept, so that the network may learn from the picture itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.arrays import AnyArray, FloatArray
from harness.authoring.vision_teacher_pictures import Answers, TeacherAsker, TeacherRenderer
from harness.linear_image import LinearImage
from harness.mesh import Mesh
from harness.objectfile.vision_network import Kind, VisionGrid
from harness.objectfile.vision_outline import Outline
from harness.objectfile.vision_samples import Asker, Samples, Scene
from harness.objectfile.vision_settings import RenderSettings, VisionLevel
from harness.pinhole import DirectionalLight, Pinhole


@dataclass(frozen=True, eq=False)
class SeenRays:
    """Rays of pictures, one a pixel that shows the object, and their samples from near to far.

    Attributes:
        points: ``(s, 3)`` m, of samples, object frame.
        lengths: ``(s,)`` float32 m that each stands for.
        first: ``(r + 1,)`` where each ray's samples begin, and the last one's end.
        views: ``(r, 3)`` float32 unit, from the camera.
        lights: ``(r, 3)`` float32 unit, towards the lamp.
        extras: ``(r, 4)`` float32 visibility and normal; ``(r, 0)`` of a kind that is not told.
        wanted: ``(r, 3)`` float32 linear light of what the pixel shows of the object, under irradiance pi.
        weight: ``(r,)`` float32, share of the pixel that shows it.
    """

    points: FloatArray
    lengths: AnyArray
    first: AnyArray
    views: AnyArray
    lights: AnyArray
    extras: AnyArray
    wanted: AnyArray
    weight: AnyArray

    def __len__(self) -> int:
        return len(self.views)


def together(parts: Sequence[SeenRays]) -> SeenRays:
    """Those of several pictures; one at least."""
    begin = np.cumsum([0, *(part.first[-1] for part in parts)])
    starts = [part.first[:-1] + at for part, at in zip(parts, begin, strict=False)]
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("points", "lengths", "views", "lights", "extras", "wanted", "weight")
    }
    return SeenRays(first=np.append(np.concatenate(starts), begin[-1]), **joined)


class RayRecorder(TeacherRenderer):
    """Draws as ``TeacherRenderer``, by one thread, and keeps what it asked.

    Args:
        ask: the network.
        mesh: of the object, in metres.
        grid: cells that its lattice has.
        kind: what the network is told.
        density_scale: 1/m of a density of 1.
    """

    def __init__(self, ask: Answers, mesh: Mesh, grid: VisionGrid, kind: Kind, density_scale: float) -> None:
        super().__init__(ask, mesh, grid, kind, density_scale, threads=1)
        self._keeper, self._outlines = _Keeper(self.teacher), list[Outline]()

    def _outline(self, camera: Pinhole, chosen: RenderSettings) -> Outline:
        self._outlines = [super()._outline(camera, chosen)]
        return self._outlines[0]

    def _asker(self, level: VisionLevel) -> Asker:  # noqa: ARG002
        return self._keeper

    def seen(self, camera: Pinhole, light: DirectionalLight, exact: LinearImage) -> SeenRays:
        """The rays of one picture, of pixels that the exact one covers at all.

        Args:
            camera: that looks.
            light: from far away.
            exact: the picture that it should have been.
        """
        self._keeper = _Keeper(self.teacher)
        self.render(camera, light)
        rays, places, points, lengths = self._keeper.kept()
        scene, pixels = self._keeper.scenes[-1], self._outlines[0].pixels
        cover = exact.alpha.reshape(-1)[pixels]
        # A ray without samples asked nothing, and a network can do nothing about it.
        use = np.flatnonzero((cover > 0.0) & (np.bincount(rays, minlength=len(pixels)) > 0))
        order = np.lexsort((places, rays))
        order = order[np.isin(rays[order], use)]
        first = np.concatenate([[0], np.cumsum(np.bincount(rays[order], minlength=len(pixels))[use])])
        colour = exact.colour.reshape(-1, 3)[pixels[use]] * (np.pi / light.irradiance)
        return SeenRays(
            *(points[order], lengths[order], first),
            *(scene.views[use], np.tile(np.float32(scene.light), (len(use), 1))),
            scene.extras[use],
            *((colour / cover[use, None]).astype(np.float32), cover[use].astype(np.float32)),
        )


class _Keeper:
    """As ``vision_samples.Asker``: asks another one, and keeps what was asked."""

    def __init__(self, asker: TeacherAsker) -> None:
        self._asker, self.block, self.scenes = asker, asker.block, list[Scene]()
        self._waves: list[tuple[AnyArray, AnyArray, FloatArray, AnyArray]] = []

    def light(self, light: FloatArray) -> None:
        """As ``Asker``."""
        self._asker.light(light)

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        """As ``Asker``."""
        self._asker(samples, order, blocks, scene)
        self.scenes.append(scene)
        rays, points = samples.rays[order // samples.most], self._asker.points(samples, order)
        self._waves.append((rays.copy(), samples.places[order].copy(), points, samples.lengths[order].copy()))

    def kept(self) -> tuple[AnyArray, ...]:
        """Of all samples: ray, m along it, place and length."""
        return tuple(np.concatenate(each) for each in zip(*self._waves, strict=True))
