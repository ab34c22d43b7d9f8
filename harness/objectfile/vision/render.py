"""Pictures of an object by its networks: one sample a ray, where it meets the surface, and opaque there."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.cores import own_cores
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objectfile.self_test import require_self_test
from harness.objectfile.surface_file import mesh_from_ply
from harness.objectfile.vision.coverage import Contours, Outline, mesh_outline
from harness.objectfile.vision.graph import FILE, Answers, VisionNetworks
from harness.objectfile.vision.hit import HitSurface, SurfacePoints
from harness.objectfile.vision.view import require_outside, require_size
from harness.objectfile.vision_entry import VisionEntry
from harness.picture.linear_image import LinearImage, binned
from harness.picture.pinhole import DirectionalLight, Pinhole

COVERS = (1, 3, 5, 7)
"""Sub-pixels along a pixel: odd, so that one is its centre."""

MOST_RAYS = 8
"""Along a pixel."""

REMOVED = {
    "level": "there is one way to a picture: one sample a ray, by the ObjectFile's graph",
    "step": "a ray has one sample, where it meets the surface; rays cuts pixels finer",
    "termination": "a ray ends where it meets the surface",
    "lead": "a ray begins where it meets the surface",
}
"""Knobs that pictures had, and what stands in their place."""


@dataclass(frozen=True)
class RenderSettings:
    """Knobs of a picture, each of cost against error."""

    coverage: int = 3  #: sub-pixels along a pixel, of the mesh's outline.
    rays: int = 1
    """along a pixel, so that 2 are four of them. With one, the edge of a print or of a shadow within a pixel
    is on this side or on that."""

    def __post_init__(self) -> None:
        if self.coverage not in COVERS:
            raise WrongUse(f"a coverage of {self.coverage}; coverages are {', '.join(map(str, COVERS))}")
        if not 1 <= self.rays <= MOST_RAYS:
            raise WrongUse(f"{self.rays} rays along a pixel; 1 to {MOST_RAYS}, so that 2 are four of them")


@dataclass(frozen=True, eq=False)
class Rendered:
    """A picture and what it took."""

    image: LinearImage  #: linear light, coverage and depth.
    samples: int  #: that networks were asked for.
    rays: int  #: of the pixels that show the object.
    seconds: Mapping[str, float]  #: s of each part, and ``render`` of all.


class VisionRenderer:
    """An object, ready to be rendered; one picture at a time.

    Args:
        data: of ``vision.onnx``.
        mesh: of the object, in metres.
        threads: of the networks; None for as many as the process has cores.
        name: of the file, for messages.

    Raises:
        DataRefused: the file is not one of networks of vision, or of another object than the mesh.
    """

    def __init__(self, data: bytes, mesh: Mesh, threads: int | None = None, name: str = FILE) -> None:
        self.networks = VisionNetworks(data, name, own_cores() if threads is None else threads)
        self.networks.grid.require_surface(mesh)
        self._contours = Contours.of(mesh)
        self._surface = HitSurface(self._contours)

    def render(
        self, camera: Pinhole, light: DirectionalLight, settings: RenderSettings | None = None
    ) -> Rendered:
        """Render the object under one light.

        Args:
            camera: that looks; anywhere, within the object too.
            light: from far away.
            settings: None for the default.
        """
        chosen, times = settings or RenderSettings(), [time.perf_counter()]
        fine = camera.resized(chosen.rays * camera.width, chosen.rays * camera.height)
        outline = mesh_outline(self._contours, fine, chosen.coverage)
        times.append(time.perf_counter())
        asked = self._surface.points(fine, light, outline)
        times.append(time.perf_counter())
        found = self._ask(asked)
        times.append(time.perf_counter())
        image = _picture(fine, outline, found, light)
        image = binned(image, chosen.rays) if chosen.rays > 1 else image
        times.append(time.perf_counter())
        seconds = dict(zip(("outline", "hits", "networks", "picture"), np.diff(times).tolist(), strict=True))
        samples = int(np.count_nonzero(found.known))
        return Rendered(image, samples, len(found.known), seconds | {"render": times[-1] - times[0]})

    def opacities(self, camera: Pinhole, light: DirectionalLight, depth: float) -> FloatArray:
        """Compute which share of the light the networks stop within a depth, at each point that is seen.

        Args:
            camera: that looks.
            light: from far away.
            depth: m behind the surface, over which the density there is taken to last.
        """
        outline = mesh_outline(self._contours, camera, 1)
        found = self._ask(self._surface.points(camera, light, outline))
        return np.where(found.known, -np.expm1(-depth * found.density.astype(np.float64)), 0.0)

    def _ask(self, asked: SurfacePoints) -> Answers:
        return self.networks.ask(asked.points, asked.views, asked.light, asked.extras)


def _picture(camera: Pinhole, outline: Outline, found: Answers, light: DirectionalLight) -> LinearImage:
    """Lay out what the networks answered in the pixels that it belongs to."""
    shape, known = (camera.height, camera.width), found.known
    pixels, cover = outline.pixels[known], outline.cover[known].astype(np.float64)
    colour, alpha, depth = (
        np.zeros((camera.pixels, 3)),
        np.zeros(camera.pixels),
        np.full(camera.pixels, np.inf),
    )
    colour[pixels] = found.scattered[known] * (light.irradiance / np.pi * cover)[:, None]
    alpha[pixels], depth[pixels] = cover, outline.depth[known]
    return LinearImage(colour.reshape(*shape, 3), alpha.reshape(shape), depth.reshape(shape))


class ObjectVision:
    """The look of one object; one picture at a time."""

    def __init__(self, entry: VisionEntry, surface: Mesh, renderer: VisionRenderer) -> None:
        self.entry = entry  #: its table in ``object.json``.
        self.surface = surface  #: in metres, along which pictures are rendered.
        self.renderer = renderer  #: of the networks.

    def picture(
        self, camera: Pinhole, light: DirectionalLight, settings: RenderSettings | None = None
    ) -> Rendered:
        """Render the object under a distant light; settings are the default if None.

        Raises:
            OutOfDomain: a camera inside the object, or more rays in the picture than the limit.
        """
        require_size(camera.width, camera.height, 1 if settings is None else settings.rays)
        require_outside(self.surface, camera.eye)
        return self.renderer.render(camera, light, settings)

    def lit(
        self, camera: Pinhole, lights: Sequence[DirectionalLight], settings: RenderSettings | None = None
    ) -> Rendered:
        """Render the object under any number of lights: light adds up. Under none the object is black.

        Arguments and errors otherwise as of ``picture``.
        """
        dark = DirectionalLight(-camera.forward, 0.0)
        found = [self.picture(camera, light, settings) for light in lights or (dark,)]
        first = found[0]
        if len(found) == 1:
            return first
        colour: FloatArray = np.sum([each.image.colour for each in found], axis=0)
        seconds = {name: sum(each.seconds[name] for each in found) for name in first.seconds}
        image = LinearImage(colour, first.image.alpha, first.image.depth)
        return Rendered(image, sum(each.samples for each in found), first.rays, seconds)


def open_vision(of: ObjectFile, threads: int | None = None) -> ObjectVision:
    """Open the look of an object, ready for pictures.

    Args:
        of: the object.
        threads: of the networks; None for as many as the process has cores.

    Raises:
        DataRefused: it has no look, a file of it is damaged, or is not the one described.
    """
    entry = of.description.vision
    if entry is None:
        raise DataRefused(f"{of.folder} has no vision; add it with `touchstone object build --only vision`")
    surface = of.mesh
    if entry.surface is not None:
        surface = mesh_from_ply(of.read(entry.surface), entry.surface.file)
    renderer = VisionRenderer(of.read(entry.network), surface, threads, entry.network.file)
    require_described(renderer.networks, entry)
    require_self_test(renderer.networks.network, entry.network.self_test)
    return ObjectVision(entry, surface, renderer)


def require_described(networks: VisionNetworks, entry: VisionEntry) -> None:
    """Refuse networks that are not those of an entry.

    Raises:
        DataRefused: the first thing that differs.
    """
    grid, size, name = networks.grid, networks.size, entry.network.file
    pairs = (
        ("networks", len(grid), entry.grid.networks),
        ("least corner, m", tuple(grid.low.tolist()), entry.grid.low_m),
        ("cells of m", grid.cell, entry.grid.cell_m),
        ("cells a side", tuple(grid.shape.tolist()), entry.grid.cells),
        ("level", size.kind, entry.level),
        ("width", size.width, entry.size.width),
        ("octaves of places", size.octaves, entry.size.octaves),
        ("octaves of directions", size.turns, entry.size.turns),
        ("samples of a block", networks.block, entry.size.block),
        ("density of 1 in 1/m", np.float32(networks.density_scale), np.float32(entry.density_per_m)),
    )
    for what, held, said in pairs:
        if held != said:
            raise DataRefused(
                f"{name}: its {what}: {held}, where object.json says {said}; they were not built together, "
                "build again"
            )
