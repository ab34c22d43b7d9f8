"""Contacts on an object of unknown size: travels keep clear of all it may be, and misses are readings."""

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.scale_estimation.contact_planning import blind_envelope, seen_envelope
from experiments.scale_estimation.experiment import EXPERIMENT
from experiments.scale_estimation.explorer import Explorer
from harness.basics.errors import WrongUse
from harness.bench.station_file import Station
from harness.experiment.begin import begin
from harness.recording.recording import Recording
from harness.recording.session import Quiet
from harness.skills.exploring.exploration import MOST_SKIPPED, SKIPPED
from harness.skills.strike import POSE, READY
from harness.twin.rehearsal import rehearse
from tests.experiments.scale_estimation.runs import (
    answered,
    answering_of,
    outside,
    ran,
    scene_of,
    travels,
    went_on,
)


@pytest.mark.parametrize("mesh", ["builtin:mug", "builtin:wrench"])
@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (3, 4))])
def test_the_object_is_within_what_travels_avoid_however_it_was_seen(
    tmp_path: Path, station: Station, mesh: str, seed: int
) -> None:
    """Seed 2 hides the mug's handle: what is seen fits many turns, and travels keep clear of them all."""
    recording = ran(tmp_path / "run", scene_of(0, mesh=mesh), station, seed)
    answering = answering_of(recording)
    assert outside(recording, seen_envelope(answering.model, answering.stands_seen())) < 0.0
    assert outside(recording, blind_envelope(answering.model)) < 0.0


@pytest.fixture(scope="module")
def blind(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    return ran(tmp_path_factory.mktemp("blind") / "run", scene_of(6, camera=False), station, 60)


def test_no_travel_enters_the_space_of_the_largest_object(blind: Recording) -> None:
    model = answering_of(blind).model
    space = model.twin_around(blind_envelope(model))
    moved = list(travels(blind))
    assert len(moved) >= blind.committed
    assert not rehearse(space, moved).refusals


def test_a_way_that_met_nothing_is_a_reading_and_says_where_the_object_is_not(blind: Recording) -> None:
    assert blind.committed == 6
    answering = answering_of(blind)
    assert 0 < len(answering.patches) < 6
    assert len(answering.free) == 6
    assert answering.met.count(False) == 6 - len(answering.patches)


def test_an_object_never_seen_is_found_by_touch_or_its_size_stays_open(blind: Recording) -> None:
    result = answered(blind)
    touch = result["estimates"]["touch"]
    true = json.loads(blind.truth_path.read_text())["differences"]["longest_side_m"]
    assert touch["low90_m"] < true < touch["high90_m"]
    assert result["estimates"]["vision"]["size_m"] is None


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    scene = scene_of(4, camera=False, sound=True)
    return ran(tmp_path_factory.mktemp("heard") / "run", scene, station, 61)


@pytest.mark.slow  # a whole run with strikes
def test_an_object_never_seen_is_struck_where_the_gel_has_just_met_it(heard: Recording) -> None:
    """A tip that follows the gel needs nothing to be believed: the first contacts are struck already."""
    struck = [record.step.index for record in heard.steps() if POSE in record.readings]
    assert len(struck) == 3
    answering = answering_of(heard)
    assert [answering.met[index] for index in struck] == [True] * 3
    assert sum(not strike.fault for strike in answering.strikes) >= 2


@pytest.mark.slow  # a whole run with strikes; stops after a contact are in quick tests
def test_a_run_that_was_stopped_after_a_strike_goes_on_with_the_same_contact(
    heard: Recording, tmp_path: Path, station: Station
) -> None:
    """Where such a strike has left the arm is not in the step's parameters, but among its readings."""
    scene = scene_of(4, camera=False, sound=True)
    recording = begin(EXPERIMENT, scene, station, 61, "unplaced", tmp_path / "run").recording

    class Stops(Quiet):
        def ended(self, step: Any, seconds: float) -> None:
            if READY in recording.step(step.index).readings:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        went_on(recording, Stops())
    again = Recording(tmp_path / "run")
    assert went_on(again, Quiet())
    # A bench that is opened anew has other noise: contacts after the next may go by what that one read.
    assert [again.step(k).step.parameters for k in (0, 1)] == [heard.step(k).step.parameters for k in (0, 1)]


def refuses(monkeypatch: pytest.MonkeyPatch, at: set[int]) -> None:
    """No way is free to the contacts of these steps."""
    plan = Explorer.plan

    def planned(self: Explorer, recording: Recording, index: int) -> dict[str, Any]:
        if index in at:
            raise WrongUse("no free way was found")
        return plan(self, recording, index)

    monkeypatch.setattr(Explorer, "plan", planned)


@pytest.mark.slow  # a whole run; a run without any free way stays
def test_a_contact_without_a_free_way_is_left_out_and_the_run_goes_on(
    tmp_path: Path, station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuses(monkeypatch, {1})
    recording = ran(tmp_path / "run", scene_of(2), station)
    steps = [record.step for record in recording.steps()]
    assert [step.kind for step in steps] == ["look", SKIPPED, "press"]
    assert "no free way" in steps[1].parameters["why"]
    assert answered(recording)["estimates"]["fused"]["size_m"] > 0.0


def test_a_run_whose_contacts_have_no_free_way_answers_with_what_was_read(
    tmp_path: Path, station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuses(monkeypatch, set(range(1, 11)))
    recording = ran(tmp_path / "run", scene_of(10), station)
    assert recording.committed == 1 + MOST_SKIPPED
    result = answered(recording)
    assert result["contacts"] == 0
    assert result["estimates"]["vision"]["size_m"] == result["size_m"]
    assert went_on(Recording(recording.folder), Quiet())
    assert Recording(recording.folder).committed == recording.committed
