"""Contacts of a localization chosen one by one: within the limits asked for, and the same when resumed."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from experiments.contact_localization import next_contact
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT, PLAN_KEY
from experiments.contact_localization.next_contact import EXPECTED, PLACEHOLDER
from experiments.contact_localization.section import Localization
from harness.basics.errors import MotionRefused, WrongUse
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.experiment.begin import begin
from harness.experiment.experiment import Helpers
from harness.experiment.in_process import perform_run
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.skills.planning import Itinerary, RunPlan
from harness.skills.press import ContactMotion
from harness.skills.sites import Site
from harness.twin.bench_of import twin_of

STATION = load_station(station_path("mock"))
CELL = ContactCell("mug", "default", 71, "close", choose="active")
CONTACTS = 4


def scene(**asked: object) -> SceneFile:
    wanted = Localization(contacts=CONTACTS, choose="active", **asked)  # type: ignore[arg-type]
    return scene_from_options("builtin:mug").with_section(wanted)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFiles:
    """Read only."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    return RunFiles(perform_run(EXPERIMENT, CELL, scene(), STATION, folder))


def chosen(run: RunFiles, said: list[str]) -> Iterator[Step]:
    """The steps that are left of a run."""
    helpers = Helpers(twin_of(run.scene, run.station, run.mesh), say=said.append)
    return EXPERIMENT.performer(run, helpers).steps(run.recording)


def after(run: RunFiles, count: int, folder: Path) -> RunFiles:
    """The same run, were it ended after so many contacts."""
    shutil.copytree(run.recording.folder, folder)
    for step in range(count, run.recording.committed):
        (folder / "steps" / f"{step:03d}.mcap").unlink()
    found = RunFiles(Recording(folder))
    assert found.recording.committed == count
    return found


def until(error: float, run: RunFiles) -> RunFiles:
    """The run, were it asked to end once the place is known to so many metres."""
    asked = run.scene.section(Localization).model_copy(update={"until": error})
    vars(run)["scene"] = run.scene.with_section(asked)
    return run


def test_only_the_first_is_planned_before_anything_moves(run: RunFiles) -> None:
    planned = run.recording.planned(PLAN_KEY)
    assert [dict(PLACEHOLDER) == step for step in planned] == [False, True, True, True]
    assert run.recording.committed == CONTACTS


def test_every_contact_keeps_the_limits_and_says_what_error_it_should_leave(run: RunFiles) -> None:
    asked, twin = run.scene.section(Localization), twin_of(run.scene, run.station, run.mesh)
    touched = []
    for record in run.recording.steps():
        motion = ContactMotion.from_parameters(record.step.parameters)
        gel = motion.base_from_stand_off @ twin.flange_from_gel
        touched.append(gel[:3, 3] + motion.search * motion.axis)
        assert 0.0 < motion.press <= asked.depth[1]
    steps = np.linalg.norm(np.diff(touched, axis=0), axis=1)
    # Where the gel first touches is within its reach of the place that was drawn.
    assert steps.max() < asked.step + 3e-3
    first, *others = (record.step.parameters for record in run.recording.steps())
    assert EXPECTED not in first
    assert all(0.0 < other[EXPECTED] < 0.1 for other in others)


def test_a_run_that_is_resumed_goes_where_it_would_have_gone(run: RunFiles, tmp_path: Path) -> None:
    """The place is known less well than it asks."""
    ended, said = until(1e-7, after(run, 2, tmp_path / "run")), list[str]()
    step = next(chosen(ended, said))
    assert step.index == 2
    assert step.parameters == run.recording.step(2).step.parameters
    (sentence,) = said
    assert sentence.startswith("contact 3: ")
    assert " mm " in sentence


def test_the_place_that_should_leave_least_error_is_taken(
    run: RunFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = []
    inner = next_contact.errors_left

    def noted(*given: object) -> object:
        left.append(inner(*given))  # type: ignore[arg-type]
        return left[-1]

    monkeypatch.setattr(f"{next_contact.__name__}.errors_left", noted)
    ended = after(run, 1, tmp_path / "run")
    step = next(chosen(ended, []))
    (errors,) = left
    assert len(errors) == next_contact.CANDIDATES
    assert errors.min() < np.median(errors) < errors.max()
    # The farthest may leave a little more, and a place without a free way is passed over.
    assert step.parameters[EXPECTED] < np.median(errors)


def test_no_more_are_made_once_the_place_is_known_as_well_as_was_asked(run: RunFiles, tmp_path: Path) -> None:
    ended, said = until(0.5, after(run, 2, tmp_path / "run")), list[str]()
    assert list(chosen(ended, said)) == []
    assert any("known as well as was asked" in sentence for sentence in said)


def test_a_contact_that_nowhere_has_a_free_way_ends_the_run_and_says_so(
    run: RunFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Itinerary, "visit", lambda *_, **__: False)
    ended, said = after(run, 1, tmp_path / "run"), list[str]()
    assert list(chosen(ended, said)) == []
    (sentence,) = said
    assert " 1: " in sentence


def test_a_place_whose_rehearsal_is_refused_is_passed_over(
    run: RunFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused: list[object] = []
    inner = Itinerary.rehearsed

    def once(itinerary: Itinerary, sites: tuple[Site, ...]) -> RunPlan:
        if not refused:
            refused.append(sites)
            raise MotionRefused("the gel is in the table")
        return inner(itinerary, sites)

    ended = after(run, 2, tmp_path / "run")
    monkeypatch.setattr(Itinerary, "rehearsed", once)
    step = next(chosen(ended, []))
    assert refused
    assert step.parameters != run.recording.step(2).step.parameters


def test_each_place_is_struck_where_the_scene_is_heard(tmp_path: Path) -> None:
    heard = scene().with_section(Localization(contacts=2, choose="active"))
    heard = heard.model_copy(update={"sensors": Sensors(touch=True, sound=True)})
    recording = perform_run(EXPERIMENT, CELL, heard, STATION, tmp_path / "run")
    assert [("strike" in record.step.parameters) for record in recording.steps()] == [True, True]
    assert all("microphone.pressure" in record.readings for record in recording.steps())


def test_an_end_is_refused_where_all_contacts_are_planned_before_the_first(tmp_path: Path) -> None:
    planned = scene().with_section(Localization(choose="planned", until="3 mm"))  # type: ignore[arg-type]
    with pytest.raises(WrongUse, match=r'until = 3 mm .*choose = "planned".*choose = "active"'):
        begin(EXPERIMENT, planned, STATION, folder=tmp_path / "run")
    assert not (tmp_path / "run").exists()
