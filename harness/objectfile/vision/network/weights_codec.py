"""The weights of all networks as a file holds them: what is the same in every network, once.

Of a matt object told its normal the rows of views are 0 in every network, and those of the feature, which is
trained as one with the layer before, are the identity: 1728 of a compact network's 6052 numbers.
"""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from harness.basics.arrays import AnyArray
from harness.objectfile.vision.network.network import NetworkSize, VisionWeights
from harness.objectfile.vision.network.plain import scatter_rows
from harness.objectfile.vision_tensors import EXTRAS, Kind

WEIGHTS = "networks."
"""Before the names of weights; outputs have names of their own."""

_SCATTER = "scatter"


def kept_weights(weights: VisionWeights) -> dict[str, AnyArray]:
    """What is kept, by its name: ``scatter`` in four parts, ``scatter.feature`` and so on.

    Args:
        weights: as they are to come back, bit for bit.

    Returns:
        Of each name ``(networks, rows, columns)``, of biases one row; ``(1, rows, columns)`` where every
        network has the same bits. A part without rows is among them.
    """
    kept: dict[str, AnyArray] = {}
    for name, array in weights.arrays():
        if name == _SCATTER:
            parts = {f"{name}.{part}": array[:, at] for part, at in scatter_rows(weights.size).items()}
            kept |= {each: _once(rows) for each, rows in parts.items() if rows.size}
        else:
            kept[name] = _once(array[:, None] if name.endswith("bias") else array)
    return kept


def held_weights(held: Mapping[str, AnyArray], count: int, told: bool, density_scale: float) -> VisionWeights:
    """Weights that a file holds; ``scatter`` may be whole too, as files had it that are there.

    Args:
        held: by ``WEIGHTS`` and the name.
        count: of networks.
        told: whether they have further inputs.
        density_scale: 1/m that a density of 1 stands for.

    Raises:
        KeyError: with the name that is missing.
        WrongUse, ValueError, IndexError: arrays that do not fit together.
    """
    arrays: dict[str, AnyArray] = {}
    for each in fields(VisionWeights)[2:]:
        name = each.name
        whole = _scatter(held, count, told) if name == _SCATTER else _every(held[WEIGHTS + name], count)
        arrays[name] = whole[:, 0] if name.endswith("bias") else whole
    return VisionWeights(_size(arrays, told), density_scale, **arrays)


def _scatter(held: Mapping[str, AnyArray], count: int, told: bool) -> AnyArray:
    name = WEIGHTS + _SCATTER
    if name in held:
        return held[name]
    parts = ("feature", "view", "light", "extras") if told else ("feature", "view", "light")
    return np.concatenate([_every(held[f"{name}.{part}"], count) for part in parts], axis=1)


def _once(array: AnyArray) -> AnyArray:
    """The first alone where all are the same; zeros of two signs are not."""
    whole = np.ascontiguousarray(array)
    bits = whole.view(np.uint16)
    return whole[:1] if (bits == bits[:1]).all() else whole


def _every(array: AnyArray, count: int) -> AnyArray:
    """``(count, ...)`` of what was kept once, or of each."""
    return np.broadcast_to(array, (count, *array.shape[1:])) if len(array) == 1 else array


def _size(arrays: Mapping[str, AnyArray], told: bool) -> NetworkSize:
    place, wide = arrays["first"].shape[1:]
    kind: Kind = "osf-v" if told else "osf"
    directions = arrays[_SCATTER].shape[1] - wide - EXTRAS[kind]
    return NetworkSize(wide, (place - 3) // 6, (directions // 2 - 3) // 6, kind)
