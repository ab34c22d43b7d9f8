"""The look of a published file as tables and graphs of ours: one network (OSF), or one a cell (KiloOSF)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.authoring.published.layout import Part, State, checked
from harness.authoring.published.senses import TOLERANCE, ImportedParts, refusing
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import FileEntry, NetworkEntry
from harness.objectfile.file import file_entry
from harness.objectfile.graph import Encoding, MlpWeights
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.cell_graph import BLOCK, LAYERS, CellWeights, cell_graph
from harness.objectfile.published.graphs import OsfWeights, osf_graph
from harness.objectfile.published.tensors import cell_tensors, osf_tensors

VISION, FINE, CELLS, OCCUPANCY = (
    "vision.onnx",
    "vision_fine.onnx",
    "vision_cells.npy",
    "vision_occupancy.bits",
)

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

_FIRST_LAYERS = 8
_FIRST_SKIP = 4
_OCTAVES, _TURNS = 10, 4
_MOST_OCTAVES = 16
_MOST_CELLS = 64
"""Along a side; published are 16."""
_MOST_VOXELS = 1024
"""Along a side; published are 256."""

_MISSING = ["how the vision frame lies to the mesh, and what its unit is in metres: pictures tell no size"]


def take_first_look(vision: Part, into: ImportedParts) -> None:
    """The look of version 1.0: a coarse and a fine network.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    entries = []
    for file, key in ((VISION, "network_fn_state_dict"), (FINE, "network_fine_state_dict")):
        state = State.of(vision, key)
        weights = _osf(state, "", _FIRST_LAYERS, _FIRST_SKIP, (_OCTAVES, _TURNS))
        into.dropped |= state.dropped()
        entries.append(_one(file, weights, _FIRST_FAR, into))
    into.tree["vision"] = {"kind": "osf", **_FIRST, "network": entries[0], "fine": entries[1]}
    into.missing += _MISSING
    into.missing.append("how rays are sampled: the numbers are the published program's")


def take_look(vision: Part, into: ImportedParts) -> None:
    """The look of version 2.0, of either kind; ``DataRefused`` as ``take_first_look``."""
    settings, state = vision.part("cfg"), State.of(vision, "model_state_dict")
    sampled = _sampling(settings)
    cells = "occupancy_grid" in vision.values or any(np.ndim(value) == 3 for value in state.values.values())
    if cells:
        if sampled["importance"]:
            raise DataRefused(
                f"{settings.name} asks for further samples of a KiloOSF, which the published program has "
                "none of"
            )
        found = _take_cells(vision, settings, state, into)
    else:
        found = _take_osf(settings, state, sampled, into)
    into.dropped |= state.dropped()
    into.tree["vision"] = {**sampled, **found}
    into.missing += _MISSING


def _take_osf(
    settings: Part, state: State, sampled: Mapping[str, Any], into: ImportedParts
) -> dict[str, Any]:
    layers, skip = _whole(settings, "num_hidden_layers", 64), _refeed(settings)
    turns = (_octaves(settings, "num_frequencies"), _octaves(settings, "num_frequencies_direction"))
    two = bool(sampled["importance"])
    weights = _osf(state, "model_coarse." if two else "", layers, skip, turns)
    found: dict[str, Any] = {"kind": "osf", "network": _one(VISION, weights, sampled["far"], into)}
    if two:
        found["fine"] = _one(FINE, _osf(state, "model_fine.", layers, skip, turns), sampled["far"], into)
    return found


def _osf(state: State, prefix: str, layers: int, skip: int | None, octaves: tuple[int, int]) -> OsfWeights:
    trunk = [state.linear(f"{prefix}pts_linears.{k}") for k in range(layers)]
    features, density = state.linear(f"{prefix}bottleneck_linear"), state.linear(f"{prefix}alpha_linear")
    if features[0].shape[0] != density[0].shape[0]:
        raise DataRefused(
            f"{state.name}: bottleneck_linear and alpha_linear take different numbers of inputs"
        )
    heads = tuple(np.concatenate(pair, axis=-1) for pair in zip(features, density, strict=True))
    return OsfWeights(
        MlpWeights((*trunk, (heads[0], heads[1])), () if skip is None else (skip + 1,)),
        state.linear(f"{prefix}views_lights_linears.0"),
        state.linear(f"{prefix}rgb_linear"),
        *(Encoding.octaves(count) for count in octaves),
    )


