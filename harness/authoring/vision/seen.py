"""What the rays of a picture asked a network, kept, so that the network may learn from the picture itself."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np

from harness.authoring.training import Report
from harness.authoring.vision.data import HeldOutViews, draw_views
from harness.authoring.vision.finish_profiles import CellsFinish
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.cores import own_cores
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage.outline import Outline
from harness.objectfile.vision.network.network import VisionGrid
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.samples import Asker, Samples, Scene
from harness.objectfile.vision.settings import RenderSettings, VisionLevel
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.direct_image import LitObject

Exact = tuple[Pinhole, DirectionalLight, LinearImage]
"""A camera, its light, and the picture that it should see."""


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
        density: ``(s,)`` float32 that the networks answered, zero or more.
        scattered: ``(s, 3)`` float32 linear colours that they answered.
    """

    points: FloatArray
    lengths: AnyArray
    first: AnyArray
    views: AnyArray
    lights: AnyArray
    extras: AnyArray
    wanted: AnyArray
    weight: AnyArray
    density: AnyArray
    scattered: AnyArray

    def __len__(self) -> int:
        return len(self.views)


def together(parts: Sequence[SeenRays]) -> SeenRays:
    """Those of several pictures; one at least."""
    begin = np.cumsum([0, *(part.first[-1] for part in parts)])
    starts = [part.first[:-1] + at for part, at in zip(parts, begin, strict=False)]
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in (field.name for field in fields(SeenRays) if field.name != "first")
    }
    return SeenRays(first=np.append(np.concatenate(starts), begin[-1]), **joined)


def pictures_to_learn(
    lit: LitObject,
    wanted: CellsFinish,
    seed: int,
    held_out: HeldOutViews,
    report: Report,
    threads: int | None = None,
) -> list[Exact]:
    """Exact pictures, clear of those kept back.

    Args:
        lit: the object.
        wanted: how many, and how fine.
        seed: of their cameras and lights.
        held_out: what nothing is learned from.
        report: told of progress.
        threads: None for as many as the process has cores; pictures are the same for any number.

    Raises:
        OutOfDomain: too few views are clear of those kept back.
    """
    count, side, beside = wanted.pictures, wanted.side, own_cores() if threads is None else threads
    views = draw_views(lit.appearance.mesh, count, side, side, seed, held_out)

    def drawn(view: tuple[Pinhole, DirectionalLight]) -> Exact:
        camera, light = view
        return camera, light, lit.render(camera, [light], wanted.samples).image

    found: list[Exact] = []
    with ThreadPoolExecutor(beside) as pool:
        # No more at once than are drawn beside each other, so that who stops it waits for these alone.
        for begin in range(0, count, beside):
            report(f"drawing picture {begin + 1} of {count} to learn from", begin / count)
            found += pool.map(drawn, views[begin : begin + beside])
    return found


class RayRecorder(VisionRenderer):
    """Draws, and keeps what it asked; of one thread.

    Args:
        data: of ``vision.onnx``.
        mesh: of the object, in metres.
    """

    _keeper: "_Keeper | None" = None
    _drawn: Outline | None = None

    def __init__(self, data: bytes, mesh: Mesh) -> None:
        super().__init__(data, mesh, threads=1)

    def _outline(self, camera: Pinhole, chosen: RenderSettings) -> Outline:
        self._drawn = super()._outline(camera, chosen)
        return self._drawn

    def _asker(self, level: VisionLevel) -> Asker:
        return self._keeper or super()._asker(level)

    def seen(self, camera: Pinhole, light: DirectionalLight, exact: LinearImage) -> SeenRays:
        """The rays of one picture, of pixels that the exact one covers at all.

        Args:
            camera: that looks.
            light: from far away.
            exact: the picture that it should have been.
        """
        keeper = _Keeper(super()._asker("fused"), self.model.grid)
        self._keeper = keeper
        self.render(camera, light)
        self._keeper = None
        assert self._drawn is not None
        if not keeper.scenes:
            return _none_of(self.model.weights.size.extras)
        return _of_pixels(keeper, self._drawn.pixels, light, exact)


class _Keeper:
    """As ``vision_samples.Asker``: asks another one, and keeps what was asked and answered."""

    def __init__(self, asker: Asker, grid: VisionGrid) -> None:
        self._asker, self._grid, self.block = asker, grid, asker.block
        self.scenes = list[Scene]()
        self._waves: list[tuple[AnyArray, ...]] = []

    def light(self, light: FloatArray) -> None:
        """As ``Asker``."""
        self._asker.light(light)

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        """As ``Asker``."""
        self._asker(samples, order, blocks, scene)
        self.scenes.append(scene)
        points = samples.points(order, self._grid)
        told = (samples.places, samples.lengths, samples.density, samples.scattered)
        self._waves.append((samples.rays[order // samples.most], points, *(each[order] for each in told)))

    def kept(self) -> tuple[AnyArray, ...]:
        """Of all samples ray, place, m along it, length, density and colour; by rays, from near to far."""
        told = [np.concatenate(each) for each in zip(*self._waves, strict=True)]
        order = np.lexsort((told[2], told[0]))
        return tuple(each[order] for each in told)


def _none_of(extras: int) -> SeenRays:
    """Of a picture in which no ray asked anything, as of a sheet from its edge."""
    numbers, ways, told = (np.empty((0, *wide), np.float32) for wide in ((), (3,), (extras,)))
    first = np.zeros(1, np.int64)
    return SeenRays(np.empty((0, 3)), numbers, first, ways, ways, told, ways, numbers, numbers, ways)


def _of_pixels(keeper: _Keeper, pixels: AnyArray, light: DirectionalLight, exact: LinearImage) -> SeenRays:
    rays, points, _, lengths, density, scattered = keeper.kept()
    scene, cover = keeper.scenes[-1], exact.alpha.reshape(-1)[pixels]
    every = np.bincount(rays, minlength=len(pixels))
    # A ray without samples asked nothing, and a network can do nothing about it.
    use = (cover > 0.0) & (every > 0)
    own, at = use[rays], np.flatnonzero(use)
    colour = exact.colour.reshape(-1, 3)[pixels[at]] * (np.pi / light.irradiance)
    return SeenRays(
        *(points[own], lengths[own], np.concatenate([[0], np.cumsum(every[at])])),
        *(scene.views[at], np.tile(np.float32(scene.light), (len(at), 1)), scene.extras[at]),
        *((colour / cover[at, None]).astype(np.float32), cover[at].astype(np.float32)),
        *(density[own], scattered[own]),
    )
