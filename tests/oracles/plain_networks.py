"""The tiny networks of a look in plain float64, a layer at a time: what the graph must agree with."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.vision.network import VisionGrid, VisionModel


@dataclass(frozen=True, eq=False)
class Query:
    """What networks are asked of samples."""

    networks: IntArray  #: ``(n,)`` of each sample.
    points: FloatArray  #: ``(n, 3)`` m, object frame.
    views: FloatArray  #: ``(n, 3)`` unit, from the camera.
    light: FloatArray  #: ``(3,)`` unit, towards the lamp.
    extras: FloatArray  #: ``(n, 4)`` visibility and normal; ``(n, 0)`` for networks that are not told.


def encoded(values: FloatArray, octaves: int) -> FloatArray:
    """``(n, 3 + 6 octaves)``: ``[v, sin v, cos v, sin 2v, cos 2v, sin 4v, ...]``, each the whole vector."""
    waves = [wave(2.0**k * values) for k in range(octaves) for wave in (np.sin, np.cos)]
    return np.concatenate([values, *waves], axis=-1)


def local_places(grid: VisionGrid, points: FloatArray, networks: IntArray) -> FloatArray:
    """``(n, 3)``: the points, -1 to 1 in the cells of their networks, to which they are moved if beside."""
    scaled = (points - grid.low) / grid.cell - grid.cells[networks]
    clipped: FloatArray = np.clip(2.0 * scaled - 1.0, -1.0, 1.0)
    return clipped


def evaluate(model: VisionModel, asked: Query) -> tuple[FloatArray, FloatArray]:
    """``(n,)`` densities in 1/m, and ``(n, 3)`` scattered fractions."""
    density, colour = np.empty(len(asked.points)), np.empty((len(asked.points), 3))
    local, size = local_places(model.grid, asked.points, asked.networks), model.weights.size
    for network in np.unique(asked.networks):
        at = np.flatnonzero(asked.networks == network)
        w: dict[str, AnyArray] = {k: a[network].astype(np.float64) for k, a in model.weights.arrays()}
        hidden = np.maximum(encoded(local[at], size.octaves) @ w["first"] + w["first_bias"], 0.0)
        hidden = np.maximum(hidden @ w["second"] + w["second_bias"], 0.0)
        raw = hidden @ w["density"] + w["density_bias"]
        feature = hidden @ w["feature"] + w["feature_bias"]
        lights = np.broadcast_to(encoded(asked.light, size.turns), (len(at), size.direction))
        seen = np.concatenate(
            [feature, encoded(asked.views[at], size.turns), lights, asked.extras[at]], axis=1
        )
        hidden = np.maximum(seen @ w["scatter"] + w["scatter_bias"], 0.0)
        logits = np.clip(hidden @ w["colour"] + w["colour_bias"], -700.0, 700.0)
        density[at] = model.weights.density_scale * np.maximum(raw[:, 0], 0.0)
        colour[at] = 1.0 / (1.0 + np.exp(-logits))
    return density, colour
