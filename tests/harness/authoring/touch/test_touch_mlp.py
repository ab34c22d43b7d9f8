"""The paper's network of touch: its inputs and layers, its graph against torch, and resuming to the bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from onnx import numpy_helper

from harness.authoring.touch.data import DEPTHS, MOST_TILT
from harness.authoring.touch.profiles import TouchPerceptronSpec, touch_profile
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.materials import MATERIALS
from harness.objectfile.file import create_object
from harness.objectfile.graph import MlpWeights
from harness.objectfile.touch.part import with_touch
from harness.objectfile.touch.perceptron import paper_normaliser, perceptron_graph, pixel_domain
from harness.objectfile.touch.pixels import pixel_queries
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.verify.verify import verify
from harness.sim.gel.presses import Presses
from tests.samples import touch_bench as tb

pytest.importorskip("torch")

from harness.authoring.touch.mlp import LearnedMaps, TouchTraining, learned_from

SMALL = TouchPerceptronSpec(depth=3, width=24, octaves=3, skip=2, presses=12, epochs=3, steps=4, batch=64)


@pytest.fixture(scope="module")
def learned() -> LearnedMaps:
    return learned_from(replace(tb.bench(), nodes=tb.coded().nodes[np.arange(10)]), SMALL.presses, 0)


def inputs(count: int) -> FloatArray:
    low, high = tb.peg().bounds
    least, most = pixel_domain(low, high, DEPTHS, MOST_TILT, tb.SENSOR)
    return np.asarray(least + np.random.default_rng(1).random((count, 9)) * (most - least))


def test_a_resumed_training_ends_in_the_same_bits(learned: LearnedMaps, tmp_path: Path) -> None:
    whole, first = TouchTraining(SMALL, learned, 0), TouchTraining(SMALL, learned, 0)
    while not whole.done:
        whole.step_epoch()
    first.step_epoch()
    first.save(tmp_path / "checkpoint.npz")
    again = TouchTraining(SMALL, learned, 0)
    again.load(tmp_path / "checkpoint.npz")
    while not again.done:
        again.step_epoch()
    assert again.losses == whole.losses
    assert again.finish().graph.SerializeToString() == whole.finish().graph.SerializeToString()
    assert whole.losses[-1] < whole.losses[0]


def test_a_checkpoint_of_something_else_is_refused(learned: LearnedMaps, tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.npz"
    training = TouchTraining(SMALL, learned, 0)
    training.save(path)
    with pytest.raises(DataRefused, match="another network, object, data or seed"):
        TouchTraining(SMALL, learned, 1).load(path)
    with pytest.raises(DataRefused, match="another network, object, data or seed"):
        TouchTraining(SMALL, replace(learned, maps=learned.maps * 2), 0).load(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(DataRefused, match="delete it to begin anew"):
        training.load(path)


def test_the_papers_network_in_onnx_is_torchs(learned: LearnedMaps) -> None:
    """Its sizes, and its answers to 1e-5 of the range of what it can say."""
    spec = touch_profile("paper").perceptron
    assert spec is not None
    training = TouchTraining(spec, learned, 0)
    graph = training.finish().graph
    weights = [numpy_helper.to_array(each) for each in graph.graph.initializer if len(each.dims) == 2]
    shapes = [each.shape for each in weights if each.shape[0] > 9]
    assert shapes == [(189, 256), *[(256, 256)] * 4, (445, 256), *[(256, 256)] * 2, (256, 1)]
    session = onnxruntime.InferenceSession(graph.SerializeToString(), providers=["CPUExecutionProvider"])
    asked = inputs(400)
    found, wanted = session.run(None, {"pixel": asked})[0], training.predict(asked)
    assert np.abs(found - wanted).max() < 1e-5 * max(np.ptp(wanted), np.abs(wanted).max())


def test_inputs_are_normalised_as_the_paper_does() -> None:
    low, high = tb.peg().bounds
    least, most = pixel_domain(low, high, DEPTHS, MOST_TILT, tb.SENSOR)
    normaliser = paper_normaliser(least, most)
    ends = [(each - normaliser.shift) * normaliser.factor for each in (least, most)]
    np.testing.assert_allclose(ends[0], [0, 0, 0, 0, -1, -1, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(ends[1], np.ones(9), atol=1e-12)


def test_pixels_are_asked_row_by_row_and_half_a_turn_backwards() -> None:
    one = Presses(np.ones((1, 3)), np.eye(3)[:1], *(np.array([each]) for each in (1e-3, 0.1, 0.7, 0.0)))
    asked = pixel_queries(one, tb.SENSOR)[0]
    np.testing.assert_allclose(asked[0, :7], [1, 1, 1, 0.1, np.cos(0.7), np.sin(0.7), 1e-3])
    assert asked[1, 7:].tolist() == [0, 1]
    assert asked[-1, 7:].tolist() == [tb.SENSOR.rows - 1, tb.SENSOR.columns - 1]
    turned = pixel_queries(replace(one, yaws=np.array([np.pi])), tb.SENSOR)[0]
    np.testing.assert_array_equal(turned, asked[::-1])
    with pytest.raises(OutOfDomain, match="0 and 180 deg"):
        pixel_queries(replace(one, yaws=np.array([0.5])), tb.SENSOR)


def test_the_network_is_a_level_of_the_object(learned: LearnedMaps, tmp_path: Path) -> None:
    training = TouchTraining(SMALL, learned, 0)
    part = replace(tb.peg_part(), perceptron=training.finish())
    made = with_touch(
        create_object(tmp_path / "peg", "peg", tb.peg(), MATERIALS["steel"], tb.PROVENANCE), part
    )
    assert all(check.passed for check in verify(made)), verify(made)
    presses = learned.presses[:2]
    found = open_touch(made, "perceptron").at(presses)
    wanted = training.predict(pixel_queries(presses, tb.SENSOR).reshape(-1, 9)).reshape(found.shape)
    np.testing.assert_allclose(found, wanted, atol=1e-8)


def test_what_is_no_network_is_refused(learned: LearnedMaps) -> None:
    with pytest.raises(WrongUse, match="no network is"):
        TouchTraining(replace(SMALL, skip=3), learned, 0)
    least, most = np.zeros(9), np.ones(9)
    with pytest.raises(WrongUse, match="2 outputs"):
        perceptron_graph(MlpWeights([(np.zeros((189, 2)), np.zeros(2))]), paper_normaliser(least, most), 1.0)
    with pytest.raises(WrongUse, match="no profile"):
        touch_profile("fine")
