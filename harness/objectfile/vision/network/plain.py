"""The tiny networks in plain float64, a layer at a time: what every faster way must agree with."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.vision.network.network import NetworkSize, VisionModel, VisionWeights


@dataclass(frozen=True, eq=False)
class Query:
    """What networks are asked of samples.

    Attributes:
        networks: ``(n,)`` of each sample.
        points: ``(n, 3)`` m, object frame.
        views: ``(n, 3)`` unit, from the camera.
        light: ``(3,)`` unit, towards the lamp.
        extras: ``(n, 4)`` visibility and normal; ``(n, 0)`` for networks that are not told.
    """

    networks: IntArray
    points: FloatArray
    views: FloatArray
    light: FloatArray
    extras: FloatArray


def encoded(values: FloatArray, octaves: int) -> FloatArray:
    """``(n, 3 + 6 octaves)``: ``[v, sin v, cos v, sin 2v, cos 2v, sin 4v, ...]``, each the whole vector."""
    waves = [wave(2.0**k * values) for k in range(octaves) for wave in (np.sin, np.cos)]
    return np.concatenate([values, *waves], axis=-1)


def scatter_rows(size: NetworkSize) -> dict[str, slice]:
    """Which rows of ``VisionWeights.scatter`` belong to what."""
    ends = np.cumsum([0, size.width, size.direction, size.direction, size.extras])
    names = ("feature", "view", "light", "extras")
    return {name: slice(int(a), int(b)) for name, a, b in zip(names, ends[:-1], ends[1:], strict=True)}


def looks(weights: VisionWeights) -> bool:
    """Whether any network may answer otherwise from another side: some row of views is not 0."""
    return bool(weights.scatter[:, scatter_rows(weights.size)["view"]].any())


def evaluate(model: VisionModel, asked: Query) -> tuple[FloatArray, FloatArray]:
    """Densities and scattered fractions of samples.

    Returns:
        ``(n,)`` 1/m, and ``(n, 3)`` 0 to 1 in linear red, green and blue.

    Raises:
        OutOfDomain: a network that there is not.
    """
    density, colour = np.empty(len(asked.points)), np.empty((len(asked.points), 3))
    local = model.grid.local(asked.points, asked.networks)
    for network in np.unique(asked.networks):
        at = np.flatnonzero(asked.networks == network)
        density[at], colour[at] = _one(
            model, int(network), local[at], asked.views[at], asked.light, asked.extras[at]
        )
    return density, colour


def _one(
    model: VisionModel,
    network: int,
    local: FloatArray,
    views: FloatArray,
    light: FloatArray,
    extras: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    size, scale = model.weights.size, model.weights.density_scale
    w: dict[str, AnyArray] = {k: a[network].astype(np.float64) for k, a in model.weights.arrays()}
    hidden = np.maximum(encoded(local, size.octaves) @ w["first"] + w["first_bias"], 0.0)
    hidden = np.maximum(hidden @ w["second"] + w["second_bias"], 0.0)
    raw = hidden @ w["density"] + w["density_bias"]
    feature = hidden @ w["feature"] + w["feature_bias"]
    lights = np.broadcast_to(encoded(light, size.turns), (len(local), size.direction))
    seen = np.concatenate([feature, encoded(views, size.turns), lights, extras], axis=1)
    hidden = np.maximum(seen @ w["scatter"] + w["scatter_bias"], 0.0)
    logits = np.clip(hidden @ w["colour"] + w["colour_bias"], -700.0, 700.0)
    return scale * np.maximum(raw[:, 0], 0.0), 1.0 / (1.0 + np.exp(-logits))
