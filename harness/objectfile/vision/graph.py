"""The tiny networks as one ONNX graph: writing its file, and asking it.

Samples come in blocks of one network each. ``vision.onnx`` holds every network's weights as they were
given, in float16, what is the same in every network once; what does not depend on the query (the products of
two layers with nothing between) is written as operations on constants, which onnxruntime computes once when
it opens the file.

Inputs: ``network`` int64 ``(n, 1)``; ``points`` float64 ``(n, b, 3)`` metres, object frame; ``views``
float32 ``(n, b, 3)``; ``light`` float32 ``(n, 3)``; for ``osf-v`` ``extras`` float32 ``(n, b, 4)``.
Outputs: ``density`` float32 ``(n, b, 1)``, 1/m; ``scattered`` float32 ``(n, b, 3)``, linear, 0 to 1.

Within, a sample is a column: what it is told is put together from whole rows, and the smaller factor of a
product is the one that is packed. Rows of views that are 0 in every network, as of all that are matt, are
not asked: ``views`` is then taken and not looked at. Of a matt object told its normal the rows of the
feature, which is trained as one with the layer before, are the identity: 1728 of a compact network's 6052
numbers are kept once.

A network that there is not must be left out before: onnxruntime takes -1 for the last one without a word.
"""

from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper, numpy_helper

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.entries import Input, Tensor
from harness.objectfile.graph import Nodes
from harness.objectfile.graph_check import checked_graph, declared
from harness.objectfile.runtime import Network
from harness.objectfile.vision.network import (
    BLOCK,
    NetworkSize,
    VisionGrid,
    VisionModel,
    VisionWeights,
    scatter_rows,
)
from harness.objectfile.vision_tensors import EXTRAS, Kind, box_tensors

FILE = "vision.onnx"

_WEIGHTS = "networks."
"""Before the names of weights; outputs have names of their own."""

_NEEDED = ("low", "cell", "cells", "density_scale")

_AT_ONCE = 128
"""Blocks in a run of the graph: what it computes between then stays in a cache."""


@dataclass(frozen=True, eq=False)
class Answers:
    """Outputs of the networks for points of a surface."""

    known: BoolArray
    """``(n,)`` whether a network is where the point is; what follows has no meaning where none is."""
    density: AnyArray  #: ``(n,)`` float32, 1/m.
    scattered: AnyArray  #: ``(n, 3)`` float32, linear red, green and blue, 0 to 1.