def _one(file: str, weights: OsfWeights, reach: float, into: ImportedParts) -> NetworkEntry:
    inputs, outputs = osf_tensors(reach)
    random = np.random.default_rng(0)
    asked = {
        "points": random.uniform(-0.6, 0.6, (4, 3)),
        **{name: _directions(random, 4) for name in ("views", "light")},
    }
    doc = "A point, a view and a light of the vision frame to raw colour and density; from a published file."

    def build() -> NetworkEntry:
        graph = osf_graph(weights, inputs, outputs, doc)
        return network_entry(NetworkPart(file, graph, inputs, outputs, asked, TOLERANCE), into.contents)

    return refusing(file, build)


def _take_cells(vision: Part, settings: Part, state: State, into: ImportedParts) -> dict[str, Any]:
    if _refeed(settings) is not None or _whole(settings, "num_hidden_layers", 64) != 2:
        raise DataRefused(f"{settings.name} is of a KiloOSF of other layers than the two published ones")
    low, high = settings.array("global_domain_min", (3,)), settings.array("global_domain_max", (3,))
    cells = _sizes(settings, "fixed_resolution", _MOST_CELLS)
    if not (high > low).all():
        raise DataRefused(
            f"{settings.name} has a cube from {low.tolist()} to {high.tolist()}, which holds nothing"
        )
    layers = {name: state.weights(name, 3) for name in LAYERS}
    count, held = int(np.prod(cells)), {len(bias) for _, bias in layers.values()}
    if held != {count}:
        raise DataRefused(f"{state.name} has {sorted(held)} networks where {settings.name} has {count} cells")
    occupied, voxels = _occupancy(vision, settings)
    chosen = np.flatnonzero(needed_cells(occupied, voxels, cells))
    weights = _chosen(layers, chosen, cells, (low, high), settings)
    files = _cell_files(chosen, count, occupied, into)
    grid = {
        "low": low.tolist(),
        "high": high.tolist(),
        "cells": cells,
        "block": BLOCK,
        "voxels": voxels,
        **files,
    }
    return {"kind": "kilo-osf", "network": _cells(weights, low, high, into), "cells": grid}


def _chosen(
    layers: Mapping[str, tuple[AnyArray, AnyArray]],
    chosen: IntArray,
    cells: tuple[int, int, int],
    cube: tuple[FloatArray, FloatArray],
    settings: Part,
) -> CellWeights:
    """The networks of cells that something is in."""
    low, high = cube
    cell = (high - low) / np.array(cells)
    places = np.stack(np.unravel_index(chosen, cells), axis=1)
    octaves = [
        _octaves(settings, key)
        for key in ("num_frequencies", "num_frequencies_direction", "num_frequencies_light")
    ]
    if octaves[1] != octaves[2]:
        raise DataRefused(
            f"{settings.name} encodes views with {octaves[1]} octaves and lights with {octaves[2]}; "
            "published are 4 and 4"
        )
    kept = {name: (weight[chosen], bias[chosen]) for name, (weight, bias) in layers.items()}
    return CellWeights(kept, low + places * cell, cell, octaves[0], octaves[1])


def _cells(weights: CellWeights, low: FloatArray, high: FloatArray, into: ImportedParts) -> NetworkEntry:
    inputs, outputs = cell_tensors(len(weights), BLOCK, low, high)
    random, rows = np.random.default_rng(0), min(2, len(weights))
    which = np.linspace(0, len(weights) - 1, rows).astype(np.int64)
    points = weights.lows[which][:, None] + random.random((rows, BLOCK, 3)) * weights.cell
    views = _directions(random, rows * BLOCK).reshape(rows, BLOCK, 3)
    asked = {"network": which[:, None], "points": points, "views": views, "light": _directions(random, rows)}
    doc = (
        f"{len(weights)} networks: points, views and light to raw colour and density; from a published file."
    )

    def build() -> NetworkEntry:
        graph = cell_graph(weights, low, high, doc)
        return network_entry(NetworkPart(VISION, graph, inputs, outputs, asked, TOLERANCE), into.contents)

    return refusing(VISION, build)


