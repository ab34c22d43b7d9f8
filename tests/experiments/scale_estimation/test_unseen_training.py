"""Training what answers for objects never drawn: samples without torch, and a smoke run with it."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.unseen.network import opened
from experiments.scale_estimation.unseen.train import main
from experiments.scale_estimation.unseen.training.samples import (
    MAKERS,
    SOLVED_AT,
    SOLVED_OF,
    RingingShape,
    ringing_of,
    samples_of,
)
from harness.basics.materials import MATERIALS


@pytest.fixture(autouse=True, scope="module")
def own_store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TOUCHSTONE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.mark.parametrize(
    "sense", ["touch", *(pytest.param(each, marks=pytest.mark.slow) for each in MAKERS if each != "touch")]
)  # the processes are the same for every sense
def test_samples_are_the_same_whatever_the_number_of_processes(sense: str) -> None:
    one, two = (samples_of(sense, 2, 3, 5, processes) for processes in (1, 2))
    for name, values in one.inputs.items():
        assert np.array_equal(values, two.inputs[name])
        assert np.isfinite(values).all()
    assert np.array_equal(one.sizes, two.sizes)
    assert list(one.shapes) == [0, 0, 0, 1, 1, 1]


def test_modes_are_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    first = ringing_of(7, seed=2)
    monkeypatch.setattr(RingingShape, "solved", None)
    again = ringing_of(7, seed=2)
    assert first is not None
    assert again is not None
    assert np.array_equal(first.amplitudes, again.amplitudes)


@pytest.mark.slow  # of training alone
def test_modes_go_with_size_and_material_and_are_continued_at_their_spacing() -> None:
    shape, random = ringing_of(7, seed=2), np.random.default_rng(1)
    assert shape is not None
    count = len(shape.frequencies)
    same, _, loud = shape.at(SOLVED_AT, SOLVED_OF, float(shape.frequencies[-1]) + 1.0, random)
    assert same == pytest.approx(shape.frequencies)
    larger, _, quiet = shape.at(2.0 * SOLVED_AT, SOLVED_OF, 1e9, random)
    assert larger[:count] == pytest.approx(0.5 * shape.frequencies)
    assert quiet[:, :count] == pytest.approx(0.25 * loud)
    steel, speed = MATERIALS["steel"], np.sqrt(SOLVED_OF.young / SOLVED_OF.density)
    other, _, _ = shape.at(SOLVED_AT, steel, 1e9, random)
    assert other[:count] == pytest.approx(shape.frequencies * np.sqrt(steel.young / steel.density) / speed)
    above = np.diff(larger[count:])
    assert above.mean() == pytest.approx(np.diff(larger[count - 20 : count]).mean(), rel=0.4)


def test_without_torch_outlines_are_fitted_and_the_rest_says_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("harness.authoring.network_program.find_spec", lambda _name: None)
    assert main(["--profile", "smoke", "--out", str(tmp_path / "none")]) == 2
    assert "torch" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
    assert main(["--profile", "smoke", "--only", "outline", "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "outline_regression.npz").exists()


@pytest.mark.parametrize("sense", list(MAKERS))
def test_a_smoke_training_ends_in_a_graph_that_answers_as_torch_does(sense: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="the extra 'author' is not installed")
    from experiments.scale_estimation.unseen.training import networks

    asked = ["--profile", "smoke", "--only", sense, "--out", str(tmp_path), "--processes", "2"]
    assert main(asked) == 0
    card = (tmp_path / f"{sense}.json").read_text()
    network = opened((tmp_path / f"{sense}.onnx").read_bytes(), card, sense)
    assert json.loads(card)["profile"] == "smoke"
    samples = samples_of(sense, 1, 3, 9, 1)
    one = {name: values[0] for name, values in samples.inputs.items()}
    belief, distance = network.belief([one], SizeRange(0.05, 0.6))
    assert np.isfinite(belief.log_density).all()
    assert np.isfinite(distance)
    torch.manual_seed(1)
    module = networks.MODULES[sense]().eval()
    data = networks.graph(sense, [module] * 3)
    answered = opened(data, card, sense).network(
        {name: values.astype(np.float32) for name, values in samples.inputs.items()}
    )
    with torch.no_grad():
        wanted = module(*(torch.from_numpy(values) for values in samples.inputs.values())).numpy()
    assert answered["logits"][:, 1] == pytest.approx(wanted, abs=2e-2)  # kept in half precision
