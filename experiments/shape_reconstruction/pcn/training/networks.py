"""The point completion network in torch, and the same as a graph.

Yuan et al., PCN: point completion network, 3DV 2018. The folding of the coarse cloud into a dense one is
left out.
"""

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.pcn.point_frame import GIVEN, TAKEN
from experiments.shape_reconstruction.pcn.training.point_encoder import PointEncoder, linear
from harness.objectfile.graph import Nodes, float_value

CODE = 256


class CompletionNetwork(nn.Module):
    """From ``(n, TAKEN, 3)`` touched points to ``(n, GIVEN, 3)`` all over the object."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = PointEncoder(32, 64, 128, CODE)
        self.decoder = nn.ModuleList([nn.Linear(CODE, CODE), nn.Linear(CODE, 3 * GIVEN)])

    def forward(self, touched: Tensor) -> Tensor:
        """``(n, GIVEN, 3)``."""
        hidden = torch.relu(self.decoder[0](self.encoder(touched)))
        return self.decoder[1](hidden).reshape(-1, GIVEN, 3)


def graph(module: CompletionNetwork) -> bytes:
    """The same with ``touched`` for its input and ``completed`` for its output."""
    nodes = Nodes("float16")  # of what is kept; computed in float32
    hidden = nodes.add("Relu", linear(nodes, module.encoder.write(nodes, "touched"), module.decoder[0]))
    flat = linear(nodes, hidden, module.decoder[1])
    nodes.add("Reshape", flat, nodes.constant(np.array([-1, GIVEN, 3], np.int64)), name="completed")
    inputs = [float_value("touched", ("n", TAKEN, 3))]
    outputs = [float_value("completed", ("n", GIVEN, 3))]
    what = "Touched places of an object to points all over it."
    return bytes(nodes.model("completion", inputs, outputs, what).SerializeToString())
