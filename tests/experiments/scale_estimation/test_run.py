"""A run of scale estimation in process: a look, contacts, strikes; answered from the folder alone."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.experiment import EXPERIMENT
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import Belief
from experiments.scale_estimation.touch.touch import Touch
from harness.basics.errors import MeshRefused, WrongUse
from harness.bench.acquisition import Strike
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import finish
from harness.experiment.begin import begin
from harness.experiment.experiment import Scored
from harness.objects.household import build
from harness.recording.observation import BARE_IMAGE, IMAGE
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.recording.step_file import StepRecord
from harness.report.run_page import write_run_page
from tests.experiments.scale_estimation.runs import answered, ran, scene_of, went_on
from tests.support.whole_run import with_reading, with_spoiled_pictures


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    return ran(tmp_path_factory.mktemp("scale") / "run", scene_of(3), station)


@pytest.fixture(scope="module")
def finished(touched: Recording, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Its result, with a report."""
    accuracy, draw = Accuracy.default(EXPERIMENT.knobs), partial(write_run_page, EXPERIMENT)
    folder = tmp_path_factory.mktemp("finished")
    return dict(finish(EXPERIMENT, RunFiles(touched), accuracy, draw, folder=folder))


def test_the_size_is_found_by_sight_by_touch_and_by_both(
    touched: Recording, finished: dict[str, Any]
) -> None:
    result = finished
    true = json.loads(touched.truth_path.read_text())["differences"]["longest_side_m"]
    for sense, within in (("vision", 0.03), ("touch", 0.15), ("fused", 0.03)):
        one = result["estimates"][sense]
        assert one["size_m"] == pytest.approx(true, rel=within)
        assert one["error_m"] == pytest.approx(abs(one["size_m"] - true))
        assert one["low90_m"] < one["size_m"] < one["high90_m"]
        assert one["seconds"] > 0.0
    assert result["estimates"]["audio"]["size_m"] is None
    assert "does not ask" in result["estimates"]["audio"]["refused"]


def test_the_truth_changes_no_estimate(touched: Recording, finished: dict[str, Any], tmp_path: Path) -> None:
    away = touched.truth_path.rename(tmp_path / "truth.json")
    try:
        after = answered(touched)
    finally:
        away.rename(touched.truth_path)
    assert after["size_m"] == finished["size_m"]
    assert after["estimates"]["fused"]["error_m"] is None


@pytest.mark.slow  # a whole run; each sense names it in its own tests
def test_a_size_beyond_the_range_that_was_asked_about_is_named(
    touched: Recording, finished: dict[str, Any]
) -> None:
    true = finished["size_m"]
    run = RunFiles(touched)
    wrong = run.scene.object.model_copy(update={"sizes": (1.3 * true, 2.6 * true)})
    object.__setattr__(run, "scene", run.scene.model_copy(update={"object": wrong}))
    accuracy = Accuracy.default(EXPERIMENT.knobs)
    answering = EXPERIMENT.answering(run, accuracy)
    for record in touched.steps():
        answering.read(record)
    result = EXPERIMENT.result(Scored(run, answering, answering.answer(), None, accuracy, ()))
    for sense in ("vision", "fused"):  # three contacts alone fit sizes of the range too
        assert result["estimates"][sense]["outside_range"] > 0.5
    assert any(one.startswith("vision:") and "widen object.sizes" in one for one in result["warnings"])


def test_a_spoiled_picture_is_named_and_the_rest_answers(
    touched: Recording, finished: dict[str, Any], tmp_path: Path
) -> None:
    result = answered(with_spoiled_pictures(touched, tmp_path / "run", "mirrored", 2))
    assert result["contacts"] == finished["contacts"] - 1
    assert result["warnings"][0].startswith("step 3: ")
    assert result["estimates"]["touch"]["size_m"] is not None


def test_where_no_picture_is_left_touch_is_refused_with_the_reason(
    touched: Recording, tmp_path: Path
) -> None:
    result = answered(with_spoiled_pictures(touched, tmp_path / "run", "black", 1, 2, 3))
    assert "%" in result["estimates"]["touch"]["refused"]
    assert result["size_m"] == result["estimates"]["vision"]["size_m"]


@pytest.mark.slow  # the same with strikes is tested in test_exploring.py
def test_a_run_that_was_stopped_goes_on_with_the_same_contacts(
    touched: Recording, finished: dict[str, Any], tmp_path: Path, station: Station
) -> None:
    recording = begin(EXPERIMENT, scene_of(3), station, 3, "unplaced", tmp_path / "run").recording

    class Stops(Quiet):
        def ended(self, step: Any, seconds: float) -> None:
            if step.index == 1:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        went_on(recording, Stops())
    again = Recording(tmp_path / "run")
    assert again.committed == 2
    assert went_on(again, Quiet())
    assert [record.step.parameters for record in again.steps()] == [
        record.step.parameters for record in touched.steps()
    ]
    assert answered(again)["size_m"] == pytest.approx(finished["size_m"], rel=0.01)


def test_sight_alone_needs_no_contact(tmp_path: Path, station: Station) -> None:
    result = answered(ran(tmp_path / "run", scene_of(0), station))
    assert result["contacts"] == 0
    assert result["estimates"]["vision"]["in_interval90"] in (True, False)
    assert result["estimates"]["touch"]["size_m"] is None


@pytest.mark.slow  # a whole run; the bench's rule is in tests of exploring
def test_a_run_ends_when_the_size_is_known_as_well_as_was_asked(tmp_path: Path, station: Station) -> None:
    scene = scene_of(5, until="2 cm")
    recording = ran(tmp_path / "run", scene, station)
    assert recording.committed < 6
    result = answered(recording)
    assert result["credible90_m"] <= 0.02
    assert went_on(Recording(recording.folder), Quiet())
    assert Recording(recording.folder).committed == recording.committed


