"""Graphs of imported perceptrons, from plain arrays: sound, touch, and the look of one network."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, ValueInfoProto, helper

from harness.basics.arrays import AnyArray
from harness.objectfile.entries import Tensor
from harness.objectfile.graph import Encoding, MlpWeights, Nodes, Normaliser, check_mlp, encoded_rows
from harness.objectfile.published.tensors import Pair

POSITIONS = Encoding.octaves(10)
"""Of sound and touch."""


def perceptron_graph_of(
    tensors: Pair,
    branches: Sequence[MlpWeights],
    normaliser: Normaliser,
    doc: str,
    encoding: Encoding = POSITIONS,
) -> ModelProto:
    """Perceptrons side by side on one encoded input.

    Args:
        tensors: taken and given; what is given ends in one axis of the branches, if they are several.
        branches: each of as many outputs.
        normaliser: of the input, in float64; the published programs round once, to float32, behind it.
        doc: what the graph is.
        encoding: of the normalised input.

    Raises:
        WrongUse: layers that do not fit together, or weights that are not finite.
    """
    taken, given = tensors
    count = len(normaliser.shift)
    nodes, rows = Nodes(), encoded_rows(count, encoding)
    encoded = nodes.encoded(nodes.normalised(taken.name, normaliser), count, encoding)
    flat = []
    for number, branch in enumerate(branches):
        what = f"branch {number} of {given.name}"
        check_mlp(branch, encoding.width(count), what)
        flat.append(nodes.mlp(encoded, branch, rows, what))
    if len(flat) == 1:
        nodes.add("Identity", flat[0], name=given.name)
    else:
        last = nodes.constant(np.array([2]))
        nodes.add("Concat", *(nodes.add("Unsqueeze", part, last) for part in flat), axis=2, name=given.name)
    return nodes.model(given.name, [value_of(taken)], [value_of(given)], doc)


@dataclass(frozen=True, eq=False)
class OsfWeights:
    """One network of a look (NeRF's layout with the light beside the view).

    Attributes:
        trunk: on the encoded position; its outputs are the ``w`` features and then the raw density.
        direction: ``(w + views + lights, v)`` and ``(v,)``: features, encoded view, encoded light.
        colour: ``(v, 3)`` and ``(3,)``.
        positions: encoding of the position.
        directions: encoding of view and light alike.
    """

    trunk: MlpWeights
    direction: tuple[AnyArray, AnyArray]
    colour: tuple[AnyArray, AnyArray]
    positions: Encoding
    directions: Encoding


def osf_graph(
    weights: OsfWeights, inputs: Sequence[Tensor], outputs: Sequence[Tensor], doc: str
) -> ModelProto:
    """The network as a graph; tensors are those of ``osf_tensors``.

    Raises:
        WrongUse: layers that do not fit together, or weights that are not finite.
    """
    _check(weights)
    nodes, width = Nodes(), weights.trunk.outputs - 1
    positions, directions = weights.positions, weights.directions
    encoded = nodes.encoded(nodes.add("Cast", "points", to=TensorProto.FLOAT), 3, positions)
    both = nodes.mlp(encoded, weights.trunk, encoded_rows(3, positions), "the trunk")
    features = nodes.add("Slice", both, *(nodes.constant(np.array([k])) for k in (0, width, 1)))
    nodes.add(
        "Slice", both, *(nodes.constant(np.array([k])) for k in (width, width + 1, 1)), name="density_raw"
    )
    told = [nodes.encoded(name, 3, directions) for name in ("views", "light")]
    matrix, bias = weights.direction
    turned = direction_rows(np.asarray(matrix), width, directions)
    joined = nodes.add("Concat", features, *told, axis=1)
    hidden = nodes.add("Relu", _layer(nodes, joined, turned, bias, "the direction layer"))
    nodes.add("Identity", _layer(nodes, hidden, *weights.colour, "the colour layer"), name="colour_raw")
    return nodes.model(
        "vision", [value_of(item) for item in inputs], [value_of(item) for item in outputs], doc
    )


def direction_rows(matrix: AnyArray, width: int, encoding: Encoding) -> AnyArray:
    """Rows ``[features, view, light]`` of NeRF's order in the order of ``Nodes.encoded``."""
    rows, count = encoded_rows(3, encoding), encoding.width(3)
    view, light = matrix[width : width + count], matrix[width + count :]
    return np.concatenate([matrix[:width], view[rows], light[rows]])


def value_of(tensor: Tensor) -> ValueInfoProto:
    """The declaration of an input or output."""
    kind = helper.np_dtype_to_tensor_dtype(np.dtype(tensor.dtype))
    return helper.make_tensor_value_info(tensor.name, kind, list(tensor.shape))


def _layer(nodes: Nodes, value: str, matrix: AnyArray, bias: AnyArray, what: str) -> str:
    return nodes.add("Gemm", value, nodes.weight(matrix, what), nodes.weight(bias, what))


def _check(weights: OsfWeights) -> None:
    check_mlp(weights.trunk, weights.positions.width(3), "the trunk")
    inputs = weights.trunk.outputs - 1 + 2 * weights.directions.width(3)
    check_mlp(MlpWeights((weights.direction, weights.colour)), inputs, "the colour's layers")
