from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.audio.audio import CHECKPOINT, author_audio, opened
from harness.authoring.audio.data import split_nodes
from harness.authoring.audio.metrics import relative_errors
from harness.authoring.audio.profiles import AudioProfile, PerceptronSpec
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.audio.graph import audio_graph
from harness.sim.modal.modes import Modes

torch = pytest.importorskip("torch")
from harness.authoring.audio.mlp import AudioTraining  # noqa: E402

TINY = PerceptronSpec(branches=3, depth=3, width=16, octaves=3, skip=2, epochs=6, batch=64, rate=3e-3)


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


@pytest.mark.parametrize("branches", [1, 3])
def test_a_killed_training_ends_in_the_same_bits(egg: Modes, tmp_path: Path, branches: int) -> None:
    spec = replace(TINY, branches=branches)
    trained = split_nodes(len(egg.points)).trained
    whole = AudioTraining(spec, egg, trained, seed=3)
    while not whole.done:
        whole.step_epoch()
    for stop in (2, 4, 6):
        part = AudioTraining(spec, egg, trained, seed=3)
        if (tmp_path / "kept.npz").exists():
            part.load(tmp_path / "kept.npz")
        while part.epoch < stop:
            part.step_epoch()
        part.save(tmp_path / "kept.npz")
    assert part.losses == whole.losses
    assert np.array_equal(part.predict(egg.points), whole.predict(egg.points))
    for one, other in zip(part.finish().branches, whole.finish().branches, strict=True):
        assert all(np.array_equal(a[0], b[0]) for a, b in zip(one.layers, other.layers, strict=True))


def test_a_checkpoint_of_another_training_is_refused(egg: Modes, tmp_path: Path) -> None:
    trained = split_nodes(len(egg.points)).trained
    AudioTraining(TINY, egg, trained, seed=3).save(tmp_path / "kept.npz")
    with pytest.raises(DataRefused, match=r"kept\.npz.*seed"):
        AudioTraining(TINY, egg, trained, seed=4).load(tmp_path / "kept.npz")
    (tmp_path / "kept.npz").write_bytes(b"PK\x03\x04 half a file")
    with pytest.raises(DataRefused, match=r"kept\.npz.*archive"):
        AudioTraining(TINY, egg, trained, seed=3).load(tmp_path / "kept.npz")


@pytest.mark.parametrize("branches", [1, 3])
def test_the_graph_of_perceptrons_is_the_trained_network(egg: Modes, branches: int) -> None:
    training = AudioTraining(replace(TINY, branches=branches), egg, np.arange(len(egg.points)), seed=0)
    first = training.step_epoch()
    while not training.done:
        last = training.step_epoch()
    assert last < first
    before = training.predict(egg.points)
    trained = training.finish()
    graph = audio_graph(trained.branches, trained.normaliser, trained.scales, trained.encoding)
    found = opened(graph, 6)({"points": egg.points})["gains"]
    # The solved last layer can only be nearer than the trained one.
    assert relative_errors(found, egg.shapes).mean() < relative_errors(before, egg.shapes).mean()
    exact = training.solved(egg.points, trained)
    assert np.abs(found - exact).max() < 1e-5 * np.abs(exact).max()


@pytest.mark.parametrize(
    "spec",
    [replace(TINY, branches=2), replace(TINY, width=0), replace(TINY, skip=3), replace(TINY, epochs=0)],
)
def test_a_network_that_cannot_be_is_refused(egg: Modes, spec: PerceptronSpec) -> None:
    with pytest.raises(WrongUse):
        AudioTraining(spec, egg, np.arange(len(egg.points)), seed=0)


def test_authoring_goes_on_from_a_checkpoint(egg: Modes, tmp_path: Path) -> None:
    def said_of(folder: Path) -> tuple[list[str], bytes]:
        folder.mkdir(exist_ok=True)
        said: list[str] = []
        rates, profile = np.full(6, 20.0), AudioProfile(TINY, sounds=2)
        made = author_audio(egg, rates, profile, 0, folder, lambda doing, share: said.append(doing))
        return said, made.graph.SerializeToString(deterministic=True)

    whole, wanted = said_of(tmp_path / "whole")
    assert sum(one.startswith("training") for one in whole) == TINY.epochs
    part = AudioTraining(TINY, egg, split_nodes(len(egg.points)).trained, seed=0)
    part.step_epoch()
    (tmp_path / "part").mkdir()
    part.save(tmp_path / "part" / CHECKPOINT)
    rest, found = said_of(tmp_path / "part")
    assert sum(one.startswith("training") for one in rest) == TINY.epochs - 1
    assert found == wanted
