"""Look of a published file as a table of ``object.json`` and exported networks, one (OSF) or one a cell."""

from typing import Any

import numpy as np

from harness.authoring.published.layout import FileTable, State, checked
from harness.authoring.published.senses import ImportedParts
from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Domain, NetworkEntry
from harness.objectfile.file import file_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.look import osf_tensors, raw_look_tensors
from harness.objectfile.vision_tensors import graph_input

_VISION, _FINE = "vision.onnx", "vision_fine.onnx"
_CELLS, _OCCUPANCY = "vision_cells.npy", "vision_occupancy.bits"

_BLOCK = 64
"""Samples of one network that are queried together."""

_MOST_CELLS = 64
"""Along a side; published are 16."""

_MOST_VOXELS = 1024
"""Along a side; published are 256."""

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
"""Of 1.0, by its program; its files hold no settings."""

_MISSING = ["how the vision frame lies to the mesh, and what its unit is in metres: pictures tell no size"]


def take_first_look(vision: FileTable, into: ImportedParts) -> None:
    """Read the look of version 1.0: a coarse and a fine network.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    entries = []
    for file, key in ((_VISION, "network_fn_state_dict"), (_FINE, "network_fine_state_dict")):
        state = State.of(vision, key)
        entries.append(_osf(file, state, "", 8, 5, (10, 4), _FIRST_FAR, into))
        into.dropped |= state.unused()
    into.tree["vision"] = {"kind": "osf", **_FIRST, "network": entries[0], "fine": entries[1]}
    into.missing += [*_MISSING, "how rays are sampled: the numbers are the published program's"]


def take_look(vision: FileTable, into: ImportedParts) -> None:
    """Read the look of version 2.0, of either kind; ``DataRefused`` as ``take_first_look``."""
    settings, state = vision.part("cfg"), State.of(vision, "model_state_dict")
    if settings.flag("llff_lindisp"):
        raise DataRefused(f"{settings.name} samples rays evenly in disparity, as no published object does")
    sampled: dict[str, Any] = {
        "near": settings.number("near"),
        "far": settings.number("far"),
        "samples": settings.whole("num_samples_per_ray", 4096),
        "importance": settings.whole("num_importance_samples_per_ray", 4096, least=0),
        "white": settings.flag("blender_white_background"),
        "colour": "clipped" if settings.flag("no_color_sigmoid") else "sigmoid",
    }
    refeed = None  # the layer behind which the input comes again; written as text where there is none
    if settings.values.get("refeed_position_index") not in (None, "None"):
        refeed = settings.whole("refeed_position_index", 64, least=0)
    if "occupancy_grid" in vision.values or any(np.ndim(value) == 3 for value in state.values.values()):
        if sampled["importance"]:
            raise DataRefused(
                f"{settings.name} asks for further samples of a KiloOSF, which the published program has "
                "none of"
            )
        if refeed is not None or settings.whole("num_hidden_layers", 64) != 2:
            raise DataRefused(f"{settings.name} is of a KiloOSF of other layers than the two published ones")
        found = _take_cells(vision, settings, state, into)
    else:
        layers, skip = settings.whole("num_hidden_layers", 64), None if refeed is None else refeed + 1
        octaves = (_octaves(settings, ""), _octaves(settings, "_direction"))
        prefixes = ("model_coarse.", "model_fine.") if sampled["importance"] else ("",)
        networks = [
            _osf(file, state, prefix, layers, skip, octaves, sampled["far"], into)
            for file, prefix in zip((_VISION, _FINE), prefixes, strict=False)
        ]
        found = {"kind": "osf", **dict(zip(("network", "fine"), networks, strict=False))}
    into.dropped |= state.unused()
    into.tree["vision"] = {**sampled, **found}
    into.missing += _MISSING


def _octaves(settings: FileTable, of: str) -> int:
    return settings.whole(f"num_frequencies{of}", _MOST_OCTAVES, least=0)


def _osf(
    file: str,
    state: State,
    prefix: str,
    layers: int,
    skip: int | None,
    octaves: tuple[int, int],
    reach: float,
    into: ImportedParts,
) -> NetworkEntry:
    """Export one network for all places, whose samples lie within ``reach`` of the origin."""
    from harness.authoring.published.modules import Osf, load_weights

    widths = [state.outputs(f"{prefix}{name}") for name in ("pts_linears.0", "views_lights_linears.0")]
    module = Osf(widths[0], widths[1], layers, skip, octaves)
    load_weights(module, state, prefix)
    random = np.random.default_rng(0)
    asked = {
        "points": random.uniform(-0.6, 0.6, (4, 3)),
        **{name: _unit_vectors(random, 4) for name in ("views", "light")},
    }
    doc = "A point, a view and a light of the vision frame to raw colour and density; from a published file."
    return into.network(file, module, *osf_tensors(reach), doc, asked)


def _take_cells(vision: FileTable, settings: FileTable, state: State, into: ImportedParts) -> dict[str, Any]:
    """Read a KiloOSF, without the networks of cells that nothing is in."""
    low, high = settings.array("global_domain_min", (3,)), settings.array("global_domain_max", (3,))
    cells = settings.sizes("fixed_resolution", _MOST_CELLS)
    if not (high > low).all():
        raise DataRefused(
            f"{settings.name} has a cube from {low.tolist()} to {high.tolist()}, which holds nothing"
        )
    count = int(np.prod(cells))
    occupied, voxels = _occupancy(vision, settings)
    needed = needed_cells(occupied, voxels, cells)
    networks = np.full(count, -1)
    networks[needed] = np.arange(needed.sum())
    into.contents[_CELLS] = npy_bytes(networks, "<i4")
    if occupied is not None:
        into.contents[_OCCUPANCY] = np.packbits(occupied).tobytes()
    grid = {
        "low": low.tolist(),
        "high": high.tolist(),
        "cells": cells,
        "block": _BLOCK,
        "voxels": voxels,
        "networks": file_entry(_CELLS, into.contents[_CELLS]),
        "occupancy": None if occupied is None else file_entry(_OCCUPANCY, into.contents[_OCCUPANCY]),
    }
    octaves = [_octaves(settings, of) for of in ("", "_direction", "_light")]
    if octaves[1] != octaves[2]:
        raise DataRefused(
            f"{settings.name} encodes views with {octaves[1]} octaves and lights with {octaves[2]}; "
            "published are 4 and 4"
        )
    network = _cell_networks(state, needed.reshape(cells), low, high, (octaves[0], octaves[1]), into)
    return {"kind": "kilo-osf", "network": network, "cells": grid}


def _cell_networks(
    state: State,
    needed: BoolArray,
    low: FloatArray,
    high: FloatArray,
    octaves: tuple[int, int],
    into: ImportedParts,
) -> NetworkEntry:
    """Export the networks of the needed cells, ``(x, y, z)``, of the cube from ``low`` to ``high``."""
    from harness.authoring.published.modules import KiloOsf, load_weights

    networks = int(needed.sum())
    first, second, features, turned = (
        state.outputs(name, 2)
        for name in ("pts_linears.0", "pts_linears.1", "feature_linear", "direction_layer")
    )
    cell = (high - low) / np.array(needed.shape)
    lows = low + np.argwhere(needed) * cell
    module = KiloOsf(lows, cell, (first, second, features, turned), octaves)
    load_weights(module, state, cells=needed.ravel())
    box = Domain(low=tuple(low.tolist()) * _BLOCK, high=tuple(high.tolist()) * _BLOCK)
    _, views, light = osf_tensors(1.0)[0]
    block = Domain(low=(-1.0,) * 3 * _BLOCK, high=(1.0,) * 3 * _BLOCK)
    which = Domain(low=(0.0,), high=(networks - 1.0,))
    where = "where, in the network's cell"
    inputs = (
        graph_input("network", "int64", ("n", 1), "1", "which network", which),
        graph_input("points", "float64", ("n", _BLOCK, 3), "1", where, box, "vision"),
        views.model_copy(update={"shape": ("n", _BLOCK, 3), "domain": block}),
        light,
    )
    random, rows = np.random.default_rng(0), min(2, networks)
    queried = np.linspace(0, networks - 1, rows).astype(np.int64)
    asked = {
        "network": queried[:, None],
        "points": lows[queried][:, None] + random.random((rows, _BLOCK, 3)) * cell,
        "views": _unit_vectors(random, rows * _BLOCK).reshape(rows, _BLOCK, 3),
        "light": _unit_vectors(random, rows),
    }
    doc = f"{networks} networks: points, views and light to raw colour and density; from a published file."
    return into.network(_VISION, module, inputs, raw_look_tensors(("n", _BLOCK)), doc, asked)


def _occupancy(
    vision: FileTable, settings: FileTable
) -> tuple[BoolArray | None, tuple[int, int, int] | None]:
    grid = vision.values.get("occupancy_grid")
    if grid is None:
        return None, None
    voxels = settings.part("occupancy").sizes("resolution", _MOST_VOXELS)
    flat = checked(np.asarray(grid).ravel(), (int(np.prod(voxels)),), f"{vision.name}/occupancy_grid")
    if not flat.any():
        raise DataRefused(f"{vision.name}/occupancy_grid is empty: there is nothing to be seen")
    return flat != 0.0, voxels


def needed_cells(
    occupied: BoolArray | None, voxels: tuple[int, int, int] | None, cells: tuple[int, int, int]
) -> BoolArray:
    """Find the ``(cells,)`` that an occupied voxel reaches into; all if there is no occupancy."""
    if occupied is None or voxels is None:
        return np.full(int(np.prod(cells)), True)
    needed = np.zeros(cells, np.bool_)
    places = np.stack(np.nonzero(occupied.reshape(voxels)), axis=1)
    ends = [
        places * np.array(cells) // np.array(voxels),
        -(-(places + 1) * np.array(cells) // np.array(voxels)) - 1,
    ]
    for i in range(2):
        for j in range(2):
            for k in range(2):
                needed[ends[i][:, 0], ends[j][:, 1], ends[k][:, 2]] = True
    return needed.ravel()


def _unit_vectors(random: np.random.Generator, count: int) -> AnyArray:
    """``(count, 3)`` float32, in all directions: for self-tests."""
    drawn = random.normal(size=(count, 3))
    units: AnyArray = (drawn / np.linalg.norm(drawn, axis=1, keepdims=True)).astype(np.float32)
    return units
