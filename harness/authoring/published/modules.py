"""The networks of published ObjectFiles as torch modules, and their export to ONNX.

Layers have the names of the files, so that ``load_weights`` finds them; forward passes do what the published
programs do, with the input's normaliser and the output's scale inside.
"""

import logging
import warnings
from collections.abc import Sequence

import torch
from onnx import ModelProto
from torch import Tensor, nn

from harness.authoring.published.layout import State
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile import entries

_LAYERS = 8
_SKIP = 5
"""The layer of a published perceptron, from 0, that takes the encoded input again."""

_POSITION_OCTAVES = 10
"""Octaves of the positional encoding for the inputs of sound and touch."""

_OPSET = 18
"""Operator set of 2022 that torch exports without converting."""


def nerf_encoding(values: Tensor, octaves: int) -> Tensor:
    """Encode ``(..., d)`` as ``[v, sin v, cos v, sin 2v, cos 2v, ...]``, each block the whole vector."""
    waves = [wave(2.0**k * values) for k in range(octaves) for wave in (torch.sin, torch.cos)]
    return torch.cat([values, *waves], dim=-1)


def kilonerf_encoding(values: Tensor, octaves: int) -> Tensor:
    """Encode coordinate by coordinate as ``[x, cos x, cos 2x, ..., sin x, sin 2x, ...]``.

    Reiser et al., KiloNeRF, ICCV 2021, and its published code.
    """
    frequencies = 2.0 ** torch.arange(octaves)
    parts = []
    for coordinate in values.split(1, dim=-1):
        angles = coordinate * frequencies
        parts += [coordinate, torch.cos(angles), torch.sin(angles)]
    return torch.cat(parts, dim=-1)


class Trunk(nn.Module):
    """Layers with ReLU, one of which takes the encoded input again, in front of the hidden values."""

    def __init__(self, encoded: int, width: int, layers: int, skip: int | None) -> None:
        super().__init__()
        self.skip = skip
        inputs = [encoded, *(width + (encoded if k == skip else 0) for k in range(1, layers))]
        self.pts_linears = nn.ModuleList(nn.Linear(count, width) for count in inputs)

    def forward(self, encoded: Tensor) -> Tensor:
        """``(n, encoded)`` to ``(n, width)``."""
        hidden = encoded
        for number, layer in enumerate(self.pts_linears):
            taken = torch.cat([encoded, hidden], dim=-1) if number == self.skip else hidden
            hidden = torch.relu(layer(taken))
        return hidden


class SkipPerceptron(Trunk):
    """The published perceptron of sound and touch."""

    def __init__(
        self, encoded: int, width: int, outputs: int, layers: int = _LAYERS, skip: int | None = _SKIP
    ) -> None:
        super().__init__(encoded, width, layers, skip)
        self.output_linear = nn.Linear(width, outputs)

    def forward(self, encoded: Tensor) -> Tensor:
        """``(n, encoded)`` to ``(n, outputs)``."""
        return self.output_linear(self.features(encoded))

    def features(self, encoded: Tensor) -> Tensor:
        """Compute the ``(n, width)`` input of the last layer from ``(n, encoded)``."""
        return super().forward(encoded)


