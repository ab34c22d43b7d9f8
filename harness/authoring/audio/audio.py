"""From modes to the network of an object's sound, and what it is worth on nodes it never saw."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper
from threadpoolctl import threadpool_limits

from harness.authoring.audio.data import SoundSamples, Split, split_nodes, wave_number
from harness.authoring.audio.metrics import (
    DURATION,
    RATE,
    interpolated,
    nearest_trained,
    relative_errors,
    sound_distances,
)
from harness.authoring.audio.profiles import AudioProfile
from harness.authoring.audio.waves import Waves, fit_enough_waves
from harness.authoring.training import Report, median_seconds
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.audio.part import NETWORK, network_tensors
from harness.objectfile.audio.table import scaled
from harness.objectfile.graph import Nodes, Storage
from harness.objectfile.runtime import Network
from harness.sim.modal.modes import Modes
from harness.sim.modal.solve import timed
from harness.sim.sound.modal_sound import audible
from harness.sim.sound.synthesis import synthesize

_TIMED = 200
_CHUNK = 256

_ANYWHERE = 1.0
"""m: a graph that belongs to no object yet is not asked how near to its surface a point is."""


@dataclass(frozen=True, eq=False)
class AuthoredAudio:
    """A network and its worth."""

    graph: ModelProto  #: of the network.
    split: Split  #: of the nodes.
    errors: Mapping[str, Mapping[str, float]]
    """of each way to the shapes at held-out nodes, ``"network"``, ``"nearest_trained"``, ``"linear"``, and
    ``"table_float16"`` at the nodes themselves: by a name with its unit."""
    settings: Mapping[str, str | float | int | bool | None]  #: how it was made.
    seconds: Mapping[str, float]  #: s of ``"train"`` and ``"measure"`` (``solve.timed``).


def author_audio(
    modes: Modes,
    dampings: FloatArray,
    profile: AudioProfile,
    seed: int,
    report: Report,
    threads: int = 1,
) -> AuthoredAudio:
    """Train and measure a network for canonical modes (``data.canonical``) with ``(m,)`` dampings in 1/s.

    ``seed`` is the random seed of the split and of the waves, ``threads`` the number of threads of the fit.
    """
    split = split_nodes(len(modes.points), seed=seed)
    seconds: dict[str, float] = {}
    with timed(seconds, "train"), threadpool_limits(limits=threads, user_api="blas"):
        report("fitting waves", 0.0)
        spec, number = profile.network, wave_number(modes)
        nodes = SoundSamples(modes.points[split.trained], modes.shapes[split.trained])
        fitted = fit_enough_waves(nodes, np.arange(len(nodes.points)), number, spec, seed)
        graph = waves_graph(fitted.network, spec.storage)
    settings: dict[str, str | float] = {
        "network": "waves",
        "width": len(fitted.network.phases),
        "wave_number_rad_per_m": number,
        "reach": fitted.reach,
        "ridge": fitted.readout.ridge,
        "storage": spec.storage,
        "expected_relative_error": fitted.readout.expected,
    }
    report("measuring", 0.0)
    with timed(seconds, "measure"):
        errors = measure_audio(modes, dampings, split, graph, profile.sounds)
    return AuthoredAudio(graph, split, errors, settings, seconds)


def measure_audio(
    modes: Modes, dampings: FloatArray, split: Split, graph: ModelProto, sounds: int
) -> dict[str, dict[str, float]]:
    """Errors of the network and of what needs none, at held-out nodes; sounds of some of them.

    A sound is that of a unit impulse along the normal, ``sum g exp(-d t) sin(w t)``, ``DURATION`` long at
    ``RATE``.
    """
    truth = modes.shapes[split.held_out]
    network = opened(graph, len(modes.frequencies))
    table, scales = scaled(truth)
    # What is linear between nodes of a table is not measured here: its nodes are all nodes.
    points = modes.points[split.held_out]
    parts = [
        network({"points": points[first : first + _CHUNK]})["gains"]
        for first in range(0, len(points), _CHUNK)
    ]
    found = {
        "network": np.concatenate(parts).astype(np.float64),
        "nearest_trained": nearest_trained(modes, split),
        "linear": interpolated(modes, split),
        "table_float16": table.astype(np.float64) * scales[:, None],
    }
    chosen = np.linspace(0, len(truth) - 1, min(sounds, len(truth))).astype(np.int64)
    errors = {}
    for name, shapes in found.items():
        gaps = relative_errors(shapes, truth)
        gains = {
            "gain_error_median": float(np.median(gaps)),
            "gain_error_p95": float(np.quantile(gaps, 0.95)),
        }
        errors[name] = gains | _sound_errors(modes, dampings, split, shapes, chosen)
    vertex = {"points": modes.points[split.held_out[:1]]}
    errors["network"]["seconds_per_vertex"] = median_seconds(lambda: network(vertex), _TIMED)
    errors["network"]["bytes"] = float(len(graph.SerializeToString()))
    errors["table_float16"]["bytes"] = float(2 * modes.shapes.size)
    return errors


def opened(graph: ModelProto, modes: int) -> Network:
    """A graph that can be asked, before it is part of an ObjectFile."""
    points, gains = network_tensors(modes, _ANYWHERE)
    return Network(graph.SerializeToString(), NETWORK, [points], [gains])


def _sound_errors(
    modes: Modes, dampings: FloatArray, split: Split, shapes: AnyArray, chosen: AnyArray
) -> dict[str, float]:
    """Compute medians over the chosen nodes; empty where no mode is audible."""
    if not audible(modes.frequencies, RATE).any():
        return {}
    nodes = split.held_out[chosen]
    distances = []
    for node, place in zip(nodes, chosen, strict=True):
        normal = modes.normals[node]
        gains = np.stack([shapes[place] @ normal, modes.shapes[node] @ normal])
        sound = synthesize(modes.frequencies, dampings, gains, DURATION, RATE, "double").sound
        distances.append(sound_distances(sound[0], sound[1]))
    return {
        "stft_distance": float(np.median([each.stft for each in distances])),
        "envelope_distance": float(np.median([each.envelope for each in distances])),
        "spectral_error_db": float(np.median([each.spectral_db for each in distances])),
        "stft_distance_worst": float(np.max([each.stft for each in distances])),
        "envelope_distance_worst": float(np.max([each.envelope for each in distances])),
    }


def waves_graph(network: Waves, storage: Storage = "float32") -> ModelProto:
    """Write plane waves as a graph, from points in metres to the shapes of the modes there.

    Points are float64: an object scanned far from its origin would lose the digits by which points differ
    before they are normalised. The linear layer has the storage type, the waves themselves are float32: an
    error of a wave vector is large at the far ends of the object.
    """
    modes = network.weights.shape[1] // 3
    nodes = Nodes(storage)
    moved = nodes.add("Sub", "points", nodes.constant(np.asarray(network.shift, np.float64)))
    normalised = nodes.add("Mul", moved, nodes.constant(np.full(3, network.factor, np.float64)))
    place = nodes.add("Cast", normalised, to=TensorProto.FLOAT)
    vectors = nodes.constant(network.vectors.astype(np.float32))
    phases = nodes.constant(network.phases.astype(np.float32))
    waves = nodes.add("Sin", nodes.add("Gemm", place, vectors, phases))
    seen = nodes.add("Concat", waves, place, axis=1)
    weights = nodes.weight(network.weights[:-1], "the linear layer")
    offsets = nodes.weight(network.weights[-1], "the linear layer's offset")
    flat = nodes.add("Gemm", seen, weights, offsets)
    nodes.add("Reshape", flat, nodes.constant(np.array([-1, modes, 3])), name="gains")
    return nodes.model(
        "audio",
        [helper.make_tensor_value_info("points", TensorProto.DOUBLE, ["n", 3])],
        [helper.make_tensor_value_info("gains", TensorProto.FLOAT, ["n", modes, 3])],
        "Points (n, 3), m in the object's frame, to mass-normalised mode shapes (n, m, 3), 1/sqrt(kg).",
    )