class VisionNetworks:
    """The networks of a file, ready to be asked.

    Args:
        data: of ``vision.onnx``.
        name: of the file, for messages.
        threads: that one run may use.

    Raises:
        DataRefused: it is no graph, one that must not be run, or not one of ``vision_graph``.
    """

    def __init__(self, data: bytes, name: str = FILE, threads: int = 1) -> None:
        model = checked_graph(data, name)
        held = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
        taken = declared(model)
        missing = [key for key in _NEEDED if key not in held]
        if missing or len(taken.get("points", ("", ()))[1]) != 3:
            lacks = f"holds no {missing[0]!r}" if missing else "takes no blocks of points"
            raise DataRefused(f"{name} {lacks}: it is no graph of networks of vision; build it again")
        try:
            self.grid = VisionGrid(held["low"], held["cell"].item(), held["cells"].reshape(-1, 3))
            self.density_scale: float = held["density_scale"].item()
            kind: Kind = "osf-v" if "extras" in taken else "osf"
            place, wide = held[f"{_WEIGHTS}first"].shape[1:]
            # Older files store ``scatter`` in full.
            if f"{_WEIGHTS}scatter" in held:
                direction = (held[f"{_WEIGHTS}scatter"].shape[1] - wide - EXTRAS[kind]) // 2
            else:
                direction = held[f"{_WEIGHTS}scatter.light"].shape[1]
            self.size = NetworkSize(wide, (place - 3) // 6, (direction - 3) // 6, kind)
        except (KeyError, WrongUse, IndexError, ValueError, TypeError) as error:
            raise DataRefused(f"{name} holds networks that do not fit together; build it again") from error
        block = taken["points"][1][1]
        if not isinstance(block, int):
            raise DataRefused(f"{name} takes points in blocks of {block!r}, not of a number; build it again")
        self.block = block
        inputs, outputs = vision_tensors(self.grid, self.size, block)
        self.network = Network(data, name, inputs, outputs, threads)

    def ask(self, points: FloatArray, views: AnyArray, light: AnyArray, extras: AnyArray) -> Answers:
        """Ask the network of each point's cell, sorted by cell into the graph's blocks.

        Args:
            points: ``(n, 3)`` m, object frame.
            views: ``(n, 3)`` float32 unit, from the camera.
            light: ``(3,)`` float32 unit, towards the lamp.
            extras: ``(n, 4)`` float32, visibility and normal; not looked at by networks that are not told.
        """
        networks = self.grid.networks(points)
        shape = (len(points), 3)
        found = Answers(networks >= 0, np.empty(shape[0], np.float32), np.empty(shape, np.float32))
        asked, of_block = sort_into_blocks(networks, len(self.grid), self.block)
        for first in range(0, len(asked), _AT_ONCE):
            at = asked[first : first + _AT_ONCE]
            inputs = {
                "network": of_block[first : first + _AT_ONCE, None],
                "points": points[at],
                "views": views[at],
                "light": np.tile(light, (len(at), 1)),
            }
            answers = self.network(inputs | ({"extras": extras[at]} if self.size.extras else {}))
            found.density[at], found.scattered[at] = answers["density"][:, :, 0], answers["scattered"]
        return found


@compiled
def sort_into_blocks(networks: IntArray, every: int, size: int) -> tuple[IntArray, IntArray]:
    """Sort points by network into blocks.

    A block that is not full asks for its last point again, so that all there is is asked. A network that
    there is not is left out: onnxruntime takes -1 for the last one without a word.

    Args:
        networks: ``(n,)`` of each point; -1 where none answers.
        every: networks that there are.
        size: of a block.

    Returns:
        ``(blocks, size)`` points, and ``(blocks,)`` network of each block.
    """
    counts, firsts = np.zeros(every, np.int64), np.empty(every, np.int64)
    for network in networks:
        if network >= 0:
            counts[network] += 1
    blocks = 0
    for network in range(every):
        firsts[network] = blocks
        blocks += (counts[network] + size - 1) // size
    points, of_block = np.empty((blocks, size), np.int64), np.empty(blocks, np.int64)
    filled = np.zeros(every, np.int64)
    for n in range(len(networks)):
        network = networks[n]
        if network >= 0:
            block, lane = firsts[network] + filled[network] // size, filled[network] % size
            of_block[block] = network
            filled[network] += 1
            last = lane + 1 if filled[network] < counts[network] else size
            for k in range(lane, last):
                points[block, k] = n
    return points, of_block


def vision_tensors(
    grid: VisionGrid, size: NetworkSize, block: int = BLOCK
) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """Describe the inputs and outputs of ``vision_graph``; ``block`` samples share a network."""
    (a, b, c), (d, e, f) = grid.low.tolist(), grid.high.tolist()
    return box_tensors(len(grid), ((a, b, c), (d, e, f)), size.extras, block)


@dataclass
class _Blocks:
    """The graph under construction."""

    model: VisionModel  #: written.
    nodes: Nodes  #: so far.
    names: dict[str, str]  #: of constants by theirs.
    network: str  #: name of the flat input.

    def kept(self, name: str, array: AnyArray) -> str:
        """A constant that is read back by its name."""
        self.nodes.constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def of_block(self, every: str) -> str:
        """Rows of the block's network."""
        return self.nodes.add("Gather", every, self.network, axis=0)

    def layer(self, value: str, weight: str, bias: str) -> str:
        """``weight @ value + bias``, of the block's network."""
        product = self.nodes.add("MatMul", self.of_block(weight), value)
        return self.nodes.add("Add", product, self.of_block(bias))

    def weights(self, name: str, array: AnyArray) -> str:
        """Those of every network, float32 and transposed, from what is kept of them: of all alike, one."""
        cast = self.nodes.add("Cast", self.kept(f"{_WEIGHTS}{name}", array), to=TensorProto.FLOAT)
        turned, count = self.turned(cast), len(self.model.grid)
        if len(array) == count:
            return turned
        shape = np.array([count, *array.shape[:0:-1]], np.int64)
        return self.nodes.add("Expand", turned, self.nodes.constant(shape))

    def turned(self, value: str, name: str = "") -> str:
        """Rows for columns: what a sample is told is a column within, so that copies are of whole rows."""
        return self.nodes.add("Transpose", value, perm=[0, 2, 1], name=name)

    def encoded(self, value: str, octaves: int) -> str:
        """As ``vision_plain.encoded``, along axis 1; an octave from the one before by the double angle."""
        parts, nodes = [value], self.nodes
        one, two = nodes.constant(np.array(1.0, np.float32)), nodes.constant(np.array(2.0, np.float32))
        for k in range(octaves):
            if k == 0:
                sine, cosine = nodes.add("Sin", value), nodes.add("Cos", value)
            else:
                twice = nodes.add("Mul", two, sine)
                sine, cosine = (
                    nodes.add("Mul", twice, cosine),
                    nodes.add("Sub", one, nodes.add("Mul", twice, sine)),
                )
            parts += [sine, cosine]
        return nodes.add("Concat", *parts, axis=1) if octaves else value


def vision_graph(model: VisionModel, block: int = BLOCK) -> ModelProto:
    """Write the graph of an object's vision, with float16 weights, for blocks of samples of one network.

    Raises:
        WrongUse: weights outside the range of float16, or an empty block.
    """
    if not 1 <= block <= 1024:
        raise WrongUse(f"blocks of {block} samples were asked for; 1 to 1024 are made")
    weights, size, nodes = model.weights.rounded(), model.weights.size, Nodes()
    flat = nodes.add("Reshape", "network", nodes.constant(np.array([-1])))
    made = _Blocks(model, nodes, {}, flat)
    for name, array in kept_weights(weights).items():
        made.names[name] = made.weights(name, array)
    _networks(made, size, _local(made, model.grid))
    inputs = [
        helper.make_tensor_value_info("network", TensorProto.INT64, ["n", 1]),
        helper.make_tensor_value_info("points", TensorProto.DOUBLE, ["n", block, 3]),
        helper.make_tensor_value_info("views", TensorProto.FLOAT, ["n", block, 3]),
        helper.make_tensor_value_info("light", TensorProto.FLOAT, ["n", 3]),
    ]
    if size.extras:
        inputs.append(helper.make_tensor_value_info("extras", TensorProto.FLOAT, ["n", block, size.extras]))
    outputs = [
        helper.make_tensor_value_info("density", TensorProto.FLOAT, ["n", block, 1]),
        helper.make_tensor_value_info("scattered", TensorProto.FLOAT, ["n", block, 3]),
    ]
    doc = f"{len(model.grid)} networks: places, views and light to density (1/m) and scattered fraction."
    return nodes.model("vision", inputs, outputs, doc)


def kept_weights(weights: VisionWeights) -> dict[str, AnyArray]:
    """Give the arrays that a file keeps, by name: ``scatter`` in four parts, ``scatter.feature`` and so on.

    Returns:
        Of each name ``(networks, rows, columns)``, of biases one row; ``(1, rows, columns)`` where every
        network has the same bits. A part without rows is not among them.
    """
    kept: dict[str, AnyArray] = {}
    for name, array in weights.arrays():
        if name == "scatter":
            kept |= {f"{name}.{part}": array[:, at] for part, at in scatter_rows(weights.size).items()}
        else:
            kept[name] = array[:, None] if name.endswith("bias") else array
    once: dict[str, AnyArray] = {}
    for name, array in kept.items():
        # Compared as bits: zeros of two signs are not the same.
        bits = np.ascontiguousarray(array).view(np.uint16)
        if array.size:
            once[name] = array[:1] if (bits == bits[:1]).all() else array
    return once


def _local(made: _Blocks, grid: VisionGrid) -> str:
    """The points in their cells, -1 to 1, computed in float64; ``(n, 3, b)``."""
    nodes = made.nodes
    cells = nodes.add("Cast", made.kept("cells", grid.cells[:, None]), to=TensorProto.DOUBLE)
    cell, half = made.kept("cell", np.array(grid.cell)), nodes.constant(np.array(0.5))
    middles = nodes.add("Mul", nodes.add("Add", cells, half), cell)
    middles = nodes.add("Add", middles, made.kept("low", grid.low))
    moved = nodes.add("Sub", "points", made.of_block(middles))
    scaled = nodes.add("Div", moved, nodes.add("Mul", cell, half))
    local = made.turned(nodes.add("Cast", scaled, to=TensorProto.FLOAT))
    least, most = (nodes.constant(np.array([end], np.float32)) for end in (-1.0, 1.0))
    return nodes.add("Min", nodes.add("Max", local, least), most)


def _networks(made: _Blocks, size: NetworkSize, local: str) -> None:
    nodes, names = made.nodes, made.names
    hidden = nodes.add(
        "Relu", made.layer(made.encoded(local, size.octaves), names["first"], names["first_bias"])
    )
    hidden = nodes.add("Relu", made.layer(hidden, names["second"], names["second_bias"]))
    raw = nodes.add("Relu", made.layer(hidden, names["density"], names["density_bias"]))
    scale = made.kept("density_scale", np.array(made.model.weights.density_scale, np.float32))
    made.turned(nodes.add("Mul", raw, scale), name="density")
    matrix, seen = _seen(made, size, hidden)
    product = nodes.add("MatMul", made.of_block(matrix), seen)
    # What of the layer that sees directions is the same for all samples of a block.
    folded = nodes.add("MatMul", names["scatter.feature"], names["feature_bias"])
    bias = nodes.add("Add", folded, names["scatter_bias"])
    code = nodes.add("Unsqueeze", made.encoded("light", size.turns), nodes.constant(np.array([2], np.int64)))
    turned = nodes.add("MatMul", made.of_block(names["scatter.light"]), code)
    lit = nodes.add("Add", turned, made.of_block(bias))
    hidden = nodes.add("Relu", nodes.add("Add", product, lit))
    colour = made.layer(hidden, names["colour"], names["colour_bias"])
    made.turned(nodes.add("Sigmoid", colour), name="scattered")


def _seen(made: _Blocks, size: NetworkSize, hidden: str) -> tuple[str, str]:
    """The rest of that layer's weights, and what they multiply."""
    nodes, names = made.nodes, made.names
    matrix = [nodes.add("MatMul", names["scatter.feature"], names["feature"])]
    seen = [hidden]
    # Some row of views is not 0: a network may answer otherwise from another side.
    if made.model.weights.scatter[:, scatter_rows(size)["view"]].any():
        matrix.append(names["scatter.view"])
        seen.append(made.encoded(made.turned("views"), size.turns))
    if size.extras:
        matrix.append(names["scatter.extras"])
        seen.append(made.turned("extras"))
    if len(seen) == 1:
        return matrix[0], hidden
    return nodes.add("Concat", *matrix, axis=2), nodes.add("Concat", *seen, axis=1)
