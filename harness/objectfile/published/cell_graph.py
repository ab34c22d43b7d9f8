"""The graph of a KiloOSF: thousands of tiny networks, queried in blocks of samples of one network each.

Its encoding counts otherwise than NeRF's: coordinate by coordinate, the cosines before the sines
(Reiser et al., KiloNeRF, 2021, and its published code). The first rows of each matrix are put into the order
of ``Nodes.encoded``, so that the graph is the same as any other.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.objectfile.graph import Encoding, Nodes
from harness.objectfile.published.graphs import value_of
from harness.objectfile.published.tensors import cell_tensors

BLOCK = 64
"""Samples of one network that are queried together."""

LAYERS = ("pts_linears.0", "pts_linears.1", "alpha_linear", "feature_linear", "direction_layer", "rgb_linear")
"""By the names of the published files."""


@dataclass(frozen=True, eq=False)
class CellWeights:
    """The networks of a KiloOSF.

    Attributes:
        layers: by ``LAYERS``, ``(networks, in, out)`` and ``(networks, out)``: ``y = x @ weight + bias``.
        lows: ``(networks, 3)`` least corner of each network's cell.
        cell: ``(3,)`` sides of a cell.
        positions: octaves of the position.
        directions: octaves of view and light.
    """

    layers: Mapping[str, tuple[AnyArray, AnyArray]]
    lows: FloatArray
    cell: FloatArray
    positions: int
    directions: int

    def __len__(self) -> int:
        return len(self.lows)


def kilo_rows(octaves: int) -> IntArray:
    """Which number of KiloNeRF's encoding of three coordinates is at each place of ``Nodes.encoded``'s."""
    first = np.arange(3) * (1 + 2 * octaves)
    octave = 1 + np.arange(octaves)[:, None]
    cosines, sines = (first + octave).ravel(), (first + octaves + octave).ravel()
    return np.concatenate([first, sines, cosines])


def cell_graph(
    weights: CellWeights, low: FloatArray, high: FloatArray, doc: str, block: int = BLOCK
) -> ModelProto:
    """The networks as a graph.

    Args:
        weights: one network or more.
        low: ``(3,)`` least corner of the cube.
        high: ``(3,)`` greatest corner.
        doc: what the graph is.
        block: samples of one network that are queried together.

    Raises:
        WrongUse: layers that do not fit together, or weights that are not finite.
    """
    _check(weights)
    made = _CellNodes(Nodes(), weights, block)
    encoded = made.encoded(made.local(), weights.positions)
    hidden = made.relu(made.layer("pts_linears.0", encoded, kilo_rows(weights.positions)))
    hidden = made.relu(made.layer("pts_linears.1", hidden))
    made.named("density_raw", made.layer("alpha_linear", hidden))
    hidden = made.relu(made.seen(made.layer("feature_linear", hidden)))
    made.named("colour_raw", made.layer("rgb_linear", hidden))
    inputs, outputs = cell_tensors(len(weights), block, low, high)
    return made.nodes.model(
        "vision", [value_of(item) for item in inputs], [value_of(item) for item in outputs], doc
    )


class _CellNodes:
    """The graph under construction."""

    def __init__(self, nodes: Nodes, weights: CellWeights, block: int) -> None:
        self.nodes, self._weights, self._block = nodes, weights, block
        self._network = nodes.add("Reshape", "network", nodes.constant(np.array([-1])))
        self._middle = nodes.constant(np.array([1]))

    def named(self, name: str, value: str) -> None:
        self.nodes.add("Identity", value, name=name)

    def relu(self, value: str) -> str:
        return self.nodes.add("Relu", value)

    def of_block(self, every: str) -> str:
        """Rows of the block's network."""
        return self.nodes.add("Gather", every, self._network, axis=0)

    def local(self) -> str:
        """The points in their cells, -1 to 1, computed in float64; ``(n, b, 3)``."""
        nodes = self.nodes
        lows = nodes.add("Unsqueeze", self.of_block(nodes.constant(self._weights.lows)), self._middle)
        scaled = nodes.add("Mul", nodes.add("Sub", "points", lows), nodes.constant(2.0 / self._weights.cell))
        return nodes.add(
            "Cast", nodes.add("Sub", scaled, nodes.constant(np.array(1.0))), to=TensorProto.FLOAT
        )

    def encoded(self, value: str, octaves: int) -> str:
        """``(n, b, 3)`` to ``(n, b, 3 + 6 octaves)``."""
        flat = self.nodes.add("Reshape", value, self.nodes.constant(np.array([-1, 3])))
        encoding = Encoding.octaves(octaves)
        spread = self.nodes.encoded(flat, 3, encoding)
        shape = self.nodes.constant(np.array([-1, self._block, encoding.width(3)]))
        return self.nodes.add("Reshape", spread, shape)

    def layer(self, name: str, value: str, rows: IntArray | None = None) -> str:
        """``value @ weight + bias`` of the block's network."""
        weight, _ = self._weights.layers[name]
        product = self._product(value, weight if rows is None else weight[:, rows], name)
        return self.nodes.add("Add", product, self._bias(name))

    def seen(self, features: str) -> str:
        """The layer that takes features, view and light, a product each."""
        name = "direction_layer"
        weight, octaves = self._weights.layers[name][0], self._weights.directions
        rows = kilo_rows(octaves)
        width = weight.shape[1] - 2 * len(rows)
        view, light = weight[:, width : width + len(rows)], weight[:, width + len(rows) :]
        lit = self.nodes.add(
            "Unsqueeze", self.nodes.encoded("light", 3, Encoding.octaves(octaves)), self._middle
        )
        parts = (
            self._product(features, weight[:, :width], name),
            self._product(self.encoded("views", octaves), view[:, rows], name),
            self._product(lit, light[:, rows], name),
        )
        return self.nodes.add(
            "Add", self.nodes.add("Add", self.nodes.add("Add", *parts[:2]), parts[2]), self._bias(name)
        )

    def _product(self, value: str, weight: AnyArray, name: str) -> str:
        return self.nodes.add("MatMul", value, self.of_block(self.nodes.weight(weight, name)))

    def _bias(self, name: str) -> str:
        bias = self.of_block(self.nodes.weight(self._weights.layers[name][1], name))
        return self.nodes.add("Unsqueeze", bias, self._middle)


def _check(weights: CellWeights) -> None:
    """Every layer has the inputs that the ones before give it."""
    missing = [name for name in LAYERS if name not in weights.layers]
    if missing or not len(weights):
        raise WrongUse(
            f"a KiloOSF of {len(weights)} networks without {missing}; there is one or more, of all layers"
        )
    out = {name: bias.shape[1] for name, (_, bias) in weights.layers.items()}
    first, seen = 3 + 6 * weights.positions, 2 * (3 + 6 * weights.directions)
    wanted = dict(zip(LAYERS, (first, out[LAYERS[0]], out[LAYERS[1]], out[LAYERS[1]], out[LAYERS[3]] + seen,
                               out[LAYERS[4]]), strict=True))  # fmt: skip
    sizes = {"alpha_linear": 1, "rgb_linear": 3}
    for name in LAYERS:
        weight, bias = weights.layers[name]
        shape = (len(weights), wanted[name], sizes.get(name, out[name]))
        if weight.shape != shape or bias.shape != (shape[0], shape[2]):
            raise WrongUse(
                f"{name} has weights {weight.shape} and biases {bias.shape}; it takes {shape} and "
                f"{(shape[0], shape[2])}: networks, in, out"
            )