def test_an_object_that_cannot_be_filled_with_elements_leaves_out_sound_alone(
    touched: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cannot(*_: Any) -> Any:
        raise MeshRefused("it cannot be filled")

    monkeypatch.setattr(ObjectModel, "ringing", cannot)
    monkeypatch.setattr(ScaleAnswering, "_by_sound", lambda self: self.model.ringing(self.accuracy))
    run = RunFiles(touched)
    sensors = run.scene.sensors.model_copy(update={"sound": True})
    object.__setattr__(run, "scene", run.scene.model_copy(update={"sensors": sensors}))
    answering = EXPERIMENT.answering(run, Accuracy.default(EXPERIMENT.knobs))
    for record in touched.steps():
        answering.read(record)
    found = answering.answer()
    assert "cannot be filled" in str(found.by_sense["audio"])
    assert found.sight is not None


def of_run(recording: Recording, **changed: Any) -> ScaleAnswering:
    """What answers it, nothing taken in yet; attributes of the run's files changed."""
    run = RunFiles(recording)
    for name, value in changed.items():
        object.__setattr__(run, name, value)
    return ScaleAnswering(run, Accuracy.default(EXPERIMENT.knobs))


def without_the_object(record: StepRecord) -> StepRecord:
    """Its look shows the bare bench twice."""
    if IMAGE not in record.readings:
        return record
    bare = record.readings[BARE_IMAGE].values
    return with_reading(record, IMAGE, lambda _: bare)


def result_of(answering: ScaleAnswering) -> dict[str, Any]:
    found = answering.answer()
    return dict(EXPERIMENT.result(Scored(answering.run, answering, found, None, answering.accuracy, ())))


def test_where_nothing_is_seen_heard_or_touched_the_answer_is_the_range_and_every_sense_has_a_reason(
    touched: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.scale_estimation.answer.patch_of_contact", lambda *_: None)
    scene = RunFiles(touched).scene
    sensors = scene.sensors.model_copy(update={"sound": True})
    answering = of_run(touched, scene=scene.model_copy(update={"sensors": sensors}))
    for record in touched.steps():
        answering.read(without_the_object(record))
    nothing = np.zeros(25_000)
    answering.strikes.append(
        Strike(50e3, nothing, nothing, 0, 0.0, overload=False, double_hit=False, silent=True)
    )
    result = result_of(answering)
    reasons = {"vision": "covers 0 pixels", "audio": "nothing was heard", "touch": "touched nothing"}
    for sense, reason in reasons.items():
        assert reason in result["estimates"][sense]["refused"]
        assert any(one.startswith(f"{sense}:") and reason in one for one in result["warnings"])
    low, high = Belief.ignorant(answering.model.sizes).interval
    assert result["estimates"]["fused"]["low90_m"] == low
    assert result["estimates"]["fused"]["high90_m"] == high


def test_a_run_of_another_object_is_refused_by_sight_and_no_narrow_answer_remains(
    touched: Recording, finished: dict[str, Any]
) -> None:
    """This mug's outline is a wrench's that leans by ten standard deviations of its tilt."""
    true = finished["size_m"]
    answering = of_run(touched, mesh=build("wrench"))
    for record in touched.steps():
        answering.read(record)
    result = result_of(answering)
    assert "tilt" in result["estimates"]["vision"]["refused"]
    fused = result["estimates"]["fused"]
    assert fused["low90_m"] <= true <= fused["high90_m"] or fused["high90_m"] > 1.5 * fused["low90_m"]


def test_senses_that_contradict_each_other_and_contacts_that_fit_badly_are_named(
    touched: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    def elsewhere(answering: ScaleAnswering) -> Touch:
        sizes = answering.model.sizes
        belief = Belief.of(sizes, -0.5 * ((sizes.logs - np.log(0.9 * sizes.high)) / 0.02) ** 2)
        return Touch(belief, np.zeros(8), 2.5, 0.0)  # a cost that is seldom the right object's

    monkeypatch.setattr(ScaleAnswering, "_by_touch", elsewhere)
    result = answered(touched)
    assert any("vision (" in one and "and touch (" in one for one in result["warnings"])
    assert any(one.startswith("touch: ") for one in result["warnings"])


def test_where_nobody_knows_how_far_the_camera_is_sight_leaves_the_size_open_and_a_warning_names_it(
    touched: Recording,
) -> None:
    scene = RunFiles(touched).scene
    far = scene.section(Scale).model_copy(update={"camera_position_error": 10.0})
    answering = of_run(touched, scene=scene.with_section(far))
    answering.read(touched.step(0))
    result = result_of(answering)
    assert any(one.startswith("vision ") for one in result["warnings"])
    low, high = Belief.ignorant(answering.model.sizes).interval
    vision = result["estimates"]["vision"]
    assert vision["high90_m"] / vision["low90_m"] > (high / low) ** 0.75


def test_a_scene_that_reads_nothing_is_refused_before_anything_moves(
    tmp_path: Path, station: Station
) -> None:
    with pytest.raises(WrongUse, match=r"vision.*contacts"):
        begin(EXPERIMENT, scene_of(0, camera=False), station, 0, "unplaced", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_report_shows_each_sense_beside_the_model(finished: dict[str, Any]) -> None:
    page = Path(finished["report"]).read_text()
    for title in ("Posterior of the size", "Vision", "Touch"):
        assert f"<h3>{title}</h3>" in page
    assert page.count("<img") == 3
    assert "MOCK" in page
