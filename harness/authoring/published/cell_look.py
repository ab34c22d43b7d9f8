"""The look of a KiloOSF, a network a cell, as tables and a graph of ours; empty cells are left out."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.authoring.published.layout import FileTable, State, checked
from harness.authoring.published.senses import TOLERANCE, ImportedParts, refusing
from harness.authoring.published.settings import octaves_of, refeed, sizes, unit_vectors, whole
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import FileEntry, NetworkEntry
from harness.objectfile.file import file_entry
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.cell_graph import BLOCK, LAYERS, CellWeights, cell_graph
from harness.objectfile.published.tensors import cell_tensors

VISION, CELLS, OCCUPANCY = "vision.onnx", "vision_cells.npy", "vision_occupancy.bits"

_MOST_CELLS = 64
"""Along a side; published are 16."""

_MOST_VOXELS = 1024
"""Along a side; published are 256."""


def take_cells(vision: FileTable, settings: FileTable, state: State, into: ImportedParts) -> dict[str, Any]:
    """The tables of a KiloOSF, its files among the contents.

    Args:
        vision: the sense.
        settings: of it.
        state: its weights.
        into: takes the files.

    Raises:
        DataRefused: layers, cells or an occupancy that do not fit together, or of another layout.
    """
    if refeed(settings) is not None or whole(settings, "num_hidden_layers", 64) != 2:
        raise DataRefused(f"{settings.name} is of a KiloOSF of other layers than the two published ones")
    low, high = settings.array("global_domain_min", (3,)), settings.array("global_domain_max", (3,))
    cells = sizes(settings, "fixed_resolution", _MOST_CELLS)
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
    settings: FileTable,
) -> CellWeights:
    """The networks of cells that something is in."""
    low, high = cube
    cell = (high - low) / np.array(cells)
    places = np.stack(np.unravel_index(chosen, cells), axis=1)
    octaves = [
        octaves_of(settings, key)
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
    views = unit_vectors(random, rows * BLOCK).reshape(rows, BLOCK, 3)
    asked = {"network": which[:, None], "points": points, "views": views, "light": unit_vectors(random, rows)}
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


def _occupancy(
    vision: FileTable, settings: FileTable
) -> tuple[BoolArray | None, tuple[int, int, int] | None]:
    grid = vision.values.get("occupancy_grid")
    if grid is None:
        return None, None
    voxels = sizes(settings.part("occupancy"), "resolution", _MOST_VOXELS)
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
