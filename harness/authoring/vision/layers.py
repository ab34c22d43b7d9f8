"""The weights of one tiny network while it is trained: one flat array, its layers views into it.

``feature`` and ``scatter``'s rows of it have no activation between them and are trained as one, ``mixed``.
Waves of higher octaves are trained smaller, by ``FALL`` an octave, so that what is smooth is learned first;
written out, the factor goes into the weights.
"""

from typing import NamedTuple

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.vision.network import NetworkSize, VisionWeights, scatter_rows

FALL = 2.0
"""An octave of places is so much smaller than the one before, from the second on."""

_FIRST = 0.7
"""Of He's spread: the first layer's weights."""

_DARK = -1.0
"""Of colours' logits, to begin with."""


class Layers(NamedTuple):
    """Of one network, float32; ``y = x @ weight + bias``.

    ``told`` are the rows of ``scatter`` that a kind of network is trained with (``trained_rows``).
    """

    first: AnyArray
    first_bias: AnyArray
    second: AnyArray
    second_bias: AnyArray
    density: AnyArray
    density_bias: AnyArray
    mixed: AnyArray
    told: AnyArray
    scatter_bias: AnyArray
    colour: AnyArray
    colour_bias: AnyArray


def trained_rows(size: NetworkSize) -> slice:
    """The rows of ``scatter`` that are trained.

    A matt surface looks the same from everywhere: who is told the normal needs no view, and its rows are 0.
    """
    rows = scatter_rows(size)
    return slice((rows["light"] if size.kind == "osf-v" else rows["view"]).start, rows["extras"].stop)


def layer_shapes(size: NetworkSize) -> Layers:
    """The shape of each layer."""
    wide, rows = size.width, trained_rows(size)
    shapes = size.shapes | {"mixed": (wide, wide), "told": (rows.stop - rows.start, wide)}
    return Layers(*(shapes[name] for name in Layers._fields))


def layers_of(flat: AnyArray, size: NetworkSize) -> Layers:
    """Views into ``(parameters,)``."""
    shapes = layer_shapes(size)
    ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)])
    parts = [
        flat[begin:end].reshape(shape) for begin, end, shape in zip(ends[:-1], ends[1:], shapes, strict=True)
    ]
    return Layers(*parts)


def parameter_count(size: NetworkSize) -> int:
    """Of one network as it is trained."""
    return sum(int(np.prod(shape)) for shape in layer_shapes(size))


def octave_factors(size: NetworkSize) -> AnyArray:
    """``(octaves,)`` float32: what waves of places are multiplied by."""
    factors: FloatArray = FALL ** -np.maximum(np.arange(size.octaves) - 1.0, 0.0)
    return factors.astype(np.float32)


def first_weights(size: NetworkSize, seed: int) -> AnyArray:
    """``(parameters,)`` float32, the same for every cell: neighbours begin alike."""
    random, flat = np.random.default_rng([seed, 76]), np.zeros(parameter_count(size), np.float32)
    layers, factors = layers_of(flat, size), octave_factors(size).astype(np.float64)
    spread = _FIRST * np.sqrt(2.0 / (3.0 + 3.0 * (factors**2).sum()))
    layers.first[:] = spread * random.standard_normal(layers.first.shape)
    layers.first_bias[:] = 0.3 * random.standard_normal(size.width)
    gains = {"second": 2.0, "density": 1.0, "mixed": 1.0, "told": 2.0, "colour": 1.0}
    for name, gain in gains.items():
        weight: AnyArray = getattr(layers, name)
        weight[:] = np.sqrt(gain / len(weight)) * random.standard_normal(weight.shape)
    layers.colour_bias[:] = _DARK
    return flat


def weights_of(flats: AnyArray, size: NetworkSize, density_scale: float) -> VisionWeights:
    """All networks as the file keeps them, in float16.

    Args:
        flats: ``(networks, parameters)``.
        size: of each.
        density_scale: 1/m of a density of 1.

    Raises:
        WrongUse: a number that float16 cannot hold.
    """
    stacked = [layers_of(flat, size) for flat in np.asarray(flats, np.float64)]
    arrays: dict[str, FloatArray] = {
        name: np.stack([getattr(layers, name) for layers in stacked]) for name in Layers._fields
    }
    waves = np.concatenate([np.ones(3), np.repeat(octave_factors(size).astype(np.float64), 6)])
    arrays["first"] = arrays["first"] * waves[:, None]
    count, wide = len(flats), size.width
    scatter = np.zeros((count, *size.shapes["scatter"]))
    scatter[:, scatter_rows(size)["feature"]] = np.eye(wide)
    scatter[:, trained_rows(size)] = arrays.pop("told")
    arrays |= {"feature": arrays.pop("mixed"), "feature_bias": np.zeros((count, wide)), "scatter": scatter}
    return VisionWeights(size, density_scale, **arrays).rounded()
