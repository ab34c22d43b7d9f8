"""Write the touch of an ObjectFile: codes, their graph and its self-test."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from onnx import ModelProto

from harness.basics.arrays import AnyArray, IntArray
from harness.basics.toml_file import validate
from harness.bench.sensor import TactileSensor
from harness.objectfile.entries import Domain, Input, Provenance, Tensor
from harness.objectfile.file import ObjectFile, file_entry, with_part
from harness.objectfile.network_part import SELF_TEST_VALUES, NetworkPart, network_entry, spread
from harness.objectfile.touch.graph import MOST_TILT
from harness.objectfile.touch.nodes import SurfaceNodes, nodes_bytes
from harness.objectfile.touch_entries import CodesEntry, GelEntry, TouchEntry, ray_pixels
from harness.sim.gel.gel import GelSkirt
from harness.sim.gel.height_map import SEARCH_DEPTH

CODES = "touch.onnx"
NODES = "touch_nodes.npy"

_SELF_TEST_ROWS = 4
_SELF_TEST_DEPTH = 1e-3
_TOLERANCE = 1e-4
"""Of the self-test, of the greatest depth: a hundred times what float32 loses, a tenth of a micrometre."""


@dataclass(frozen=True, eq=False)
class CodesPart:
    """Codes to be written."""

    graph: ModelProto  #: ``touch_graph.codes_graph``.
    nodes: SurfaceNodes  #: the places of the codes.
    most_off: float  #: m, of ``touch_nodes.signatures``, that a press may be from its node.
    measured: Mapping[str, float] = field(default_factory=dict)  #: its errors, by a name with its unit.


@dataclass(frozen=True, eq=False)
class TouchPart:
    """A touch to be written."""

    sensor: TactileSensor  #: a flat gel.
    skirt: GelSkirt  #: of the gel.
    depths: tuple[float, float]  #: m, least and greatest that may be asked.
    most_tilt: float  #: rad.
    near_surface: float  #: m, the farthest from the surface that a press may be.
    provenance: Provenance  #: of the touch.
    codes: CodesPart  #: the network.


def with_touch(of: ObjectFile, part: TouchPart) -> ObjectFile:
    """The ObjectFile with this touch written into it.

    Raises:
        WrongUse: numbers that cannot be.
        DataRefused: a graph that must not be run, or that takes or gives something else than touch.
    """
    contents: dict[str, bytes] = {}
    described = {
        "gel": GelEntry.of(part.sensor, part.skirt),
        "depth_m": part.depths,
        "most_tilt_rad": part.most_tilt,
        "near_surface_m": part.near_surface,
        "codes": _codes(part, contents),
        "provenance": part.provenance,
    }
    entry = validate(described, TouchEntry, f"the touch of {of.description.name}")
    return with_part(of, "touch", entry, contents)


def codes_tensors(
    count: int, reach: float, sensor: TactileSensor
) -> tuple[tuple[Input, Input], tuple[Tensor, Tensor]]:
    """What every graph of codes takes and gives.

    Args:
        count: of nodes.
        reach: m, the farthest that the gel's centre may be from its node.
        sensor: gives rows and columns.
    """
    limits = np.ones((3, 4))
    limits[:, 3] = reach
    most = tuple(limits.ravel().tolist())
    node = Input(
        name="node",
        dtype="int64",
        shape=("n", 1),
        unit="1",
        meaning="whose code is taken, counted from 0, as in the file of nodes",
        domain=Domain(low=(0.0,), high=(count - 1.0,)),
        normaliser="in the graph",
    )
    pose = Input(
        name="node_from_gel",
        dtype="float64",
        shape=("n", 3, 4),
        unit="m",
        meaning="the gel's pose: the upper rows of a rigid transform",
        frame="node",
        domain=Domain(low=tuple(-each for each in most), high=most),
        normaliser="in the graph",
    )
    maps = Tensor(
        name="maps",
        dtype="float32",
        shape=("n", sensor.rows, sensor.columns),
        unit="m",
        meaning="how far the gel is pressed in",
        frame="gel",
    )
    every = ray_pixels(sensor.rows, sensor.columns)
    gaps = Tensor(
        name="gaps",
        dtype="float32",
        shape=("n", sensor.rows // every, sensor.columns // every),
        unit="m",
        meaning=f"from the gel's plane to the object, of rays {every} pixels apart; {SEARCH_DEPTH:g} beyond",
        frame="gel",
    )
    return (node, pose), (maps, gaps)


def _codes(part: TouchPart, contents: dict[str, bytes]) -> CodesEntry:
    codes, count, deepest = part.codes, len(part.codes.nodes), part.sensor.gel_thickness
    inputs, outputs = codes_tensors(count, codes.most_off + deepest, part.sensor)
    chosen = np.linspace(0, count - 1, _SELF_TEST_ROWS).astype(np.int64)[:, None]
    poses = np.tile(np.eye(4)[:3], (_SELF_TEST_ROWS, 1, 1))
    poses[:, 2, 3] = _SELF_TEST_DEPTH
    asked = {"node": chosen, "node_from_gel": poses}
    contents[NODES] = nodes_bytes(codes.nodes)
    written = NetworkPart(CODES, codes.graph, inputs, outputs, asked, _TOLERANCE, codes.measured, _seen)
    return CodesEntry(
        network=network_entry(written, contents),
        nodes=file_entry(NODES, contents[NODES]),
        most_off_m=codes.most_off,
        deepest_m=deepest,
        most_tilt_rad=MOST_TILT,
    )


def _seen(found: AnyArray) -> IntArray:
    """Half of the places where most is to be seen: most of a map is zero."""
    deepest = np.argsort(found, kind="stable")[-SELF_TEST_VALUES // 2 :: 4]
    return np.unique(np.concatenate([spread(found), deepest]))
