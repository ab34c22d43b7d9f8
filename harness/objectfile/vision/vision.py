"""The look of an ObjectFile: pictures of the object, at the levels that its networks can be asked."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import nearest
from harness.basics.mesh import Mesh
from harness.objectfile.entries import NetworkEntry
from harness.objectfile.file import ObjectFile
from harness.objectfile.self_test import all_queries, require_answers
from harness.objectfile.surface_file import mesh_from_ply
from harness.objectfile.vision.network.graph import graph_block
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.network.plain import Query, evaluate
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import LEVELS, Rendered, RenderSettings, VisionLevel
from harness.objectfile.vision.view import require_outside, require_size
from harness.objectfile.vision_entry import VisionEntry
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole


class ObjectVision:
    """The look of one object; one picture at a time.

    Attributes:
        entry: what ``object.json`` says of it.
        surface: in metres, what pictures are drawn along.
        renderer: of the networks.
    """

    def __init__(self, entry: VisionEntry, surface: Mesh, renderer: VisionRenderer) -> None:
        self.entry, self.surface, self.renderer = entry, surface, renderer

    def picture(
        self, camera: Pinhole, light: DirectionalLight, settings: RenderSettings | None = None
    ) -> Rendered:
        """A picture of the object under one light.

        Args:
            camera: outside of the object.
            light: from far away.
            settings: None for the default.

        Raises:
            OutOfDomain: a camera within the object, or a picture larger than is drawn, all its rays counted.
        """
        require_size(camera.width, camera.height, 1 if settings is None else settings.rays)
        require_outside(self.surface, camera.eye)
        return self.renderer.render(camera, light, settings)

    def lit(
        self, camera: Pinhole, lights: Sequence[DirectionalLight], settings: RenderSettings | None = None
    ) -> Rendered:
        """A picture under any number of lights: light adds up. Under none the object is black.

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
        return Rendered(image, first.level, sum(each.samples for each in found), first.rays, seconds)


def vision_level(text: str) -> VisionLevel:
    """The level of that name.

    Raises:
        WrongUse: there is none.
    """
    match text:
        case "fused" | "onnx" | "one_sample":
            return text
    raise WrongUse(f"no level {text!r} of a picture; {nearest(text, LEVELS)}")


def open_vision(of: ObjectFile, threads: int | None = None) -> ObjectVision:
    """The look of an object, ready for pictures.

    Args:
        of: the object.
        threads: None for as many as the process has cores.

    Raises:
        DataRefused: it has no look, a file of it is damaged, or is not the one described.
    """
    entry = of.description.vision
    if entry is None:
        raise DataRefused(f"{of.folder} has no vision; add it with `touchstone object build --only vision`")
    surface = vision_surface(of, entry)
    name, data = entry.network.file, of.read(entry.network)
    shell = entry.shell
    renderer = VisionRenderer(data, surface, threads, shell.voxels_per_cell, shell.deep_voxels, name)
    require_described(renderer.model, graph_block(data, name), entry)
    require_own_answers(renderer.model, entry.network)
    return ObjectVision(entry, surface, renderer)


def vision_surface(of: ObjectFile, entry: VisionEntry) -> Mesh:
    """What pictures are drawn along, in metres; errors as of ``ObjectFile.read`` and of a damaged PLY."""
    if entry.surface is None:
        return of.mesh
    return mesh_from_ply(of.read(entry.surface), entry.surface.file)


def require_described(model: VisionModel, block: int, entry: VisionEntry) -> None:
    """Refuse networks that are not those of an entry.

    Raises:
        DataRefused: the first thing that differs.
    """
    grid, size, name = model.grid, model.weights.size, entry.network.file
    pairs = (
        ("networks", len(grid), entry.grid.networks),
        ("least corner, m", tuple(grid.low.tolist()), entry.grid.low_m),
        ("cells of m", grid.cell, entry.grid.cell_m),
        ("cells a side", tuple(grid.shape.tolist()), entry.grid.cells),
        ("level", size.kind, entry.level),
        ("width", size.width, entry.size.width),
        ("octaves of places", size.octaves, entry.size.octaves),
        ("octaves of directions", size.turns, entry.size.turns),
        ("samples of a block", block, entry.size.block),
        ("density of 1 in 1/m", np.float32(model.weights.density_scale), np.float32(entry.density_per_m)),
    )
    for what, held, said in pairs:
        if held != said:
            raise DataRefused(
                f"{name}: its {what}: {held}, where object.json says {said}; they were not built together, "
                "build again"
            )


def require_own_answers(model: VisionModel, entry: NetworkEntry) -> float:
    """The greatest difference from what the networks gave when they were made, of the greatest number.

    They are evaluated in float64 by their weights, as pictures take them; nothing that runs graphs is loaded.

    Raises:
        DataRefused: it is more than the self-test's tolerance: another object's networks.
    """
    queries = all_queries(entry.inputs, entry.self_test)
    blocks = ({name: array[row] for name, array in queries.items()} for row in range(entry.self_test.rows))
    rows = [_evaluated(model, block) for block in blocks]
    density, scattered = (np.stack(each) for each in zip(*rows, strict=True))
    outputs = {"density": density[:, :, None], "scattered": scattered}
    return require_answers(entry.file, outputs, entry.self_test)


def _evaluated(model: VisionModel, block: Mapping[str, AnyArray]) -> tuple[FloatArray, FloatArray]:
    """Density and scattered light of the samples of one block."""
    count = len(block["points"])
    networks = np.full(count, block["network"][0])
    extras = block.get("extras", np.zeros((count, 0)))
    light: FloatArray = block["light"].astype(np.float64)
    return evaluate(model, Query(networks, block["points"], block["views"], light, extras))