def _cell_files(
    chosen: IntArray, count: int, occupied: BoolArray | None, into: ImportedParts
) -> dict[str, FileEntry | None]:
    networks = np.full(count, -1)
    networks[chosen] = np.arange(len(chosen))
    into.contents[CELLS] = npy_bytes(networks, "<i4")
    files: dict[str, FileEntry | None] = {
        "networks": file_entry(CELLS, into.contents[CELLS]),
        "occupancy": None,
    }
    if occupied is not None:
        into.contents[OCCUPANCY] = np.packbits(occupied).tobytes()
        files["occupancy"] = file_entry(OCCUPANCY, into.contents[OCCUPANCY])
    return files


def _occupancy(vision: Part, settings: Part) -> tuple[BoolArray | None, tuple[int, int, int] | None]:
    grid = vision.values.get("occupancy_grid")
    if grid is None:
        return None, None
    voxels = _sizes(settings.part("occupancy"), "resolution", _MOST_VOXELS)
    flat = checked(np.asarray(grid).ravel(), (int(np.prod(voxels)),), f"{vision.name}/occupancy_grid")
    if not flat.any():
        raise DataRefused(f"{vision.name}/occupancy_grid is empty: there is nothing to be seen")
    return flat != 0.0, voxels


def needed_cells(
    occupied: BoolArray | None, voxels: tuple[int, int, int] | None, cells: tuple[int, int, int]
) -> BoolArray:
    """``(cells,)``: those that an occupied voxel reaches into; all where nobody says what is occupied."""
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


def _sampling(settings: Part) -> dict[str, Any]:
    if _flag(settings, "llff_lindisp"):
        raise DataRefused(f"{settings.name} samples rays evenly in disparity, as no published object does")
    return {
        "near": settings.number("near"),
        "far": settings.number("far"),
        "samples": _whole(settings, "num_samples_per_ray", 4096),
        "importance": _whole(settings, "num_importance_samples_per_ray", 4096, least=0),
        "white": _flag(settings, "blender_white_background"),
        "colour": "clipped" if _flag(settings, "no_color_sigmoid") else "sigmoid",
    }


def _refeed(settings: Part) -> int | None:
    """The layer behind which the input comes again; written as text where there is none."""
    if settings.values.get("refeed_position_index") in (None, "None"):
        return None
    return _whole(settings, "refeed_position_index", 64, least=0)


def _octaves(settings: Part, key: str) -> int:
    return _whole(settings, key, _MOST_OCTAVES, least=0)


def _whole(settings: Part, key: str, most: int, least: int = 1) -> int:
    number = settings.number(key)
    if number != round(number) or not least <= number <= most:
        raise DataRefused(f"{settings.name}/{key} is {number:g}, not a whole number from {least} to {most}")
    return int(number)


def _sizes(settings: Part, key: str, most: int) -> tuple[int, int, int]:
    x, y, z = settings.array(key, (3,)).tolist()
    if not all(size == round(size) and 1 <= size <= most for size in (x, y, z)):
        raise DataRefused(f"{settings.name}/{key} is {[x, y, z]}, not three whole numbers from 1 to {most}")
    return int(x), int(y), int(z)


def _flag(settings: Part, key: str) -> bool:
    value = settings.values.get(key, False)
    if not isinstance(value, bool | int):
        raise DataRefused(f"{settings.name}/{key} is {value!r}, where true or false belongs")
    return bool(value)


def _directions(random: np.random.Generator, count: int) -> AnyArray:
    drawn = random.normal(size=(count, 3))
    units: AnyArray = (drawn / np.linalg.norm(drawn, axis=1, keepdims=True)).astype(np.float32)
    return units
