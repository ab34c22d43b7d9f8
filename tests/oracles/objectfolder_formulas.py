"""ObjectFolder's published programs as formulas in float64, one network and one query at a time.

Written from what those programs do, independent of ``harness.authoring.published`` and
``harness.objectfile.published``. Nothing is rounded to float32, where those programs and the imported graphs
round a network's input and all that it computes.
"""

import math
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray

Tree = dict[str, Any]


def nerf_code(vector: FloatArray, octaves: int) -> FloatArray:
    """``[v, sin v, cos v, sin 2v, cos 2v, ...]``, each the whole vector."""
    parts = [vector]
    for k in range(octaves):
        parts += [np.sin(2.0**k * vector), np.cos(2.0**k * vector)]
    return np.concatenate(parts)


def kilo_code(vector: FloatArray, octaves: int) -> FloatArray:
    """Coordinate by coordinate: itself, its cosines, its sines."""
    parts: list[float] = []
    for value in vector:
        parts.append(value)
        parts += [math.cos(2.0**k * value) for k in range(octaves)]
        parts += [math.sin(2.0**k * value) for k in range(octaves)]
    return np.array(parts)


def without_prefix(state: Tree) -> Tree:
    if all(name.startswith("module.") for name in state):
        return {name.replace("module.", ""): value for name, value in state.items()}
    return state


def dense(state: Tree, name: str, value: FloatArray) -> FloatArray:
    weight, bias = (np.asarray(state[f"{name}.{kind}"], np.float64) for kind in ("weight", "bias"))
    found: FloatArray = weight @ value + bias
    return found


def trunk(state: Tree, prefix: str, code: FloatArray, layers: int, skip: int | None) -> FloatArray:
    hidden = code
    for k in range(layers):
        hidden = np.maximum(dense(state, f"{prefix}pts_linears.{k}", hidden), 0.0)
        if k == skip:
            hidden = np.concatenate([code, hidden])
    return hidden


def mlp(state: Tree, prefix: str, vector: FloatArray) -> FloatArray:
    """Sound and touch of both versions."""
    hidden = trunk(state, prefix, nerf_code(vector, 10), 8, 4)
    return dense(state, f"{prefix}output_linear", hidden)


def gains(audio: Tree, point: FloatArray) -> FloatArray:
    """``(modes, 3)`` of AudioNet of 2.0."""
    state, to = without_prefix(audio["model_state_dict"]), audio["normalizer"]
    place = (point - to["xyz_min"]) / (np.asarray(to["xyz_max"]) - to["xyz_min"])
    columns = []
    for axis, key in zip("xyz", ("f1", "f2", "f3"), strict=True):
        low, high = (np.asarray(to[f"{key}_{end}"], np.float64).ravel() for end in ("min", "max"))
        columns.append(mlp(state, f"model_{axis}.", place) * (high - low) + low)
    return np.stack(columns, axis=1)


def ring(audio: Tree, point: FloatArray, force: FloatArray) -> FloatArray:
    """What ``OF_render.py`` writes: 132300 samples at 44.1 kHz, by the convolution that it makes."""
    start = gains(audio, point) @ force
    times = np.arange(88200) / 44100
    damped = np.exp(-np.abs(audio["dampings"])[:, None] * times)
    modal = (start[:, None] * damped * np.sin(2 * np.pi * audio["frequencies"][:, None] * times)).sum(axis=0)
    response = np.concatenate([np.zeros(88200), modal])
    impulse = np.zeros(132300)
    impulse[0] = 1.0
    size = 2 ** math.ceil(math.log2(len(response) + len(impulse) - 1))
    whole = np.fft.irfft(np.fft.rfft(impulse, size) * np.fft.rfft(response, size), size)
    begin = (len(response) - 1) // 2 - 1
    cut = whole[begin : begin + len(impulse)]
    found: FloatArray = cut / np.abs(cut).max()
    return found