class ScaledPerceptrons(nn.Module):
    """Perceptrons with one input: normalise in float64, encode, run every branch, scale its outputs.

    Args:
        branches: perceptrons of as many outputs each.
        shift: ``(d,)`` subtracted from the input ...
        factor: ``(d,)`` ... and multiplied by.
        scale: ``(branches, outputs)`` or ``(branches, 1)``, multiplied with the outputs ...
        offset: ... and added, in the same shape.
        octaves: of the encoding.
    """

    def __init__(
        self,
        branches: Sequence[nn.Module],
        shift: FloatArray,
        factor: FloatArray,
        scale: FloatArray,
        offset: FloatArray,
        octaves: int = _POSITION_OCTAVES,
    ) -> None:
        super().__init__()
        self.branches, self.octaves = nn.ModuleList(branches), octaves
        self.shift, self.factor = nn.Buffer(torch.from_numpy(shift)), nn.Buffer(torch.from_numpy(factor))
        self.scale = nn.Buffer(torch.from_numpy(scale).float())
        self.offset = nn.Buffer(torch.from_numpy(offset).float())

    def forward(self, values: Tensor) -> Tensor:
        """``(n, d)`` float64 to ``(n, outputs, branches)``, or ``(n, outputs)`` of one branch."""
        encoded = nerf_encoding(((values - self.shift) * self.factor).float(), self.octaves)
        outputs = [
            branch(encoded) * scale + offset
            for branch, scale, offset in zip(self.branches, self.scale, self.offset, strict=True)
        ]
        return outputs[0] if len(outputs) == 1 else torch.stack(outputs, dim=2)


class Osf(Trunk):
    """The published network of a look: position, view and light to raw colour and density.

    NeRF's layout (Mildenhall et al., ECCV 2020) with the light next to the view.

    Args:
        width: of the layers on the position.
        turned: width of the layer that takes view and light.
        layers: number of layers on the position.
        skip: layer, from 0, that takes the encoded position again; None for none.
        octaves: of the encoding of positions, and of directions.
    """

    def __init__(
        self, width: int, turned: int, layers: int, skip: int | None, octaves: tuple[int, int]
    ) -> None:
        positions, directions = (3 + 6 * count for count in octaves)
        super().__init__(positions, width, layers, skip)
        self.octaves = octaves
        self.bottleneck_linear, self.alpha_linear = nn.Linear(width, width), nn.Linear(width, 1)
        self.views_lights_linears = nn.ModuleList([nn.Linear(width + 2 * directions, turned)])
        self.rgb_linear = nn.Linear(turned, 3)

    def forward(self, points: Tensor, views: Tensor, light: Tensor) -> tuple[Tensor, Tensor]:  # type: ignore[override]
        """``(n, 3)`` each to ``(n, 3)`` raw colours and ``(n, 1)`` raw densities."""
        positions, directions = self.octaves
        hidden = super().forward(nerf_encoding(points.float(), positions))
        told = [nerf_encoding(direction, directions) for direction in (views, light)]
        seen = torch.cat([self.bottleneck_linear(hidden), *told], dim=-1)
        return self.rgb_linear(torch.relu(self.views_lights_linears[0](seen))), self.alpha_linear(hidden)


class CellLinear(nn.Module):
    """A layer of many networks: ``y = x @ weight[network] + bias[network]``."""

    def __init__(self, networks: int, inputs: int, outputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(networks, inputs, outputs))
        self.bias = nn.Parameter(torch.empty(networks, outputs))

    def forward(self, values: Tensor, network: Tensor) -> Tensor:
        """``(n, block, inputs)`` and ``(n,)`` networks to ``(n, block, outputs)``."""
        weight, bias = (torch.index_select(array, 0, network) for array in (self.weight, self.bias))
        return torch.matmul(values, weight) + bias[:, None]


