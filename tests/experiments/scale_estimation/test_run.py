"""A run of scale estimation in process: a look, contacts, strikes; answered from the folder alone."""

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.scale_estimation.experiment import EXPERIMENT
from harness.basics.errors import WrongUse
from harness.bench.experiments import loaded
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import RunContext
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import score
from harness.experiment.begin import begin
from harness.experiment.perform import perform_on
from harness.experiment.plain import IN_PROCESS
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet


def scene_of(contacts: int, camera: bool = True, **thing: Any) -> SceneFile:
    return scene_from_json(
        {
            "schema": 1,
            "object": {"mesh": "builtin:mug", "scale": "hidden", **thing},
            "sensors": {"camera": camera, "touch": contacts > 0, "sound": False},
            "scale": {"contacts": contacts},
        },
        "the scene",
    )


def ran(folder: Path, scene: SceneFile, station: Station, seed: int = 3) -> Recording:
    recording = begin(EXPERIMENT, scene, station, seed, "unplaced", folder).recording
    run = RunFiles(recording)
    context = RunContext(recording.truth_path, run.mesh, seed, "unplaced")
    assert perform_on(
        EXPERIMENT, loaded(IN_PROCESS)(run.scene, run.station, context), recording, Quiet()
    ).complete
    return recording


def answered(recording: Recording) -> dict[str, Any]:
    return EXPERIMENT.result(score(EXPERIMENT, recording, Accuracy.default(EXPERIMENT.knobs)))


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    return ran(tmp_path_factory.mktemp("scale") / "run", scene_of(3), station)


def test_the_size_is_found_by_sight_by_touch_and_by_both(touched: Recording) -> None:
    result = answered(touched)
    true = json.loads(touched.truth_path.read_text())["differences"]["longest_side_m"]
    assert result["contacts"] == 3
    for sense, within in (("vision", 0.03), ("touch", 0.1), ("fused", 0.03)):
        one = result["estimates"][sense]
        assert one["size_m"] == pytest.approx(true, rel=within)
        assert one["error_m"] == pytest.approx(abs(one["size_m"] - true))
        assert one["low90_m"] < one["size_m"] < one["high90_m"]
    assert result["estimates"]["audio"]["size_m"] is None
    assert "does not ask" in result["estimates"]["audio"]["refused"]


def test_the_truth_changes_no_estimate(touched: Recording, tmp_path: Path) -> None:
    before = answered(touched)
    away = touched.truth_path.rename(tmp_path / "truth.json")
    try:
        after = answered(touched)
    finally:
        away.rename(touched.truth_path)
    assert after["size_m"] == before["size_m"]
    assert after["estimates"]["fused"]["error_m"] is None


def test_a_run_that_was_stopped_goes_on_with_the_same_contacts(
    touched: Recording, tmp_path: Path, station: Station
) -> None:
    scene = scene_of(3)
    recording = begin(EXPERIMENT, scene, station, 3, "unplaced", tmp_path / "run").recording
    run = RunFiles(recording)
    context = RunContext(recording.truth_path, run.mesh, 3, "unplaced")

    class Stops(Quiet):
        def ended(self, step: Any, seconds: float) -> None:
            if step.index == 1:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        perform_on(EXPERIMENT, loaded(IN_PROCESS)(run.scene, run.station, context), recording, Stops())
    again = Recording(tmp_path / "run")
    assert again.committed == 2
    perform_on(EXPERIMENT, loaded(IN_PROCESS)(run.scene, run.station, context), again, Quiet())
    assert [record.step.parameters for record in again.steps()] == [
        record.step.parameters for record in touched.steps()
    ]
    assert answered(again)["size_m"] == pytest.approx(answered(touched)["size_m"], rel=0.01)


def test_sight_alone_needs_no_contact(tmp_path: Path, station: Station) -> None:
    result = answered(ran(tmp_path / "run", scene_of(0), station))
    assert result["contacts"] == 0
    assert result["estimates"]["vision"]["in_interval90"] in (True, False)
    assert result["estimates"]["touch"]["size_m"] is None


def test_a_scene_that_reads_nothing_is_refused_before_anything_moves(
    tmp_path: Path, station: Station
) -> None:
    with pytest.raises(WrongUse, match="nothing is to be read"):
        begin(EXPERIMENT, scene_of(0, camera=False), station, 0, "unplaced", tmp_path / "run")
    with pytest.raises(NotImplementedError, match="camera has not seen"):
        begin(EXPERIMENT, scene_of(2, camera=False), station, 0, "unplaced", tmp_path / "run")
