"""The sound network's graph computes what its definitions say, from any weights that fit."""

import numpy as np
import onnxruntime
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx import ModelProto

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.objectfile.audio.graph import OutputScales, audio_graph
from harness.objectfile.graph import Encoding, MlpWeights, Normaliser
from tests.samples.object_bench import ENCODING, MODES, computed, egg, normaliser, perceptron, scales

FLOAT32 = 3e-5
"""Relative to the greatest gain: a thousand roundings of float32 (6e-8), which is what a sum over a layer
and a sine of some radians can add up to."""

POINTS = np.random.default_rng(1).uniform([0.08, -0.06, 0.0], [0.14, 0.02, 0.1], (33, 3))


def run(model: ModelProto, points: FloatArray) -> FloatArray:
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return np.asarray(session.run(None, {"points": points})[0], np.float64)


def three(skips: tuple[int, ...] = ()) -> list[MlpWeights]:
    return [perceptron(seed, MODES, skips=skips) for seed in (1, 2, 3)]


@pytest.mark.parametrize("skips", [(), (2,), (1, 3)], ids=str)
@pytest.mark.parametrize("branches", [1, 3])
def test_the_graph_is_the_network_as_defined(branches: int, skips: tuple[int, ...]) -> None:
    nets = three(skips) if branches == 3 else [perceptron(4, 3 * MODES, skips=skips)]
    normal = normaliser(egg())
    found = run(audio_graph(nets, normal, scales(), ENCODING), POINTS)
    exact = computed(nets, POINTS, normal, scales())
    assert found.shape == (33, MODES, 3)
    assert np.abs(found - exact).max() <= FLOAT32 * np.abs(exact).max()


@settings(max_examples=15, deadline=None)
@given(
    octaves=st.integers(0, 6),
    first=st.floats(0.3, 4.0),
    modes=st.integers(1, 5),
    width=st.integers(1, 9),
    depth=st.integers(0, 4),
    seed=st.integers(0, 10**6),
)
def test_any_size_of_network_and_encoding(
    octaves: int, first: float, modes: int, width: int, depth: int, seed: int
) -> None:
    encoding, random = Encoding.octaves(octaves, first), np.random.default_rng(seed)
    layers, before = [], encoding.width(3)
    for layer in range(depth + 1):
        given = 3 * modes if layer == depth else width
        layers.append((random.normal(size=(before, given)) / np.sqrt(before), random.normal(size=given)))
        before = given
    net, scale = MlpWeights(tuple(layers)), scales(modes)
    normal = normaliser(egg())
    exact = computed([net], POINTS, normal, scale, encoding)
    found = run(audio_graph([net], normal, scale, encoding), POINTS)
    # Angles reach first 2^octaves; their float32 rounding passes through every layer.
    room = FLOAT32 * (1.0 + first * 2.0**octaves / 16.0) * 3.0
    assert np.abs(found - exact).max() <= room * max(np.abs(exact).max(), float(scale.factor.max()))


def test_the_papers_network_has_its_63_inputs_and_its_skip() -> None:
    assert Encoding.octaves(10).width(3) == 63
    sizes = [63, 256, 256, 256, 256, 319, 256, 256, 256]
    layers = [(np.full((into, 256), 1e-3), np.zeros(256)) for into in sizes[:-1]]
    net = MlpWeights((*layers, (np.full((256, 4), 1e-3), np.zeros(4))), (5,))
    ones = OutputScales(np.ones((4, 3)), np.zeros((4, 3)))
    model = audio_graph([net, net, net], normaliser(egg()), ones)
    assert run(model, POINTS).shape == (33, 4, 3)


def test_the_same_weights_give_the_same_bytes() -> None:
    first, second = (audio_graph(three(), normaliser(egg()), scales(), ENCODING) for _ in range(2))
    assert first.SerializeToString(deterministic=True) == second.SerializeToString(deterministic=True)


def test_half_precision_weights_halve_the_file_and_cost_their_rounding() -> None:
    nets, normal = [perceptron(5, 3 * MODES, width=64)], normaliser(egg())
    full, half = (audio_graph(nets, normal, scales(), ENCODING, kind) for kind in ("float32", "float16"))
    assert half.ByteSize() < 0.6 * full.ByteSize()
    exact = computed(nets, POINTS, normal, scales())
    gap = np.abs(run(half, POINTS) - exact).max() / np.abs(exact).max()
    assert 0.0 < gap < 5e-3


def test_an_object_far_from_its_origin_keeps_its_digits() -> None:
    nets, normal = [perceptron(6, 3 * MODES)], normaliser(egg())
    away = np.array([1000.0, -2000.0, 500.0])
    moved = Normaliser(normal.shift + away, normal.factor)
    near = run(audio_graph(nets, normal, scales(), ENCODING), POINTS)
    far = run(audio_graph(nets, moved, scales(), ENCODING), POINTS + away)
    assert np.abs(far - near).max() <= FLOAT32 * np.abs(near).max()


def test_subnormal_weights_are_written_as_zero() -> None:
    weight = np.full((3, 3), 1e-40)
    model = audio_graph(
        [MlpWeights(((weight, np.array([1.0, 2.0, 3.0])),))],
        normaliser(egg()),
        OutputScales(np.ones((1, 3)), np.zeros((1, 3))),
        Encoding(()),
    )
    assert run(model, POINTS) == pytest.approx(np.tile([1.0, 2.0, 3.0], (33, 1, 1)), abs=0.0)


def wrong_layer(index: int, shape: tuple[int, int]) -> MlpWeights:
    layers = list(perceptron(0, MODES).layers)
    layers[index] = (np.zeros(shape), np.zeros(shape[1]))
    return MlpWeights(tuple(layers))


@pytest.mark.parametrize(
    ("nets", "said"),
    [
        ([], "branches"),
        (three()[:2], "branches"),
        ([perceptron(0, 4)], "3 m from one"),
        ([perceptron(0, 5), perceptron(0, 5), perceptron(0, 6)], "outputs"),
        ([wrong_layer(1, (31, 32))] * 3, "layer 1 of branch 0"),
        ([wrong_layer(0, (32, 27))] * 3, "transposed"),
        ([MlpWeights(perceptron(0, MODES).layers, (9,))] * 3, "skips"),
        ([perceptron(0, MODES + 1)] * 3, "scales.factor"),
    ],
    ids=["none", "two", "no multiple", "unequal", "inner", "torch order", "skip", "scales"],
)
def test_weights_that_do_not_fit_are_named(nets: list[MlpWeights], said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        audio_graph(nets, normaliser(egg()), scales(), ENCODING)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e39])
def test_weights_that_are_not_finite_are_refused(bad: float) -> None:
    net = perceptron(0, 3 * MODES)
    net.layers[1][0][2, 3] = bad
    with pytest.raises(WrongUse, match=r"layer 1 .* 1 numbers .*finite"):
        audio_graph([net], normaliser(egg()), scales(), ENCODING)


def test_a_weight_too_large_for_half_precision_is_refused() -> None:
    net = perceptron(0, 3 * MODES)
    net.layers[1][0][2, 3] = 1e5
    with pytest.raises(WrongUse, match="float16"):
        audio_graph([net], normaliser(egg()), scales(), ENCODING, "float16")


def test_a_flat_box_is_refused() -> None:
    with pytest.raises(WrongUse, match="extent"):
        Normaliser.unit_box(np.zeros(3), np.array([1.0, 1.0, 0.0]))