def depth(touch: Tree, vertex: FloatArray, gel: FloatArray, row: int, column: int) -> float:
    """Metres from the camera, of TouchNet of 2.0."""
    state, (tilt, azimuth, press) = without_prefix(touch["model_state_dict"]), gel
    place = (vertex - touch["xyz_min"]) / (np.asarray(touch["xyz_max"]) - touch["xyz_min"])
    pixel = [
        *place, tilt / math.radians(15), math.cos(azimuth), math.sin(azimuth), (press - 0.0005) / (0.0020 -
        0.0005), row / 119, column / 159,
    ]  # fmt: skip
    return float(mlp(state, "", np.array(pixel))[0] * (0.04 - 0.0339) + 0.0339)


def spectrum(audio: Tree, voxel: FloatArray, bounds: tuple[float, float], at: tuple[int, int]) -> AnyArray:
    """``(3,)`` complex, of AudioNet of 1.0, at a frequency and a frame."""
    state, to = without_prefix(audio["model_state_dict"]), audio["normalizer"]
    low, high = bounds
    place = np.array([*(voxel - low) / (high - low), at[0] / 256, at[1] / 200])
    found = []
    for axis, key in zip("xyz", ("f1", "f2", "f3"), strict=True):
        real, imaginary = (
            mlp(state, f"model_{axis}.", place) * (to[f"{key}_max"] - to[f"{key}_min"]) + to[f"{key}_min"]
        )
        found.append(real + 1j * imaginary)
    return np.array(found)


def inverse_stft(spectra: AnyArray) -> FloatArray:
    """Windows of 400 in transforms of 512, 160 apart, added up and divided by the windows' squares."""
    window = np.zeros(512)
    window[56:456] = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(400) / 400)
    frames = spectra.shape[1]
    added, squares = np.zeros(512 + 160 * (frames - 1)), np.zeros(512 + 160 * (frames - 1))
    for k in range(frames):
        added[160 * k : 160 * k + 512] += np.fft.irfft(spectra[:, k], 512) * window
        squares[160 * k : 160 * k + 512] += window**2
    found: FloatArray = (added / np.where(squares > 1e-10, squares, 1.0))[256 : 256 + 160 * (frames - 1)]
    return found


def colour(touch: Tree, vertex: FloatArray, bounds: tuple[float, float], row: int, column: int) -> FloatArray:
    """``(3,)``, -1 to 1, of TouchNet of 1.0."""
    low, high = bounds
    place = [*(2 * ((vertex - low) / high) - 1), 2 * row / 159 - 1, 2 * column / 119 - 1]
    return mlp(without_prefix(touch["model_state_dict"]), "", np.array(place))


def osf(
    state: Tree,
    prefix: str,
    layers: int,
    skip: int | None,
    point: FloatArray,
    view: FloatArray,
    light: FloatArray,
) -> FloatArray:
    """``(4,)`` raw red, green, blue and density of one network."""
    hidden = trunk(state, prefix, nerf_code(point, 10), layers, skip)
    density = dense(state, f"{prefix}alpha_linear", hidden)
    told = [nerf_code(vector, 4) for vector in (view, light)]
    seen = np.concatenate([dense(state, f"{prefix}bottleneck_linear", hidden), *told])
    seen = np.maximum(dense(state, f"{prefix}views_lights_linears.0", seen), 0.0)
    return np.concatenate([dense(state, f"{prefix}rgb_linear", seen), density])


