"""Fits one perceptron on an encoded input to rows that are drawn as it trains."""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from experiments.baselines.settings import FitSpec
from harness.authoring.perceptron import arrays_of, dense_layers, encode, set_rate
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.graph import Encoding, MlpWeights, Normaliser

Drawn = Callable[[np.random.Generator], tuple[FloatArray, AnyArray, AnyArray]]
"""From a generator to ``(batch, inputs)`` normalised inputs, ``(batch, outputs)`` targets and ``(batch,)``
weights of their squared errors."""


class EncodedPerceptron(nn.Module):
    """``(k, inputs)`` normalised to ``(k, outputs)``: ReLU after every layer but the last."""

    def __init__(self, spec: FitSpec, inputs: int, outputs: int, seed: int) -> None:
        super().__init__()
        self._encoding = Encoding.octaves(spec.octaves)
        self._as_it_is = Normaliser(np.zeros(inputs), np.ones(inputs))
        random = np.random.default_rng([seed, 4])
        width = self._encoding.width(inputs)
        self.layers = dense_layers(width, outputs, spec.depth, spec.width, 0, random)

    def forward(self, rows: FloatArray) -> Tensor:
        """Of normalised rows, which are encoded as the graph encodes them."""
        hidden = encode(rows, self._as_it_is, self._encoding)
        for index, layer in enumerate(self.layers):
            hidden = layer(hidden)
            if index < len(self.layers) - 1:
                hidden = torch.relu(hidden)
        return hidden

    def weights(self) -> MlpWeights:
        """As plain arrays."""
        return MlpWeights(tuple(arrays_of(layer) for layer in self.layers if isinstance(layer, nn.Linear)))


def fitted(
    spec: FitSpec, sizes: tuple[int, int], draw: Drawn, seed: int, report: Callable[[float], None]
) -> MlpWeights:
    """The weights after all steps of least squares.

    Args:
        spec: of the network and its training.
        sizes: numbers of inputs and of outputs.
        draw: gives the rows of a step.
        seed: of first weights and of what is drawn.
        report: takes the share of the steps that is done.
    """
    torch.set_num_threads(1)
    network = EncodedPerceptron(spec, *sizes, seed)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([seed, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        rows, wanted, weights = draw(random)
        adam.zero_grad()
        wrong = ((network(rows) - torch.from_numpy(np.float32(wanted))) ** 2).mean(dim=1)
        loss = (wrong * torch.from_numpy(np.float32(weights))).mean()
        torch.autograd.backward(loss)
        adam.step()
        report((step + 1) / spec.steps)
    return network.weights()
