"""The tiny networks as one graph, and out of it again.

Samples come in blocks of one network each. ``vision.onnx`` holds every network's weights as they were
given, in float16, by the names of ``vision_kept`` after ``networks.``; what does not depend on the query
(the products of two layers with nothing between) is written as operations on constants, which onnxruntime
computes once when it opens the file.

Inputs: ``network`` int64 ``(n, 1)``; ``points`` float64 ``(n, b, 3)`` metres, object frame; ``views``
float32 ``(n, b, 3)``; ``light`` float32 ``(n, 3)``; for ``osf-v`` ``extras`` float32 ``(n, b, 4)``.
Outputs: ``density`` float32 ``(n, b, 1)``, 1/m; ``scattered`` float32 ``(n, b, 3)``, linear, 0 to 1.

Within, a sample is a column: what it is told is put together from whole rows, and the smaller factor of a
product is the one that is packed. Rows of views that are 0 in every network, as of all that are matt, are
not asked: ``views`` is then taken and not looked at.

A network that there is not must be left out before: onnxruntime takes -1 for the last one without a word.
"""

from dataclasses import dataclass

import numpy as np
import onnx
from onnx import ModelProto, TensorProto, helper, numpy_helper

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.graph import Nodes
from harness.objectfile.graph_check import checked_graph, declared
from harness.objectfile.vision.network.network import BLOCK, NetworkSize, VisionGrid, VisionModel
from harness.objectfile.vision.network.plain import looks
from harness.objectfile.vision.network.weights_codec import WEIGHTS, held_weights, kept_weights

FILE = "vision.onnx"

_NEEDED = ("low", "cell", "cells", "density_scale")


@dataclass
class _Blocks:
    """The graph under construction.

    Attributes:
        model: written.
        nodes: so far.
        names: of constants by theirs.
        network: name of the flat input.
    """

    model: VisionModel
    nodes: Nodes
    names: dict[str, str]
    network: str

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
        cast = self.nodes.add("Cast", self.kept(f"{WEIGHTS}{name}", array), to=TensorProto.FLOAT)
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
    """The graph of an object's look.

    Args:
        model: its weights are kept as float16.
        block: samples of one network that are asked together.

    Raises:
        WrongUse: weights that float16 cannot hold, or an empty block.
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
    hidden = nodes.add("Relu", nodes.add("Add", product, _lit(made, size)))
    colour = made.layer(hidden, names["colour"], names["colour_bias"])
    made.turned(nodes.add("Sigmoid", colour), name="scattered")


def _lit(made: _Blocks, size: NetworkSize) -> str:
    """What of the layer that sees directions is the same for all samples of a block."""
    nodes, names = made.nodes, made.names
    folded = nodes.add("MatMul", names["scatter.feature"], names["feature_bias"])
    bias = nodes.add("Add", folded, names["scatter_bias"])
    code = nodes.add("Unsqueeze", made.encoded("light", size.turns), nodes.constant(np.array([2], np.int64)))
    product = nodes.add("MatMul", made.of_block(names["scatter.light"]), code)
    return nodes.add("Add", product, made.of_block(bias))


def _seen(made: _Blocks, size: NetworkSize, hidden: str) -> tuple[str, str]:
    """The rest of that layer's weights, and what they multiply."""
    nodes, names = made.nodes, made.names
    matrix = [nodes.add("MatMul", names["scatter.feature"], names["feature"])]
    seen = [hidden]
    if looks(made.model.weights):
        matrix.append(names["scatter.view"])
        seen.append(made.encoded(made.turned("views"), size.turns))
    if size.extras:
        matrix.append(names["scatter.extras"])
        seen.append(made.turned("extras"))
    if len(seen) == 1:
        return matrix[0], hidden
    return nodes.add("Concat", *matrix, axis=2), nodes.add("Concat", *seen, axis=1)


def vision_model(data: bytes, name: str = FILE) -> VisionModel:
    """The networks of a file, bit for bit as they were kept.

    The arrays are believed by their names and shapes; that the graph computes the same is what the graph's
    own level is for.

    Raises:
        DataRefused: it is no graph, one that must not be run, or not one of ``vision_graph``.
    """
    model = checked_graph(data, name)
    held = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    missing = [key for key in _NEEDED if key not in held]
    if missing:
        raise DataRefused(
            f"{name} holds no {missing[0]!r}: it is no graph of networks of vision; build it again"
        )
    try:
        grid = VisionGrid(held["low"], held["cell"].item(), held["cells"].reshape(-1, 3))
        told = "extras" in declared(model)
        return VisionModel(grid, held_weights(held, len(grid), told, held["density_scale"].item()))
    except KeyError as error:
        raise DataRefused(
            f"{name} holds no {error}: it is no graph of networks of vision; build it again"
        ) from error
    except (WrongUse, IndexError, ValueError, TypeError) as error:
        raise DataRefused(f"{name} holds networks that do not fit together; build it again") from error


def graph_block(data: bytes, name: str = FILE) -> int:
    """Samples of one network that a file's graph takes together.

    Args:
        data: of a file that ``vision_model`` has read, and so looked through.
        name: of the file, for messages.

    Raises:
        DataRefused: its points are no blocks.
    """
    taken = declared(onnx.load_model_from_string(data)).get("points", ("", ()))[1]
    if len(taken) != 3 or not isinstance(taken[1], int):
        raise DataRefused(f"{name} takes points {taken}, not blocks of them; build it again")
    return taken[1]
