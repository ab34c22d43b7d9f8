"""Tables as ObjectFolder publishes them, with random weights that no transpose or order leaves alone."""

from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray

Tree = dict[str, Any]

MODES = 7
SOUND = ("f1", "f2", "f3")


def second(seed: int = 0, *, prefix: str = "module.", vectors: bool = True, kilo: bool = True) -> Tree:
    """An ObjectFile of 2.0.

    Args:
        seed: of the weights.
        prefix: before every name of a weight of sound and touch.
        vectors: whether normalisers are vectors; else one number for all.
        kilo: whether the look is a KiloOSF; else a coarse and a fine OSF.
    """
    random = np.random.default_rng(seed)
    return {
        "VisionNet": kilo_look(random) if kilo else osf_look(random, importance=5),
        "AudioNet": gains(random, prefix, vectors),
        "TouchNet": depths(random, prefix, vectors),
    }


def first(seed: int = 0, prefix: str = "module.") -> Tree:
    """An ObjectFile of 1.0."""
    random = np.random.default_rng(seed)
    sound = {
        f"{key}_{end}": float(value)
        for key in SOUND
        for end, value in zip(("min", "max"), (-0.3, 0.9), strict=True)
    }
    look = {
        "global_step": 200_000,
        "optimizer_state_dict": {"state": {0: {"step": 1}}, "param_groups": [{"lr": 5e-4, "params": [0]}]},
        "network_fn_state_dict": _osf(random, "", 8, 12, 4, (10, 4)),
        "network_fine_state_dict": _osf(random, "", 8, 12, 4, (10, 4)),
    }
    voxels = np.argwhere(random.random((6, 6, 6)) < 0.5) + np.array([3, 9, 14])
    audio = {
        "normalizer": sound,
        "voxel_vertex": voxels,
        "translation": np.array([0.1, 0.05, 0.0]),
        "scale": 4.0,
        "model_state_dict": _branches(random, prefix, 5, 2),
    }
    return {
        "VisionNet": look,
        "AudioNet": audio,
        "TouchNet": {"model_state_dict": _mlp(random, prefix, 5, 3)},
    }


def gains(random: np.random.Generator, prefix: str, vectors: bool) -> Tree:
    """AudioNet of 2.0."""
    least, most = random.uniform(-2.0, -1.0, (3, MODES)), random.uniform(1.0, 3.0, (3, MODES))
    normaliser: Tree = {"xyz_min": np.array([-0.06, -0.05, 0.01]), "xyz_max": np.array([0.05, 0.09, 0.12])}
    if not vectors:
        normaliser = {"xyz_min": -0.06, "xyz_max": 0.12}
    for k, key in enumerate(SOUND):
        normaliser[f"{key}_min"] = least[k : k + 1] if vectors else float(least[k, 0])
        normaliser[f"{key}_max"] = most[k] if vectors else float(most[k, 0])
    return {
        "normalizer": normaliser,
        "frequencies": random.uniform(200.0, 30_000.0, MODES),
        "dampings": random.uniform(-40.0, 80.0, MODES),
        "model_state_dict": _branches(random, prefix, 3, MODES),
    }


def depths(random: np.random.Generator, prefix: str, vectors: bool) -> Tree:
    """TouchNet of 2.0."""
    low, high = np.array([-0.06, -0.05, 0.01]), np.array([0.05, 0.09, 0.12])
    box: Tree = {"xyz_min": low, "xyz_max": high} if vectors else {"xyz_min": -0.06, "xyz_max": 0.12}
    return {**box, "model_state_dict": _mlp(random, prefix, 9, 1)}


def osf_look(
    random: np.random.Generator, importance: int = 0, layers: int = 4, refeed: int | str = 1
) -> Tree:
    """VisionNet of 2.0 of one network, or of a coarse and a fine one."""
    settings = _settings(importance) | {
        "num_hidden_layers": layers,
        "hidden_layer_size": 12,
        "refeed_position_index": refeed,
    }
    names = ("model_coarse.", "model_fine.") if importance else ("",)
    skip = refeed if isinstance(refeed, int) else None
    state = {
        key: array for name in names for key, array in _osf(random, name, layers, 12, skip, (10, 4)).items()
    }
    return {"cfg": settings, "model_state_dict": state}


