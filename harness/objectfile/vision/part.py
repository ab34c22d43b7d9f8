"""Writing the look of an ObjectFile: its graph, the surface it is drawn along, its self-test."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.mesh import Mesh
from harness.basics.toml_file import validate
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, file_entry, with_part
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.surface_file import ply_bytes
from harness.objectfile.vision.graph import FILE, vision_graph, vision_tensors
from harness.objectfile.vision.network import BLOCK, DEEP, PER_CELL, VisionModel
from harness.objectfile.vision_entry import VisionEntry

SURFACE = "vision_surface.ply"

_SELF_TEST_BLOCKS = 4
_TOLERANCE = 1e-3
"""Of the self-test, of the greatest number of an output: what ways to ask the networks may differ by."""


@dataclass(frozen=True, eq=False)
class VisionPart:
    """A look to be written."""

    model: VisionModel  #: networks, and where each answers; kept as float16.
    provenance: Provenance  #: of the look.
    measured: Mapping[str, float] = field(default_factory=dict)  #: its errors, by a name with its unit.
    surface: Mesh | None = None
    """in metres, what pictures are drawn along; None where that is the object's mesh."""
    block: int = BLOCK  #: samples of one network that the graph is asked together.


def with_vision(of: ObjectFile, part: VisionPart) -> ObjectFile:
    """The ObjectFile with this look written into it.

    Raises:
        WrongUse: weights that float16 cannot hold, or a block that cannot be.
        DataRefused: networks of another object than the surface, or a graph that must not be run.
    """
    model, grid, size = part.model, part.model.grid, part.model.weights.size
    grid.require_surface(of.mesh if part.surface is None else part.surface)
    contents: dict[str, bytes] = {}
    graph = vision_graph(model, part.block)
    inputs, outputs = vision_tensors(grid, size, part.block)
    asked = blocks_inside(model, _SELF_TEST_BLOCKS, part.block, np.random.default_rng(0))
    written = NetworkPart(FILE, graph, inputs, outputs, asked, _TOLERANCE, part.measured)
    network = network_entry(written, contents)
    surface = None
    if part.surface is not None:
        contents[SURFACE] = ply_bytes(part.surface)
        surface = file_entry(SURFACE, contents[SURFACE])
    described = {
        "level": size.kind,
        # As the graph holds it.
        "density_per_m": float(np.float32(model.weights.density_scale)),
        "grid": {
            "low_m": grid.low.tolist(),
            "cell_m": grid.cell,
            "cells": grid.shape.tolist(),
            "networks": len(grid),
        },
        "size": {"width": size.width, "octaves": size.octaves, "turns": size.turns, "block": part.block},
        "shell": {"voxels_per_cell": PER_CELL, "deep_voxels": DEEP},
        "network": network,
        "surface": surface,
        "provenance": part.provenance,
    }
    entry = validate(described, VisionEntry, f"the look of {of.description.name}")
    return with_part(of, "vision", entry, contents)


def blocks_inside(
    model: VisionModel, count: int, block: int, random: np.random.Generator
) -> dict[str, AnyArray]:
    """Sample ``count`` blocks of queries, each in the cell of its network, in the order of the cells."""
    grid, extras = model.grid, model.weights.size.extras
    networks = np.linspace(0, len(grid) - 1, count).astype(np.int64)
    shares = random.random((count, block, 3))
    asked: dict[str, AnyArray] = {
        "network": networks[:, None],
        "points": grid.low + grid.cell * (grid.cells[networks][:, None] + shares),
        "views": _unit(random, (count, block, 3)),
        "light": _unit(random, (count, 3)),
    }
    if extras:
        seen = np.round(random.random((count, block, 1))).astype(np.float32)
        asked["extras"] = np.concatenate([seen, _unit(random, (count, block, 3))], axis=2)
    return asked


def _unit(random: np.random.Generator, shape: tuple[int, ...]) -> AnyArray:
    drawn = random.standard_normal(shape)
    return np.asarray((drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)).astype(np.float32))
