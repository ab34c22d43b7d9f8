"""From points to one code, in torch and as a graph.

Yuan et al., PCN: point completion network, 3DV 2018: every point by itself, the greatest over all points put
beside each, again, and the greatest of that.
"""

import torch
from torch import Tensor, nn

from harness.objectfile.graph import Nodes


class PointEncoder(nn.Module):
    """From ``(n, points, 3)`` to ``(n, code)``, whatever order the points are in.

    Args:
        first: numbers of the first layer on a point.
        second: of the next, whose greatest go beside each point.
        third: of the first layer on both.
        code: that come out.
    """

    def __init__(self, first: int, second: int, third: int, code: int) -> None:
        super().__init__()
        self.points = nn.ModuleList([nn.Linear(3, first), nn.Linear(first, second)])
        # Of a layer on a point and the greatest side by side, the two halves: the sum is the same.
        self.beside = nn.Linear(second, third)
        self.greatest = nn.Linear(second, third, bias=False)
        self.code = nn.Linear(third, code)

    def forward(self, touched: Tensor) -> Tensor:
        """``(n, code)``."""
        each = self.points[1](torch.relu(self.points[0](touched)))
        over_all = each.max(dim=1, keepdim=True).values
        each = torch.relu(self.beside(each) + self.greatest(over_all))
        return torch.as_tensor(self.code(each).max(dim=1).values)

    def write(self, nodes: Nodes, touched: str) -> str:
        """The same in a graph."""
        first = nodes.add("Relu", linear(nodes, touched, self.points[0]))
        each = linear(nodes, first, self.points[1])
        over_all = nodes.add("ReduceMax", each, axes=[1], keepdims=1)
        both = nodes.add("Add", linear(nodes, each, self.beside), linear(nodes, over_all, self.greatest))
        inner = linear(nodes, nodes.add("Relu", both), self.code)
        return nodes.add("ReduceMax", inner, axes=[1], keepdims=0)


def linear(nodes: Nodes, value: str, layer: nn.Linear) -> str:
    """A linear layer over the last axis, in a graph."""
    weight = nodes.weight(layer.weight.detach().numpy().T, "a layer")
    product = nodes.add("MatMul", value, weight)
    if layer.bias is None:
        return product
    return nodes.add("Add", product, nodes.weight(layer.bias.detach().numpy(), "a bias"))
