"""Pictures of an object from its networks: rays, a shell, samples by cell, light along rays.

Levels of one effect: ``fused`` asks a kernel made for it; ``onnx`` the file's graph alone, which gives the
same picture; ``one_sample`` asks once a ray, where the mesh is, and takes what is there as opaque.
"""

import time

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.runtime import Network
from harness.objectfile.vision.coverage.blocks import aim, lay_out
from harness.objectfile.vision.coverage.contour import Contours
from harness.objectfile.vision.coverage.outline import Outline, is_closed, mesh_outline, whole_picture
from harness.objectfile.vision.network.fold import folded
from harness.objectfile.vision.network.graph import FILE, graph_block, vision_model
from harness.objectfile.vision.network.tensors import vision_tensors
from harness.objectfile.vision.passes import Aim, Follower, PassTimes, Rays, Volume
from harness.objectfile.vision.samples import Asker, FusedAsker, GraphAsker, Scene
from harness.objectfile.vision.settings import Rendered, RenderSettings, VisionLevel
from harness.objectfile.vision.shell import DEEP, PER_CELL, shell_for
from harness.objectfile.vision.surface import SurfaceExtras
from harness.objectfile.vision.threads import Crew, Workspace
from harness.picture.linear_image import LinearImage, binned
from harness.picture.pinhole import DirectionalLight, Pinhole


class VisionRenderer:
    """An object, ready to be looked at; one picture at a time.

    Args:
        data: of ``vision.onnx``.
        mesh: of the object, in metres.
        threads: None for as many as the process has cores.
        per_cell: voxels of the shell along a cell.
        deep: voxels that it goes on behind the surface.
        name: of the file, for messages.

    Raises:
        DataRefused: the file is not one of networks of vision, or of another object than the mesh.
    """

    def __init__(
        self,
        data: bytes,
        mesh: Mesh,
        threads: int | None = None,
        per_cell: int = PER_CELL,
        deep: float = DEEP,
        name: str = FILE,
    ) -> None:
        self._data, self._mesh, self._name = data, mesh, name
        self.model = vision_model(data, name)
        self.shell = shell_for(mesh, self.model.grid, per_cell, deep)
        self._closed, self._contours = is_closed(mesh), Contours.of(mesh)
        self._crew, self._room = Crew(threads), Workspace()
        self._follower = Follower(Volume(self.model, self.shell, per_cell), self._crew)
        extras = self.model.weights.size.extras
        self._extras = SurfaceExtras(mesh, extras, self._closed)
        self._askers: dict[str, Asker] = {}

    def render(
        self, camera: Pinhole, light: DirectionalLight, settings: RenderSettings | None = None
    ) -> Rendered:
        """A picture of the object under one light.

        Args:
            camera: that looks; anywhere, within the object too.
            light: from far away.
            settings: None for the default.
        """
        chosen, begun = settings or RenderSettings(), time.perf_counter()
        if chosen.rays == 1:
            return self._one_ray(camera, light, chosen)
        fine = camera.resized(chosen.rays * camera.width, chosen.rays * camera.height)
        found = self._one_ray(fine, light, chosen)
        image = binned(found.image, chosen.rays)
        seconds = {**found.seconds, "render": time.perf_counter() - begun}
        return Rendered(image, found.level, found.samples, found.rays, seconds)

    def _one_ray(self, camera: Pinhole, light: DirectionalLight, chosen: RenderSettings) -> Rendered:
        """A picture of one ray a pixel."""
        watch = PassTimes()
        asker = self._asker(chosen.level)
        watch.lap("open")
        outline = self._outline(camera, chosen)
        watch.lap("outline")
        rays, slant, aimed = self._rays(camera, light, outline, chosen)
        watch.lap("rays")
        samples = self._follower.follow(rays, aimed, asker, chosen, watch)
        image = _picture(camera, outline, rays.sums, slant, light.irradiance / np.pi)
        watch.lap("picture")
        watch.seconds["render"] = time.perf_counter() - watch.begun
        return Rendered(image, chosen.level, samples, len(slant), watch.seconds)

    def _outline(self, camera: Pinhole, chosen: RenderSettings) -> Outline:
        if chosen.coverage == 1 and chosen.marches:
            return whole_picture(camera)
        told = self.model.weights.size.extras > 0
        side = chosen.coverage
        ready = self._contours
        return mesh_outline(self._mesh, self._closed, camera, side, self._crew, self._room, told, ready)

    def _rays(
        self, camera: Pinhole, light: DirectionalLight, outline: Outline, chosen: RenderSettings
    ) -> tuple[Rays, FloatArray, Aim]:
        """The rays, depth for a unit of length along each, and what fills in both for some of them."""
        count, (x, y) = len(outline.pixels), camera.centre_px
        ways, surface = self._room.take("ways", (count, 3), np.float64), np.full(count, np.inf)
        slant, begin = np.empty(count), np.zeros(count)
        views = self._room.take("views", (count, 3), np.float32)
        extras = self._room.take("extras", (count, self._extras.count), np.float32)
        lit = self._extras.under(camera.eye, light.direction)
        rotation = np.ascontiguousarray(camera.object_from_camera[:3, :3])

        def aimed(first: int, last: int, room: Workspace) -> None:
            at = slice(first, last)
            places, drawn = outline.places[at], (ways[at], views[at], slant[at])
            aim(places, camera.focal_px, x, y, rotation, *drawn)
            if len(outline.depth):
                surface[at] = outline.depth[at] / slant[at]
                if np.isfinite(chosen.lead):
                    begin[at] = np.maximum(surface[at] - chosen.lead * self.shell.voxel, 0.0)
            if lit is not None:
                lit.surface_inputs(ways[at], surface[at], outline.faces[at], extras[at], room)

        rays = Rays.begun(camera.eye, ways, surface, Scene(views, extras, light.direction), begin)
        return rays, slant, aimed

    def _asker(self, level: VisionLevel) -> Asker:
        """The way to ask that a level has, made when it is first used."""
        kind = "onnx" if level == "onnx" else "fused"
        if kind not in self._askers:
            self._askers[kind] = self._opened() if kind == "onnx" else FusedAsker(folded(self.model.weights))
        return self._askers[kind]

    def _opened(self) -> GraphAsker:
        block = graph_block(self._data, self._name)
        network = Network(self._data, self._name, *vision_tensors(self.model, block))
        return GraphAsker(network, self.model.grid, self.model.weights.density_scale, block)


def _picture(
    camera: Pinhole, outline: Outline, sums: FloatArray, slant: FloatArray, radiance: float
) -> LinearImage:
    rows, columns = camera.height, camera.width
    colour, alpha = np.zeros((rows * columns, 3)), np.zeros(rows * columns)
    depth = np.full(rows * columns, np.inf)
    lay_out(outline.pixels, outline.cover, sums, slant, radiance, colour, alpha, depth)
    return LinearImage(
        colour.reshape(rows, columns, 3), alpha.reshape(rows, columns), depth.reshape(rows, columns)
    )
