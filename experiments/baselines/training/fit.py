"""Fits one perceptron on an encoded input to rows that are drawn as it trains."""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from experiments.baselines.settings import FitSpec
from harness.authoring.perceptron import dense_layers, encode, set_rate
from harness.authoring.published.modules import Perceptron, ScaledPerceptrons
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.graph import Encoding, Normaliser

Drawn = Callable[[np.random.Generator], tuple[FloatArray, AnyArray, AnyArray]]
"""From a generator to ``(batch, inputs)`` normalised inputs, ``(batch, outputs)`` targets and ``(batch,)``
weights of their squared errors where the last layer is solved."""


_SOLVED = 16
"""Draws of rows that the last layer is solved over."""

_RIDGE = 1e-6
"""Of the mean square of the features."""


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
        return self.layers[-1](self.features(rows))

    def features(self, rows: FloatArray) -> Tensor:
        """``(k, width)``: what the last layer takes."""
        hidden = encode(rows, self._as_it_is, self._encoding)
        for layer in self.layers[:-1]:
            hidden = torch.relu(layer(hidden))
        return hidden


def fitted(
    spec: FitSpec,
    sizes: tuple[int, int],
    draw: Drawn,
    seed: int,
    report: Callable[[float], None],
    scale: float = 1.0,
) -> ScaledPerceptrons:
    """Train a network, then solve its last layer for what those before it give.

    Args:
        spec: of the network and its training.
        sizes: numbers of inputs and of outputs.
        draw: gives the rows of a step.
        seed: of first weights and of what is drawn.
        report: takes the share of the steps that is done.
        scale: factor of the trained outputs.
    """
    torch.set_num_threads(1)
    network = EncodedPerceptron(spec, *sizes, seed)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([seed, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        rows, wanted, _ = draw(random)
        adam.zero_grad()
        loss = ((network(rows) - torch.from_numpy(np.float32(wanted))) ** 2).mean()
        torch.autograd.backward(loss)
        adam.step()
        report((step + 1) / spec.steps)
    perceptron = Perceptron(
        Encoding.octaves(spec.octaves).width(sizes[0]), spec.width, sizes[1], spec.depth, None
    )
    perceptron.pts_linears = nn.ModuleList(network.layers[:-1])
    weight, bias = _solved(network, draw, random)
    with torch.no_grad():
        perceptron.output_linear.weight.copy_(torch.from_numpy(np.float32(weight.T)))
        perceptron.output_linear.bias.copy_(torch.from_numpy(np.float32(bias)))
    plain, scales = (np.zeros(sizes[0]), np.ones(sizes[0])), (np.full((1, 1), scale), np.zeros((1, 1)))
    return ScaledPerceptrons([perceptron], *plain, *scales, spec.octaves)


def _solved(
    network: EncodedPerceptron, draw: Drawn, random: np.random.Generator
) -> tuple[AnyArray, AnyArray]:
    """Solve the last layer, ``(in, out)`` and ``(out,)``, by weighted least squares over fresh rows."""
    products: FloatArray = np.zeros(())
    targets: FloatArray = np.zeros(())
    for _ in range(_SOLVED):
        rows, wanted, weights = draw(random)
        with torch.no_grad():
            found = network.features(rows).numpy().astype(np.float64)
        features = np.concatenate([found, np.ones((len(found), 1))], axis=1)
        weighted = features * weights[:, None]
        products, targets = products + weighted.T @ features, targets + weighted.T @ wanted
    ridge = _RIDGE * float(np.trace(products)) / len(products)
    last = np.linalg.solve(products + ridge * np.eye(len(products)), targets)
    return last[:-1], last[-1]