def kilo_look(random: np.random.Generator, cells: tuple[int, int, int] = (4, 3, 2)) -> Tree:
    """VisionNet of 2.0 of a network a cell, on a small lattice of unequal sides."""
    width, count, voxels = 8, int(np.prod(cells)), tuple(4 * size for size in cells)
    settings = _settings(0) | {
        "fixed_resolution": list(cells),
        "global_domain_min": [-0.6, -0.6, -0.6],
        "global_domain_max": [0.6, 0.6, 0.6],
        "occupancy": {"resolution": list(voxels)},
        "num_hidden_layers": 2,
        "hidden_layer_size": width,
        "refeed_position_index": "None",
    }
    sizes = {
        "pts_linears.0": (63, width),
        "pts_linears.1": (width, width),
        "alpha_linear": (width, 1),
        "feature_linear": (width, width),
        "direction_layer": (width + 54, width),
        "rgb_linear": (width, 3),
    }
    state: Tree = {}
    for name, (taken, given) in sizes.items():
        state[f"{name}.weight"] = _weights(random, taken, (count, taken, given))
        state[f"{name}.bias"] = _weights(random, 4, (count, given))
    occupied = np.zeros(voxels, np.bool_)
    occupied[2:-3, 3:-2, 1:-1] = random.random((voxels[0] - 5, voxels[1] - 5, voxels[2] - 2)) < 0.7
    return {"cfg": settings, "model_state_dict": state, "occupancy_grid": occupied.ravel()}


def _settings(importance: int) -> Tree:
    return {
        "near": 0.01, "far": 4, "num_samples_per_ray": 24, "num_importance_samples_per_ray": importance,
        "blender_white_background": True, "no_color_sigmoid": False, "llff_lindisp": False,
        "num_frequencies": 10, "num_frequencies_direction": 4, "num_frequencies_light": 4,
        "perturb": 1.0, "dataset_type": "osf", "spiral_radius": None,
    }  # fmt: skip


def _osf(
    random: np.random.Generator,
    prefix: str,
    layers: int,
    width: int,
    skip: int | None,
    octaves: tuple[int, int],
) -> Tree:
    place, direction = (3 + 6 * count for count in octaves)
    sizes = {}
    for k in range(layers):
        taken = place if k == 0 else width + (place if skip is not None and k == skip + 1 else 0)
        sizes[f"pts_linears.{k}"] = (taken, width)
    sizes |= {
        "alpha_linear": (width, 1),
        "bottleneck_linear": (width, width),
        "views_lights_linears.0": (width + 2 * direction, width // 2),
        "rgb_linear": (width // 2, 3),
    }
    return {
        key: array
        for name, size in sizes.items()
        for key, array in _linear(random, prefix + name, *size).items()
    }


def _branches(random: np.random.Generator, prefix: str, inputs: int, outputs: int) -> Tree:
    found: Tree = {}
    for axis in "xyz":
        found |= _mlp(random, f"{prefix}model_{axis}.", inputs, outputs)
    return found


def _mlp(random: np.random.Generator, prefix: str, inputs: int, outputs: int, width: int = 8) -> Tree:
    encoded = inputs * 21
    found: Tree = {}
    for k in range(8):
        taken = encoded if k == 0 else width + (encoded if k == 5 else 0)
        found |= _linear(random, f"{prefix}pts_linears.{k}", taken, width)
    found |= _linear(random, f"{prefix}views_linears.0", width, width // 2)
    return found | _linear(random, f"{prefix}output_linear", width, outputs)


def _linear(random: np.random.Generator, name: str, taken: int, given: int) -> Tree:
    return {
        f"{name}.weight": _weights(random, taken, (given, taken)),
        f"{name}.bias": _weights(random, 4, (given,)),
    }


def _weights(random: np.random.Generator, taken: int, shape: tuple[int, ...]) -> AnyArray:
    """Of a size at which a signal neither dies nor grows through layers cut off at zero."""
    found: AnyArray = random.uniform(-1.0, 1.2, shape) * np.sqrt(6.0 / taken)
    return found.astype(np.float32)
