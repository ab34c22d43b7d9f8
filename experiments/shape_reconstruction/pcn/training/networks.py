"""The point completion network in torch, and the same as a graph.

Yuan et al., PCN: point completion network, 3DV 2018: every point by itself, the greatest over all points put
beside each, again, and the coarse cloud from what is greatest then. The folding of the coarse cloud into a
dense one is left out.
"""

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.pcn.point_frame import GIVEN, TAKEN
from harness.objectfile.graph import Nodes, float_value

FIRST, SECOND, THIRD, CODE = 32, 64, 128, 256


class CompletionNetwork(nn.Module):
    """From ``(n, TAKEN, 3)`` touched points to ``(n, GIVEN, 3)`` all over the object."""

    def __init__(self) -> None:
        super().__init__()
        self.points = nn.ModuleList([nn.Linear(3, FIRST), nn.Linear(FIRST, SECOND)])
        # Of a layer on a point and the greatest side by side, the two halves: the sum is the same.
        self.beside = nn.Linear(SECOND, THIRD)
        self.greatest = nn.Linear(SECOND, THIRD, bias=False)
        self.code = nn.Linear(THIRD, CODE)
        self.decoder = nn.ModuleList([nn.Linear(CODE, CODE), nn.Linear(CODE, 3 * GIVEN)])

    def forward(self, touched: Tensor) -> Tensor:
        """``(n, GIVEN, 3)``."""
        each = self.points[1](torch.relu(self.points[0](touched)))
        over_all = each.max(dim=1, keepdim=True).values
        each = torch.relu(self.beside(each) + self.greatest(over_all))
        code = self.code(each).max(dim=1).values
        return self.decoder[1](torch.relu(self.decoder[0](code))).reshape(-1, GIVEN, 3)


def graph(module: CompletionNetwork) -> bytes:
    """The same with ``touched`` for its input and ``completed`` for its output."""
    nodes = Nodes("float16")  # of what is kept; computed in float32
    each = _linear(nodes, nodes.add("Relu", _linear(nodes, "touched", module.points[0])), module.points[1])
    over_all = nodes.add("ReduceMax", each, axes=[1], keepdims=1)
    both = nodes.add("Add", _linear(nodes, each, module.beside), _linear(nodes, over_all, module.greatest))
    code = nodes.add("ReduceMax", _linear(nodes, nodes.add("Relu", both), module.code), axes=[1], keepdims=0)
    hidden = nodes.add("Relu", _linear(nodes, code, module.decoder[0]))
    flat = _linear(nodes, hidden, module.decoder[1])
    nodes.add("Reshape", flat, nodes.constant(np.array([-1, GIVEN, 3], np.int64)), name="completed")
    inputs = [float_value("touched", ("n", TAKEN, 3))]
    outputs = [float_value("completed", ("n", GIVEN, 3))]
    what = "Touched places of an object to points all over it."
    return bytes(nodes.model("completion", inputs, outputs, what).SerializeToString())


def _linear(nodes: Nodes, value: str, layer: nn.Linear) -> str:
    weight = nodes.weight(layer.weight.detach().numpy().T, "a layer")
    product = nodes.add("MatMul", value, weight)
    if layer.bias is None:
        return product
    return nodes.add("Add", product, nodes.weight(layer.bias.detach().numpy(), "a bias"))
