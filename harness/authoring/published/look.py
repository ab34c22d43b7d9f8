"""Look of a published file as a table of ``object.json`` and exported networks, one (OSF) or one a cell."""

import math
from typing import Any

import numpy as np

from harness.authoring.published.layout import FileTable, ImportedParts, State
from harness.basics.arrays import BoolArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Domain, NetworkEntry
from harness.objectfile.file import file_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.entries import Bounds
from harness.objectfile.published.look import osf_tensors, raw_look_tensors
from harness.objectfile.vision_tensors import graph_input

_VISION, _FINE = "vision.onnx", "vision_fine.onnx"
_CELLS, _OCCUPANCY = "vision_cells.npy", "vision_occupancy.bits"

_BLOCK = 64
"""Samples of one network that are queried together."""

_MOST_LAYERS = 64

_MOST_SAMPLES = 4096
"""Maximum samples of a ray."""

_MOST_CELLS = 64
"""Maximum cells along a side; published are 16."""

_MOST_VOXELS = 1024
"""Maximum voxels along a side; published are 256."""

_MOST_OCTAVES = 16

_FIRST_FAR = 4.0
_FIRST = {
    "near": 0.01,
    "far": _FIRST_FAR,
    "samples": 64,
    "importance": 128,
    "white": True,
    "colour": "sigmoid",
}
"""Settings of 1.0, by its program; its files hold none."""

_MISSING = ["how the vision frame lies to the mesh, and what its unit is in metres: pictures tell no size"]


