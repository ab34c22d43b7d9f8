"""Whether networks of vision are those described, compute what they seem to, and are of their object."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.file import ObjectFile
from harness.objectfile.runtime import Network
from harness.objectfile.vision.coverage.outline import mesh_outline
from harness.objectfile.vision.network.graph import graph_block, vision_model
from harness.objectfile.vision.network.plain import Query, evaluate
from harness.objectfile.vision.part import blocks_inside
from harness.objectfile.vision.settings import RenderSettings
from harness.objectfile.vision.threads import Crew, Workspace
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.objectfile.vision.vision import open_vision, require_described
from harness.objectfile.vision_entry import VisionEntry

_BLOCKS = 16
"""Of networks from the first to the last, that are asked in two ways."""

_ALIKE = 1e-3
"""By which the graph and its weights may differ, of the greatest density and of white."""

_VIEWS = 3
_PIXELS = 48

_OPAQUE = 0.5
"""Of a pixel that the surface wholly covers, in the median: less of it is another object's fog."""


def look_at_networks(of: ObjectFile, entry: VisionEntry) -> str:
    """Read the networks out of the graph.

    Raises:
        DataRefused: there are none, or not those of the entry.
    """
    data, name = of.read(entry.network), entry.network.file
    model = vision_model(data, name)
    require_described(model, graph_block(data, name), entry)
    size, cell = model.weights.size, entry.grid.cell_m
    return (
        f"{len(model.grid)} of {size.parameters} numbers, in cubes of {cell * 1e3:.4g} mm; "
        f"{size.width} wide, {size.kind}"
    )


def look_at_weights(of: ObjectFile, entry: VisionEntry) -> str:
    """Ask the graph, and the layers by the names of their weights, which the fast level goes by.

    Raises:
        DataRefused: they answer differently.
    """
    data, name = of.read(entry.network), entry.network.file
    model, block = vision_model(data, name), entry.size.block
    asked = blocks_inside(model, _BLOCKS, block, np.random.default_rng(1))
    of_graph = entry.network
    network = Network(data, of_graph.file, of_graph.inputs, of_graph.outputs)
    found, worst = network(asked), 0.0
    for row, network in enumerate(asked["network"][:, 0]):
        extras = asked["extras"][row] if "extras" in asked else np.zeros((block, 0))
        light: FloatArray = asked["light"][row].astype(np.float64)
        one = Query(np.full(block, network), asked["points"][row], asked["views"][row], light, extras)
        density, colour = evaluate(model, one)
        gap = np.abs(found["density"][row, :, 0] - density).max() / max(float(density.max()), 1e-30)
        worst = max(worst, float(gap), float(np.abs(found["scattered"][row] - colour).max()))
    if not worst <= _ALIKE:
        raise DataRefused(
            f"{name} computes something else than its weights say, by {worst:.2g} of the greatest number "
            f"where {_ALIKE:g} is allowed: its levels would show different pictures; build the object again"
        )
    return f"the same to {worst:.1e} of the greatest number ({_ALIKE:g} is allowed)"


def look_at_looks(of: ObjectFile) -> str:
    """Take small pictures from around, and see whether the networks are opaque where the surface is.

    Raises:
        DataRefused: they are of different objects.
    """
    vision, medians = open_vision(of, threads=1), []
    camera = camera_for(vision.surface, _PIXELS, _PIXELS)
    middle = vision.surface.bounds.mean(axis=0)
    for step in range(_VIEWS):
        view, light = turned(camera, light_for(camera), middle, 2.0 * np.pi * step / _VIEWS)
        outline = mesh_outline(vision.surface, False, view, 3, Crew(1), Workspace())
        covered = outline.pixels[outline.cover == outline.cover.max()]
        alpha = vision.picture(view, light, RenderSettings(level="onnx")).image.alpha
        medians.append(float(np.median(alpha.ravel()[covered])))
    least = min(medians)
    if not least >= _OPAQUE:
        raise DataRefused(
            f"the networks stop {least:.0%} of the light where the surface is, in the median pixel, and "
            f"{_OPAQUE:.0%} or more would be a surface; they belong to different objects, frames or units: "
            "build the object again"
        )
    return f"opaque to {least:.1%} in the median pixel of {_VIEWS} pictures"
