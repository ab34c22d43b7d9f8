"""The network of a glance in torch, and the same as a graph: a silhouette to points all over the object.

A network of the paper's kind, a thirtieth of the paper's work: four residual blocks in place of a ResNet-18's
eight, each a fourth to a half as wide, and no folding.
"""

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.pcn.point_frame import GIVEN
from experiments.shape_reconstruction.pcn.training.point_encoder import linear
from experiments.shape_reconstruction.pcn.window import SIDE
from harness.authoring.resnet import ResidualBlock, convolution, written_convolution
from harness.objectfile.graph import Nodes, float_value

CHANNELS = (1, 32, 64, 96, 128)
"""Before and after each residual block; each halves the window."""

NARROW, CODE = 32, 512
"""Channels that are laid out in a row, and numbers of the layers after."""

_LAST = SIDE >> (len(CHANNELS) - 1)


class GlanceNetwork(nn.Module):
    """From ``(n, 1, SIDE, SIDE)`` to ``(n, GIVEN, 3)``."""

    def __init__(self) -> None:
        super().__init__()
        self.blocks = nn.ModuleList([ResidualBlock(*widths, 2) for widths in pairwise(CHANNELS)])
        self.narrow = convolution(CHANNELS[-1], NARROW, 1, 1)
        self.decoder = nn.ModuleList(
            [nn.Linear(NARROW * _LAST**2, CODE), nn.Linear(CODE, CODE), nn.Linear(CODE, 3 * GIVEN)]
        )

    def forward(self, window: Tensor) -> tuple[list[Tensor], Tensor]:
        """No coarse cloud, and ``(n, GIVEN, 3)``."""
        found = window
        for block in self.blocks:
            found = block(found)
        hidden = torch.relu(self.narrow(found)).flatten(1)
        for linear_layer in list(self.decoder)[:-1]:
            hidden = torch.relu(linear_layer(hidden))
        return [], self.decoder[-1](hidden).reshape(-1, GIVEN, 3)

    def graph(self) -> bytes:
        """The same, taking ``window`` and giving ``completed``."""
        nodes, found = Nodes("float16"), "window"  # of what is kept; computed in float32
        for block in self.blocks:
            assert isinstance(block, ResidualBlock)
            found = block.write(nodes, found)
        found = nodes.add("Relu", written_convolution(nodes, found, self.narrow))
        hidden = nodes.add("Flatten", found, axis=1)
        for layer in list(self.decoder)[:-1]:
            assert isinstance(layer, nn.Linear)
            hidden = nodes.add("Relu", linear(nodes, hidden, layer))
        last = self.decoder[-1]
        assert isinstance(last, nn.Linear)
        flat = linear(nodes, hidden, last)
        nodes.add("Reshape", flat, nodes.constant(np.array([-1, GIVEN, 3], np.int64)), name="completed")
        inputs, outputs = (
            [float_value("window", ("n", 1, SIDE, SIDE))],
            [float_value("completed", ("n", GIVEN, 3))],
        )
        what = "The silhouette of an object to points all over it."
        return bytes(nodes.model("glance", inputs, outputs, what).SerializeToString())