def take_first_look(vision: FileTable, _: Bounds | None, parts: ImportedParts) -> None:
    """Read the look of version 1.0: a coarse and a fine network.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    networks = {}
    for name, file, key in (
        ("network", _VISION, "network_fn_state_dict"),
        ("fine", _FINE, "network_fine_state_dict"),
    ):
        state = State.of(vision, key)
        networks[name] = _osf(file, state, "", 8, 5, (10, 4), _FIRST_FAR, parts)
        parts.dropped |= state.unused()
    parts.tree["vision"] = {"kind": "osf", **_FIRST, **networks}
    parts.missing += [*_MISSING, "how rays are sampled: the numbers are the published program's"]


def take_look(vision: FileTable, _: Bounds | None, parts: ImportedParts) -> None:
    """Read the look of version 2.0, of either kind; ``DataRefused`` as ``take_first_look``."""
    settings, state = vision.part("cfg"), State.of(vision, "model_state_dict")
    if settings.flag("llff_lindisp"):
        raise DataRefused(f"{settings.name} samples rays evenly in disparity, as no published object does")
    importance = settings.whole("num_importance_samples_per_ray", _MOST_SAMPLES, least=0)
    look: dict[str, Any] = {
        "near": float(settings.numbers("near")[0]),
        "far": float(settings.numbers("far")[0]),
        "samples": settings.whole("num_samples_per_ray", _MOST_SAMPLES),
        "importance": importance,
        "white": settings.flag("blender_white_background"),
        "colour": "clipped" if settings.flag("no_color_sigmoid") else "sigmoid",
    }
    skip = None  # the layer that takes the input again; its index is written as text where there is none
    if settings.values.get("refeed_position_index") not in (None, "None"):
        skip = settings.whole("refeed_position_index", _MOST_LAYERS, least=0) + 1
    layers = settings.whole("num_hidden_layers", _MOST_LAYERS)
    octaves, turns = (
        settings.whole(f"num_frequencies{of}", _MOST_OCTAVES, least=0) for of in ("", "_direction")
    )
    if "occupancy_grid" in vision.values or any(np.ndim(value) == 3 for value in state.values.values()):
        if importance:
            raise DataRefused(
                f"{settings.name} has further samples of a KiloOSF, which the published program takes none of"
            )
        if skip is not None or layers != 2:
            raise DataRefused(f"{settings.name} is of a KiloOSF of other layers than the two published ones")
        if settings.whole("num_frequencies_light", _MOST_OCTAVES, least=0) != turns:
            raise DataRefused(
                f"{settings.name} encodes views with {turns} octaves and lights with others; published are 4 "
                "and 4"
            )
        look |= {"kind": "kilo-osf", **_take_cells(vision, settings, state, (octaves, turns), parts)}
    else:
        prefixes = ("model_coarse.", "model_fine.") if importance else ("",)
        look["kind"] = "osf"
        for name, file, prefix in zip(("network", "fine"), (_VISION, _FINE), prefixes, strict=False):
            look[name] = _osf(file, state, prefix, layers, skip, (octaves, turns), look["far"], parts)
    parts.dropped |= state.unused()
    parts.tree["vision"] = look
    parts.missing += _MISSING


def _osf(
    file: str,
    state: State,
    prefix: str,
    layers: int,
    skip: int | None,
    octaves: tuple[int, int],
    reach: float,
    parts: ImportedParts,
) -> NetworkEntry:
    """Export one network for all places, whose samples lie within ``reach`` of the origin."""
    from harness.authoring.published.modules import Osf, load_weights

    width, turned = (state.outputs(f"{prefix}{name}") for name in ("pts_linears.0", "views_lights_linears.0"))
    module = Osf(width, turned, layers, skip, octaves)
    load_weights(module, state, prefix)
    doc = "A point, a view and a light of the vision frame to raw colour and density; from a published file."
    return parts.network(file, module, *osf_tensors(reach), doc)


def _take_cells(
    vision: FileTable, settings: FileTable, state: State, octaves: tuple[int, int], parts: ImportedParts
) -> dict[str, Any]:
    """Export the networks of a KiloOSF, without those of cells that nothing is in."""
    low, high = (settings.array(f"global_domain_{end}", (3,)) for end in ("min", "max"))
    if not (high > low).all():
        raise DataRefused(
            f"{settings.name} has a cube from {low.tolist()} to {high.tolist()}, which holds nothing"
        )
    cells = settings.wholes("fixed_resolution", 3, _MOST_CELLS)
    grid: dict[str, Any] = {"low": low.tolist(), "high": high.tolist(), "cells": cells, "block": _BLOCK}
    needed = np.full(cells, True)
    if vision.values.get("occupancy_grid") is not None:
        voxels = settings.part("occupancy").wholes("resolution", 3, _MOST_VOXELS)
        occupied = vision.array("occupancy_grid").ravel() != 0.0
        if occupied.size != math.prod(voxels) or not occupied.any():
            raise DataRefused(
                f"{vision.name}/occupancy_grid has {occupied.size} voxels of {voxels}, or is empty: there is "
                "nothing to be seen"
            )
        parts.contents[_OCCUPANCY] = np.packbits(occupied).tobytes()
        grid |= {"voxels": voxels, "occupancy": file_entry(_OCCUPANCY, parts.contents[_OCCUPANCY])}
        needed = needed_cells(occupied.reshape(voxels), cells)
    count = int(needed.sum())
    numbers = np.full(cells, -1)
    numbers[needed] = np.arange(count)
    parts.contents[_CELLS] = npy_bytes(numbers.ravel(), "<i4")
    grid["networks"] = file_entry(_CELLS, parts.contents[_CELLS])

    from harness.authoring.published.modules import KiloOsf, load_weights

    widths = [
        state.outputs(name, 2)
        for name in ("pts_linears.0", "pts_linears.1", "feature_linear", "direction_layer")
    ]
    cell = (high - low) / np.array(cells)
    module = KiloOsf(low + np.argwhere(needed) * cell, cell, widths, octaves)
    load_weights(module, state, cells=needed.ravel())
    box = Domain(low=tuple(low.tolist()) * _BLOCK, high=tuple(high.tolist()) * _BLOCK)
    block = Domain(low=(-1.0,) * 3 * _BLOCK, high=(1.0,) * 3 * _BLOCK)
    which = Domain(low=(0.0,), high=(count - 1.0,))
    _, views, light = osf_tensors(1.0)[0]
    inputs = (
        graph_input("network", "int64", ("n", 1), "1", "which network", which),
        graph_input(
            "points", "float64", ("n", _BLOCK, 3), "1", "where, in the network's cell", box, "vision"
        ),
        views.model_copy(update={"shape": ("n", _BLOCK, 3), "domain": block}),
        light,
    )
    doc = f"{count} networks: points, views and light to raw colour and density; from a published file."
    network = parts.network(_VISION, module, inputs, raw_look_tensors(("n", _BLOCK)), doc)
    return {"network": network, "cells": grid}


def needed_cells(occupied: BoolArray, cells: tuple[int, ...]) -> BoolArray:
    """Find the ``(x, y, z)`` cells that an occupied voxel of ``(x, y, z)`` voxels reaches into."""
    needed = np.zeros(cells, np.bool_)
    voxels, sides = np.argwhere(occupied), np.array(cells)
    first = voxels * sides // np.array(occupied.shape)
    last = -(-(voxels + 1) * sides // np.array(occupied.shape)) - 1
    for corner in np.ndindex(2, 2, 2):
        needed[tuple(np.where(corner, last, first).T)] = True
    return needed
