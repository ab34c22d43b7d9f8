"""A recurrent network over imprints in their order (Cho et al., gated recurrent unit, EMNLP 2014)."""

import numpy as np
import torch
from torch import Tensor, nn

from experiments.scale_estimation.unseen import contact_set
from harness.authoring.resnet import written_linear
from harness.objectfile.graph import Nodes

_EACH = 64


class ImprintGru(nn.Module):
    """A layer on each imprint, a gated recurrent unit, a number out of its last state.

    Args:
        usual: logarithm of the size that it begins at.
    """

    def __init__(self, usual: float) -> None:
        super().__init__()
        self.each = nn.Linear(contact_set.IMPRINT, _EACH)
        self.recurrent = nn.GRU(_EACH, _EACH, batch_first=True)
        self.last = nn.Linear(_EACH, 1)
        nn.init.constant_(self.last.bias, usual)

    def forward(self, imprints: Tensor, last: Tensor) -> Tensor:
        """``(n, 1)`` of ``(n, steps, IMPRINT)`` and ``(n, steps)`` 1 at the last that there is."""
        states, _ = self.recurrent(torch.relu(self.each(imprints)))
        return torch.as_tensor(self.last((states * last[..., None]).sum(dim=1)))

    def write(self, nodes: Nodes, imprints: str, last: str) -> str:
        """The same in a graph."""
        matrix = nodes.weight(self.each.weight.detach().numpy().T, "an imprint's layer")
        bias = nodes.weight(self.each.bias.detach().numpy(), "an imprint's layer")
        each = nodes.add("Relu", nodes.add("Add", nodes.add("MatMul", imprints, matrix), bias))
        along = nodes.add("Transpose", each, perm=[1, 0, 2])
        weights = [nodes.weight(value, "a recurrent unit") for value in self._gates()]
        states = nodes.add("GRU", along, *weights, hidden_size=_EACH, linear_before_reset=1)
        back = nodes.add("Transpose", nodes.add("Squeeze", states, _axis(nodes, 1)), perm=[1, 0, 2])
        chosen = nodes.add("Mul", back, nodes.add("Unsqueeze", last, _axis(nodes, 2)))
        return written_linear(nodes, nodes.add("ReduceSum", chosen, _axis(nodes, 1), keepdims=0), self.last)

    def _gates(self) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.float32]], ...]:
        """Weights of the input, of the state, and biases; torch has reset before update, ONNX after it."""
        named = dict(self.recurrent.named_parameters())

        def ordered(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
            reset, update, new = np.split(named[name].detach().numpy(), 3)
            return np.concatenate([update, reset, new])

        biases = np.concatenate([ordered("bias_ih_l0"), ordered("bias_hh_l0")])
        return ordered("weight_ih_l0")[None], ordered("weight_hh_l0")[None], biases[None]


def _axis(nodes: Nodes, axis: int) -> str:
    return nodes.constant(np.array([axis], np.int64))
