"""What the perceptrons of sound and of touch are made of, in torch."""

import numpy as np
import torch
from torch import Tensor, nn

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.graph import Encoding, Normaliser


def dense_layers(
    encoded: int, outputs: int, depth: int, width: int, skip: int, random: np.random.Generator
) -> nn.ModuleList:
    """Linear layers that take an encoded input: hidden ones, and the last.

    Weights are normal of variance ``2 / inputs`` (He et al., Delving deep into rectifiers, ICCV 2015),
    biases zero.

    Args:
        encoded: numbers of the encoded input.
        outputs: of the last layer.
        depth: hidden layers.
        width: of each.
        skip: the layer, counted from 0, that takes the encoded input too; 0 for none.
        random: draws the weights.
    """
    layers = nn.ModuleList()
    given = encoded
    for index in range(depth + 1):
        taken = given + (encoded if index and index == skip else 0)
        given = width if index < depth else outputs
        layers.append(_dense_layer(taken, given, random))
    return layers


def _dense_layer(taken: int, given: int, random: np.random.Generator) -> nn.Linear:
    """Weights normal of variance ``2 / taken`` (He et al., ICCV 2015), biases zero."""
    layer = nn.Linear(taken, given)
    weight = random.standard_normal((given, taken)) * np.sqrt(2.0 / taken)
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(np.float32(weight)))
        layer.bias.zero_()
    return layer


def encode(points: FloatArray, normaliser: Normaliser, encoding: Encoding) -> Tensor:
    """``(k, encoded)`` float32 of ``(k, d)`` points, as the graph computes it."""
    place = np.float32((points - normaliser.shift) * normaliser.factor)
    angles = [np.float32(frequency) * place for frequency in encoding.frequencies]
    parts = [place, *(wave for angle in angles for wave in (np.sin(angle), np.cos(angle)))]
    return torch.from_numpy(np.concatenate(parts, axis=1))


def arrays_of(layer: nn.Linear) -> tuple[AnyArray, AnyArray]:
    """Weights, inputs by outputs, and biases, as plain arrays of their own."""
    return layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy()


def set_rate(adam: torch.optim.Adam, first: float, share: float) -> None:
    """Let the rate fall from its first to zero as half a cosine; ``share`` of the training is over."""
    for group in adam.param_groups:
        group["lr"] = 0.5 * first * (1.0 + np.cos(np.pi * share))
