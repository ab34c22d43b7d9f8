"""The networks of sound and of touch in torch, and the same as graphs."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import torch
from torch import Tensor, nn

from experiments.scale_estimation.unseen import contact_set, spectrogram
from experiments.scale_estimation.unseen.network import BINS, CODE, INPUTS
from harness.objectfile.graph import Nodes, float_value

_WIDTHS = ((32, 9), (48, 5), (64, 5))
"""Channels and length of each convolution along the bands; each halves them."""

_STRIDE = 2
_DROPPED = {"sound": 0.3, "touch": 0.2}
_HIDDEN = 128
_EACH = 64
"""Numbers that a way of the gel becomes."""


class SoundNetwork(nn.Module):
    """Convolutions along the bands, two layers on what they give and the extras."""

    def __init__(self) -> None:
        super().__init__()
        channels, bands, layers = spectrogram.CHANNELS, spectrogram.BANDS, []
        for width, length in _WIDTHS:
            layers.append(nn.Conv1d(channels, width, length, _STRIDE, length // 2))
            channels, bands = width, (bands + 1) // _STRIDE
        self.convolutions = nn.ModuleList(layers)
        self.hidden = nn.Linear(channels * bands + spectrogram.EXTRAS, _HIDDEN)
        self.code = nn.Linear(_HIDDEN, CODE)
        self.last = nn.Linear(CODE, BINS)
        self.dropped = nn.Dropout(_DROPPED["sound"])

    def forward(self, bands: Tensor, extras: Tensor) -> Tensor:
        """``(n, BINS)`` logits."""
        found = bands
        for layer in self.convolutions:
            found = torch.relu(layer(found))
        flat = torch.cat([found.flatten(1), extras], dim=1)
        hidden = self.dropped(torch.relu(self.hidden(self.dropped(flat))))
        return self.last(torch.relu(self.code(hidden)))

    def write(self, nodes: Nodes) -> tuple[str, str]:
        """The same in a graph: names of logits and code."""
        found = "bands"
        for number, layer in enumerate(self.convolutions):
            weight = nodes.weight(layer.weight.detach().numpy(), f"convolution {number}")
            bias = nodes.weight(layer.bias.detach().numpy(), f"convolution {number}")
            half = layer.kernel_size[0] // 2
            moved = nodes.add("Conv", found, weight, bias, strides=[_STRIDE], pads=[half, half])
            found = nodes.add("Relu", moved)
        flat = nodes.add("Concat", nodes.add("Flatten", found, axis=1), "extras", axis=1)
        return _written_ends(nodes, flat, self)


class TouchNetwork(nn.Module):
    """Two layers on every way by itself, greatest and mean over ways, two layers on those."""

    def __init__(self, numbers: int = contact_set.NUMBERS, whole: int = contact_set.WHOLE) -> None:
        super().__init__()
        self.first = nn.Linear(numbers, _EACH)
        self.second = nn.Linear(_EACH, _EACH)
        self.hidden = nn.Linear(3 * _EACH + whole, _HIDDEN)
        self.code = nn.Linear(_HIDDEN, CODE)
        self.last = nn.Linear(CODE, BINS)
        self.dropped = nn.Dropout(_DROPPED["touch"])

    def forward(self, ways: Tensor, kinds: Tensor, whole: Tensor) -> Tensor:
        """``(n, BINS)`` logits."""
        each = torch.relu(self.second(torch.relu(self.first(ways))))
        met, missed = kinds[..., :1], kinds[..., 1:]
        greatest = (each * met).max(dim=1).values
        means = [(each * kind).sum(dim=1) / (kind.sum(dim=1) + 1.0) for kind in (met, missed)]
        hidden = self.dropped(torch.relu(self.hidden(torch.cat([greatest, *means, whole], dim=1))))
        return self.last(torch.relu(self.code(hidden)))

    def write(self, nodes: Nodes) -> tuple[str, str]:
        """The same in a graph: names of logits and code."""
        each = "ways"
        for layer in (self.first, self.second):
            matrix = nodes.weight(layer.weight.detach().numpy().T, "a way's layer")
            product = nodes.add("MatMul", each, matrix)
            each = nodes.add(
                "Relu", nodes.add("Add", product, nodes.weight(layer.bias.detach().numpy(), "bias"))
            )
        one = nodes.constant(np.array(1.0, np.float32))
        axis = nodes.constant(np.array([1], np.int64))
        parts = []
        for kind in (0, 1):
            ends = [nodes.constant(np.array([end], np.int64)) for end in (kind, kind + 1, 2)]
            chosen = nodes.add("Slice", "kinds", *ends)
            these = nodes.add("Mul", each, chosen)
            if kind == 0:
                parts.append(nodes.add("ReduceMax", these, axes=[1], keepdims=0))
            count = nodes.add("Add", nodes.add("ReduceSum", chosen, axis, keepdims=0), one)
            parts.append(nodes.add("Div", nodes.add("ReduceSum", these, axis, keepdims=0), count))
        return _written_ends(nodes, nodes.add("Concat", *parts, "whole", axis=1), self)


SizeModule = SoundNetwork | TouchNetwork
MODULES: dict[str, Callable[[], SizeModule]] = {
    "sound": SoundNetwork,
    "touch": TouchNetwork,
    "imprints": partial(TouchNetwork, contact_set.IMPRINT, 1),
}


def _written_ends(nodes: Nodes, value: str, module: SizeModule) -> tuple[str, str]:
    for layer in (module.hidden, module.code):
        value = nodes.add("Relu", _linear(nodes, value, layer))
    return _linear(nodes, value, module.last), value


def _linear(nodes: Nodes, value: str, layer: nn.Linear) -> str:
    weight = nodes.weight(layer.weight.detach().numpy().T, "a layer")
    return nodes.add("Gemm", value, weight, nodes.weight(layer.bias.detach().numpy(), "a bias"))


def graph(sense: str, members: Sequence[SizeModule]) -> bytes:
    """All members in one graph: ``logits`` ``(n, members, BINS)`` and ``codes`` ``(n, members, CODE)``."""
    nodes = Nodes("float16")  # of what is kept; computed in float32
    middle = nodes.constant(np.array([1], np.int64))
    logits: list[str] = []
    codes: list[str] = []
    for member in members:
        for found, name in zip((logits, codes), member.eval().write(nodes), strict=True):
            found.append(nodes.add("Unsqueeze", name, middle))
    nodes.add("Concat", *logits, axis=1, name="logits")
    nodes.add("Concat", *codes, axis=1, name="codes")
    inputs = [float_value(name, ("n", *shape)) for name, shape in INPUTS[sense]]
    outputs = [
        float_value(name, ("n", len(members), size)) for name, size in (("logits", BINS), ("codes", CODE))
    ]
    what = "Readings of an object never drawn to the logarithm of its longest side."
    return bytes(nodes.model(sense, inputs, outputs, what).SerializeToString())
