"""ResNet-18 in torch and as a graph (He et al., Deep residual learning, CVPR 2016, table 1)."""

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from harness.objectfile.graph import Nodes

STAGES = (64, 128, 256, 512)
"""Channels of each stage's two blocks; every stage but the first halves the picture."""

_FIRST = 7
_EACH = 2


class Convolution(nn.Module):
    """Convolution and batch normalisation, initialised after He et al. 2015 (Delving deep)."""

    def __init__(self, before: int, channels: int, side: int, stride: int) -> None:
        super().__init__()
        self.kernel = nn.Conv2d(before, channels, side, stride, side // 2, bias=False)
        nn.init.kaiming_normal_(self.kernel.weight, mode="fan_out", nonlinearity="relu")
        self.normalisation = nn.BatchNorm2d(channels)

    def forward(self, given: Tensor) -> Tensor:
        """Compute features ``(n, channels, rows / stride, columns / stride)``."""
        return self.normalisation(self.kernel(given))

    def write(self, nodes: Nodes, value: str) -> str:
        """Write one layer to a graph: a trained normalisation scales and shifts each channel."""
        kernel, normalisation = self.kernel, self.normalisation
        mean, variance = (normalisation.get_buffer(name) for name in ("running_mean", "running_var"))
        factor = (normalisation.weight / torch.sqrt(variance + normalisation.eps)).detach().numpy()
        weight = nodes.weight(kernel.weight.detach().numpy() * factor[:, None, None, None], "a convolution")
        shift = normalisation.bias.detach().numpy() - factor * mean.numpy()
        bias = nodes.weight(np.asarray(shift), "a convolution")
        half, stride = kernel.kernel_size[0] // 2, kernel.stride[0]
        return nodes.add("Conv", value, weight, bias, strides=[stride] * 2, pads=[half] * 4)


class ResidualBlock(nn.Module):
    """Two convolutions of 3 x 3, whose output is added to the input."""

    def __init__(self, before: int, channels: int, stride: int) -> None:
        super().__init__()
        self.first = Convolution(before, channels, 3, stride)
        self.second = Convolution(channels, channels, 3, 1)
        changes = stride != 1 or before != channels
        self.shortcut = Convolution(before, channels, 1, stride) if changes else None

    def forward(self, given: Tensor) -> Tensor:
        """Compute features ``(n, channels, rows / stride, columns / stride)``."""
        along = given if self.shortcut is None else self.shortcut(given)
        return torch.relu(self.second(torch.relu(self.first(given))) + along)

    def write(self, nodes: Nodes, given: str) -> str:
        """Write the layers to a graph."""
        along = given if self.shortcut is None else self.shortcut.write(nodes, given)
        inner = nodes.add("Relu", self.first.write(nodes, given))
        return nodes.add("Relu", nodes.add("Add", self.second.write(nodes, inner), along))


class ResNet18(nn.Module):
    """The published layers.

    Args:
        channels: of the picture.
        outputs: numbers that the last layer gives.
    """

    def __init__(self, channels: int, outputs: int) -> None:
        super().__init__()
        self.first = Convolution(channels, STAGES[0], _FIRST, 2)
        self.pool = nn.MaxPool2d(3, 2, 1)
        blocks = []
        for stage, (before, width) in enumerate(pairwise((STAGES[0], *STAGES))):
            for number in range(_EACH):
                stride = 2 if stage > 0 and number == 0 else 1
                blocks.append(ResidualBlock(before if number == 0 else width, width, stride))
        self.blocks = nn.ModuleList(blocks)
        self.last = nn.Linear(STAGES[-1], outputs)

    def forward(self, picture: Tensor) -> Tensor:
        """``(n, outputs)`` of ``(n, channels, rows, columns)``."""
        found = self.pool(torch.relu(self.first(picture)))
        for block in self.blocks:
            found = block(found)
        return torch.as_tensor(self.last(found.mean(dim=(2, 3))))

    def write(self, nodes: Nodes, picture: str) -> str:
        """Write the layers to a graph."""
        found = nodes.add("Relu", self.first.write(nodes, picture))
        found = nodes.add("MaxPool", found, kernel_shape=[3, 3], strides=[2, 2], pads=[1, 1, 1, 1])
        for block in self.blocks:
            found = block.write(nodes, found)
        mean = nodes.add("ReduceMean", found, axes=[2, 3], keepdims=0)
        return written_linear(nodes, mean, self.last)


def written_linear(nodes: Nodes, value: str, layer: nn.Linear) -> str:
    """Write a linear layer to a graph."""
    weight = nodes.weight(layer.weight.detach().numpy().T, "a layer")
    return nodes.add("Gemm", value, weight, nodes.weight(layer.bias.detach().numpy(), "a bias"))