class KiloOsf(nn.Module):
    """The networks of a KiloOSF, one a cell, queried in blocks of points of one network each.

    Args:
        lows: ``(networks, 3)`` least corner of each network's cell.
        cell: ``(3,)`` sides of a cell.
        widths: outputs of the two layers on the position, of the features' layer and of the direction layer.
        octaves: of the encoding of positions, and of directions.
    """

    def __init__(
        self,
        lows: FloatArray,
        cell: FloatArray,
        widths: Sequence[int],
        octaves: tuple[int, int],
    ) -> None:
        super().__init__()
        networks, (first, second, features, turned) = len(lows), widths
        positions, directions = (3 + 6 * count for count in octaves)
        self.octaves = octaves
        self.lows, self.scale = nn.Buffer(torch.from_numpy(lows)), nn.Buffer(torch.from_numpy(2.0 / cell))
        self.pts_linears = nn.ModuleList(
            [CellLinear(networks, positions, first), CellLinear(networks, first, second)]
        )
        self.alpha_linear = CellLinear(networks, second, 1)
        self.feature_linear = CellLinear(networks, second, features)
        self.direction_layer = CellLinear(networks, features + 2 * directions, turned)
        self.rgb_linear = CellLinear(networks, turned, 3)

    def forward(self, network: Tensor, points: Tensor, views: Tensor, light: Tensor) -> tuple[Tensor, Tensor]:
        """Compute raw colours and densities of blocks.

        Args:
            network: ``(n, 1)`` of each block.
            points: ``(n, block, 3)`` float64 in the network's cell.
            views: ``(n, block, 3)`` unit.
            light: ``(n, 3)`` unit.

        Returns:
            ``(n, block, 3)`` and ``(n, block, 1)``.
        """
        which, (positions, directions) = network[:, 0], self.octaves
        lows = torch.index_select(self.lows, 0, which)[:, None]
        local = ((points - lows) * self.scale - 1.0).float()
        hidden = kilonerf_encoding(local, positions)
        for layer in self.pts_linears:
            hidden = torch.relu(layer(hidden, which))
        lit = kilonerf_encoding(light, directions)[:, None].expand(-1, points.shape[1], -1)
        seen = torch.cat(
            [self.feature_linear(hidden, which), kilonerf_encoding(views, directions), lit], dim=-1
        )
        turned = torch.relu(self.direction_layer(seen, which))
        return self.rgb_linear(turned, which), self.alpha_linear(hidden, which)


def load_weights(module: nn.Module, state: State, prefix: str = "", cells: BoolArray | None = None) -> None:
    """Fill the parameters of a module from a published file.

    Args:
        module: its parameters are named as in the file.
        state: weights of the file.
        prefix: before every name in the file.
        cells: ``(cells,)`` whether to take the network of a cell, along the first axis; None for one network.

    Raises:
        DataRefused: weights that are missing, not finite, or of shapes that do not fit together.
    """
    for name, parameter in module.named_parameters():
        array = state.weights(prefix + name, parameter.ndim)
        if cells is not None and len(array) != len(cells):
            raise DataRefused(
                f"{state.name}/{name} has {len(array)} networks where there are {len(cells)} cells"
            )
        chosen = array if cells is None else array[cells]
        if chosen.shape != tuple(parameter.shape):
            raise DataRefused(
                f"{state.name}/{prefix}{name} has the shape {chosen.shape} where the layers before it need "
                f"{tuple(parameter.shape)}; the file is damaged or of another layout"
            )
        parameter.data = torch.from_numpy(chosen)


def exported_graph(
    module: nn.Module, inputs: Sequence[entries.Tensor], outputs: Sequence[entries.Tensor], doc: str
) -> ModelProto:
    """Export a module to a graph of plain operations.

    Args:
        module: takes the inputs in their order and returns the outputs.
        inputs: names, types and shapes; the first size is the number of queries.
        outputs: names, types and shapes.
        doc: description stored in the graph.
    """
    rows = torch.export.Dim("n")
    examples = tuple(torch.zeros((2, *item.shape[1:]), dtype=getattr(torch, item.dtype)) for item in inputs)
    # The exporter's progress and its notes about missing packages stay off the terminal.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        program = torch.onnx.export(
            module.eval(),
            examples,
            dynamo=True,
            dynamic_shapes=tuple({0: rows} for _ in inputs),
            input_names=[item.name for item in inputs],
            output_names=[item.name for item in outputs],
            opset_version=_OPSET,
            external_data=False,
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    # torch notes where in its sources every operation comes from, with the paths of this machine.
    graph = model.graph
    for part in (model, graph, *graph.node, *graph.input, *graph.output, *graph.initializer):
        part.ClearField("metadata_props")
    graph.ClearField("value_info")
    graph.name = outputs[0].name
    model.doc_string = doc
    return model
