"""The tiny networks as one graph, and out of it again.

Samples come in blocks of one network each. ``vision.onnx`` holds every network's weights as they were
given, in float16, by the names of ``vision_kept`` after ``networks.``; what does not depend on the query
(the products of two layers with nothing between) is written as operations on constants, which onnxruntime
computes once when it opens the file.

Inputs: ``network`` int64 ``(n, 1)``; ``points`` float64 ``(n, b, 3)`` metres, object frame; ``views``
float32 ``(n, b, 3)``; ``light`` float32 ``(n, 3)``; for ``osf-v`` ``extras`` float32 ``(n, b, 4)``.
Outputs: ``density`` float32 ``(n, b, 1)``, 1/m; ``scattered`` float32 ``(n, b, 3)``, linear, 0 to 1.

A network that there is not must be left out before: onnxruntime takes -1 for the last one without a word.
"""

from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper, numpy_helper

from harness.arrays import AnyArray
from harness.errors import DataRefused, WrongUse
from harness.objectfile.graph import Nodes
from harness.objectfile.graph_check import checked_graph, declared
from harness.objectfile.vision_kept import WEIGHTS, held_weights, kept_weights
from harness.objectfile.vision_network import BLOCK, NetworkSize, VisionGrid, VisionModel

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
        """``value @ weight + bias``, of the block's network."""
        product = self.nodes.add("MatMul", value, self.of_block(weight))
        return self.nodes.add("Add", product, self.of_block(bias))

    def weights(self, name: str, array: AnyArray) -> str:
        """Those of every network, float32, from what is kept of them: of all that are the same, one."""
        cast = self.nodes.add("Cast", self.kept(f"{WEIGHTS}{name}", array), to=TensorProto.FLOAT)
        count = len(self.model.grid)
        if len(array) == count:
            return cast
        shape = np.array([count, *array.shape[1:]], np.int64)
        return self.nodes.add("Expand", cast, self.nodes.constant(shape))

    def encoded(self, value: str, octaves: int) -> str:
        """As ``vision_plain.encoded``; an octave from the one before by the double angle."""
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
        return nodes.add("Concat", *parts, axis=-1) if octaves else value


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
    """The points in their cells, -1 to 1, computed in float64."""
    nodes = made.nodes
    cells = nodes.add("Cast", made.kept("cells", grid.cells[:, None]), to=TensorProto.DOUBLE)
    moved = nodes.add("Sub", "points", made.kept("low", grid.low))
    scaled = nodes.add("Div", moved, made.kept("cell", np.array(grid.cell)))
    within = nodes.add("Sub", scaled, made.of_block(cells))
    doubled = nodes.add("Mul", within, nodes.constant(np.array(2.0)))
    local = nodes.add("Cast", nodes.add("Sub", doubled, nodes.constant(np.array(1.0))), to=TensorProto.FLOAT)
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
    nodes.add("Mul", raw, scale, name="density")
    of_feature = names["scatter.feature"]
    folded = nodes.add("MatMul", names["feature"], of_feature)
    bias = nodes.add("Add", nodes.add("MatMul", names["feature_bias"], of_feature), names["scatter_bias"])
    lit = nodes.add("Unsqueeze", made.encoded("light", size.turns), nodes.constant(np.array([1], np.int64)))
    lit = nodes.add("MatMul", lit, made.of_block(names["scatter.light"]))
    lit = nodes.add("Add", lit, made.of_block(bias))
    seen, matrix = (
        [hidden, made.encoded("views", size.turns)],
        [folded, names["scatter.view"]],
    )
    if size.extras:
        seen.append("extras")
        matrix.append(names["scatter.extras"])
    every = nodes.add("Concat", *matrix, axis=1)
    product = nodes.add("MatMul", nodes.add("Concat", *seen, axis=-1), made.of_block(every))
    hidden = nodes.add("Relu", nodes.add("Add", product, lit))
    nodes.add("Sigmoid", made.layer(hidden, names["colour"], names["colour_bias"]), name="scattered")


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
        raise DataRefused(
            f"{name} holds networks that do not fit together ({error}); build it again"
        ) from error


def graph_block(data: bytes, name: str = FILE) -> int:
    """Samples of one network that a file's graph is asked together; errors as of ``vision_model``."""
    taken = declared(checked_graph(data, name)).get("points", ("", ()))[1]
    if len(taken) != 3 or not isinstance(taken[1], int):
        raise DataRefused(f"{name} takes points {taken}, not blocks of them; build it again")
    return taken[1]