def kilo(look: Tree, point: FloatArray, view: FloatArray, light: FloatArray) -> FloatArray:
    """``(4,)`` of the network of a point's cell; zeros where nothing is."""
    settings, state = look["cfg"], look["model_state_dict"]
    low, high = (np.array(settings[f"global_domain_{end}"], float) for end in ("min", "max"))
    if not ((point > low + 0.001) & (point < high - 0.001)).all() or not occupied(look, point):
        return np.zeros(4)
    cells = settings["fixed_resolution"]
    size = (high - low) / cells
    i, j, k = np.trunc((point - low) / size).astype(int)
    number = i * cells[1] * cells[2] + j * cells[2] + k
    least = low + size * [i, j, k]
    local = 2 * (point - least) / (least + size - least) - 1

    def layer(name: str, value: FloatArray) -> FloatArray:
        found: FloatArray = (
            value @ np.asarray(state[f"{name}.weight"][number], float) + state[f"{name}.bias"][number]
        )
        return found

    hidden = np.maximum(layer("pts_linears.0", kilo_code(local, 10)), 0.0)
    hidden = np.maximum(layer("pts_linears.1", hidden), 0.0)
    told = [kilo_code(vector, 4) for vector in (view, light)]
    seen = np.maximum(layer("direction_layer", np.concatenate([layer("feature_linear", hidden), *told])), 0.0)
    return np.concatenate([layer("rgb_linear", seen), layer("alpha_linear", hidden)])


def occupied(look: Tree, point: FloatArray) -> bool:
    settings = look["cfg"]
    low, high = (np.array(settings[f"global_domain_{end}"], float) for end in ("min", "max"))
    sizes = settings["occupancy"]["resolution"]
    i, j, k = np.clip(((point - low) / ((high - low) / sizes)).astype(int), 0, np.array(sizes) - 1)
    return bool(look["occupancy_grid"][(i * sizes[1] + j) * sizes[2] + k])


def camera_rays(eye: FloatArray, size: int) -> FloatArray:
    """``(size, size, 3)`` directions whose depth along the axis is 1, of a camera at 2.5."""
    theta, phi = math.acos(eye[2] / 2.5), math.atan2(eye[0], -eye[1])
    about_x = np.array(
        [[1, 0, 0], [0, math.cos(theta), -math.sin(theta)], [0, math.sin(theta), math.cos(theta)]]
    )
    about_z = np.array([[math.cos(phi), -math.sin(phi), 0], [math.sin(phi), math.cos(phi), 0], [0, 0, 1]])
    turn, focal = about_z @ about_x, 355.5555419921875 * size / 256
    rays = np.empty((size, size, 3))
    for row in range(size):
        for column in range(size):
            rays[row, column] = turn @ [(column - size / 2) / focal, -(row - size / 2) / focal, -1.0]
    return rays


def ray_colour(raw: FloatArray, depths: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(3,)`` before white, and ``(samples,)`` weights, sample by sample."""
    passed, seen, weights = 1.0, np.zeros(3), []
    for k, (*rgb, density) in enumerate(raw):
        step = (depths[k + 1] - depths[k] if k + 1 < len(depths) else 1e10) * float(np.linalg.norm(direction))
        alpha = 1.0 - math.exp(-max(density, 0.0) * step)
        weights.append(passed * alpha)
        seen = seen + weights[-1] * (1.2 * (1.0 / (1.0 + np.exp(-np.array(rgb))) - 0.5) + 0.5)
        passed *= 1.0 - alpha + 1e-10
    return seen + (1.0 - sum(weights)), np.array(weights)


def finer_depths(depths: FloatArray, weights: FloatArray, count: int) -> FloatArray:
    """Depths at even shares of the weights between the first and the last, and the old ones, sorted."""
    middles, inner = 0.5 * (depths[1:] + depths[:-1]), weights[1:-1] + 1e-5
    shares = np.concatenate([[0.0], np.cumsum(inner / inner.sum())])
    added = []
    for share in np.linspace(0.0, 1.0, count):
        above = int(np.searchsorted(shares, share, side="right"))
        k, m = max(above - 1, 0), min(above, len(shares) - 1)
        width = shares[m] - shares[k]
        along = (share - shares[k]) / (width if width >= 1e-5 else 1.0)
        added.append(middles[k] + along * (middles[m] - middles[k]))
    return np.sort(np.concatenate([depths, added]))
