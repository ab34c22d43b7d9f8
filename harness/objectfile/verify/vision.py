"""Whether networks of vision are those described, and are of their object."""

import numpy as np

from harness.basics.errors import DataRefused
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.graph import VisionNetworks
from harness.objectfile.vision.render import open_vision, require_described
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.objectfile.vision_entry import VisionEntry

_VIEWS = 3
_PIXELS = 48

_OPAQUE = 0.5
"""Minimum median opacity at points of the surface; networks of another object stay below it."""


def look_at_networks(of: ObjectFile, entry: VisionEntry) -> str:
    """Read the networks out of the graph.

    Raises:
        DataRefused: there are none, or not those of the entry.
    """
    networks = VisionNetworks(of.read(entry.network), entry.network.file)
    require_described(networks, entry)
    return (
        f"{len(networks.grid)} of {networks.size.parameters} numbers, in cubes of "
        f"{entry.grid.cell_m * 1e3:.4g} mm; {networks.size.width} wide, {networks.size.kind}"
    )


def look_at_looks(of: ObjectFile, entry: VisionEntry) -> str:
    """Look from around, and see whether the networks are opaque where the surface is.

    Raises:
        DataRefused: they are of different objects.
    """
    vision, medians = open_vision(of, threads=1), []
    camera = camera_for(vision.surface, _PIXELS, _PIXELS)
    middle = vision.surface.bounds.mean(axis=0)
    depth = entry.shell.deep_voxels * entry.grid.cell_m / entry.shell.voxels_per_cell
    for step in range(_VIEWS):
        view, light = turned(camera, light_for(camera), middle, 2.0 * np.pi * step / _VIEWS)
        medians.append(float(np.median(vision.renderer.opacities(view, light, depth))))
    least = min(medians)
    if not least >= _OPAQUE:
        raise DataRefused(
            f"the networks stop {least:.0%} of the light where the surface is, in the median point, and "
            f"{_OPAQUE:.0%} or more would be a surface; they belong to different objects, frames or units: "
            "build the object again"
        )
    return f"opaque to {least:.1%} in the median point of {_VIEWS} views"
