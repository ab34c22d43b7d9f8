"""A run of shape reconstruction in process: a look, presses along chosen lines, an answer from the folder."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.shape_reconstruction.answer import evidence_of
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.experiment import EXPERIMENT
from experiments.shape_reconstruction.explore.explorer import RunningShape, ShapeExplorer
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import METHOD, METHODS, QUICK, REMOVED, estimated
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.errors import FitRefused, WrongUse
from harness.basics.geometry import apply
from harness.basics.mesh import Mesh
from harness.bench.scene import scene_from_json
from harness.bench.station_file import Station
from harness.effects.accuracy import current_levels
from harness.experiment.answer import finish
from harness.experiment.begin import begin
from harness.experiment.measuring import measurement_of
from harness.experiment.truth import read_true_surface
from harness.objects.builtin import build
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.report.run_page import write_run_page
from harness.skills.exploring.exploration import MOST_SKIPPED, SKIPPED
from harness.twin.rehearsal import Segment, rehearse
from tests.docs.result_keys import COMMON, SHAPE, SHAPE_ESTIMATE
from tests.experiments.shape_reconstruction.runs import (
    QUICKLY,
    answered,
    off_truth,
    ran,
    scene_of,
    timeless,
    to_truth,
    went_on,
)
from tests.support.whole_run import with_spoiled_pictures


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    return ran(tmp_path_factory.mktemp("shape") / "run", scene_of(3, "farthest"), station)


@pytest.fixture(scope="module")
def finished(touched: Recording, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Its result by the quickest method; report and surfaces are in the folder of the report."""
    draw = partial(write_run_page, EXPERIMENT)
    folder = tmp_path_factory.mktemp("finished")
    return dict(finish(EXPERIMENT, RunFiles(touched), QUICKLY, draw, folder=folder))


@pytest.fixture(scope="module")
def evidence(touched: Recording) -> ShapeEvidence:
    return evidence_of(RunFiles(touched), touched.steps())


def test_contacts_are_on_the_true_surface_and_face_out_of_it(
    touched: Recording, evidence: ShapeEvidence
) -> None:
    assert len(evidence.touches) == 3
    assert evidence.contacts
    for touch in evidence.contacts:
        assert off_truth(touched, touch.points) < 3.0 * touch.sigma
        assert np.all(touch.normals @ touch.stand_from_gel[:3, 2] < 0.0)
        assert np.linalg.norm(touch.normals, axis=1) == pytest.approx(1.0)
        assert touch.way > 0.0
    assert evidence.look is not None
    assert 500 < evidence.look.mask.sum() < 10_000


def test_presses_lead_to_places_far_from_each_other(evidence: ShapeEvidence) -> None:
    ends = np.array([touch.stand_from_gel[:3, 3] for touch in evidence.touches])
    apart = np.linalg.norm(ends[:, None] - ends[None], axis=2)[np.triu_indices(3, 1)]
    assert apart.min() > 0.02


def test_the_answer_is_the_same_to_the_bit_when_it_is_replayed(
    touched: Recording, finished: dict[str, Any]
) -> None:
    again = answered(Recording(touched.folder))
    first = {key: value for key, value in timeless(finished).items() if key in again}
    assert set(again.pop("warnings")) <= set(first.pop("warnings"))
    assert again == first
    assert first["estimates"]["fused"]["chamfer_m"] == first["error_m"]
    assert 0.0 < first["error_m"] < 0.05
    assert first["estimates"]["vision"]["refused"]
    assert (first["presses"], first["choose"]) == (3, "farthest")


def test_a_spoiled_picture_is_named_and_the_rest_answers(touched: Recording, tmp_path: Path) -> None:
    result = answered(with_spoiled_pictures(touched, tmp_path / "run", "channels exchanged", 2))
    assert result["presses"] == 2
    assert any(one.startswith("step 3: its picture is left out") for one in result["warnings"])


def test_where_no_picture_is_left_the_reason_is_the_refusal(blind: Recording, tmp_path: Path) -> None:
    spoiled = with_spoiled_pictures(blind, tmp_path / "run", "black", 0, 1, 2, 3)
    with pytest.raises(FitRefused, match=r"step 1: .*0% .*light"):
        answered(spoiled)


def test_the_truth_changes_no_estimate(touched: Recording, finished: dict[str, Any], tmp_path: Path) -> None:
    away = {}
    for path in (touched.truth_path, touched.truth_path.with_suffix(".npz")):
        away[path] = path.rename(tmp_path / path.name)
    try:
        after = answered(touched)
    finally:
        for path, there in away.items():
            there.rename(path)
    assert after["extents_m"] == finished["extents_m"]
    assert after["error_m"] is None
    assert after["estimates"]["fused"]["completeness_m"] is None


def test_the_mesh_of_the_scene_changes_no_plan(touched: Recording) -> None:
    run, other = RunFiles(touched), build("wrench")
    object.__setattr__(run, "mesh", Mesh(other.vertices, other.faces))
    made = touched.step(1).step.parameters
    planned = ShapeExplorer(run, QUICK).plan(touched, 1)
    assert {key: made[key] for key in planned} == planned


def test_no_travel_enters_the_space_that_the_object_may_take(touched: Recording) -> None:
    run = RunFiles(touched)
    explorer = ShapeExplorer(run, QUICK)
    explorer.plan(touched, 1)
    true = read_true_surface(touched)
    assert true is not None
    moved = list(travels(touched))
    assert len(moved) >= 3
    assert not rehearse(explorer.travels, moved).refusals
    assert not rehearse(explorer._twin(true), moved).refusals


def travels(recording: Recording) -> list[Segment]:
    """Every joint motion of its presses, as it was planned."""
    found = []
    for record in recording.steps():
        if record.step.kind == "press":
            here = np.array(record.step.parameters["start_rad"])
            for there in np.array(record.step.parameters["travel_rad"]).reshape(-1, 6):
                found.append(Segment(record.step.index, "travel", "joint", here, there))
                here = there
    return found


@pytest.mark.slow  # a whole run; resuming is tested with two other experiments
def test_a_run_that_was_stopped_goes_on_with_the_same_presses(
    touched: Recording, tmp_path: Path, station: Station
) -> None:
    recording = begin(EXPERIMENT, scene_of(3, "farthest"), station, 0, "default", tmp_path / "run").recording

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


def test_the_report_and_the_surfaces_are_beside_the_result(finished: dict[str, Any]) -> None:
    result, folder = finished, Path(finished["report"]).parents[1]
    page = Path(result["report"]).read_text()
    for title in ("The surface", "Press by press", "Cross-sections", "The silhouette"):
        assert f"<h3>{title}</h3>" in page
    assert page.count("<img") == 4
    assert page.count('<canvas class="turned"') == page.count("<script>") == 1
    assert "http" not in page
    assert len(page) < 1_500_000
    assert set(re.findall('href="#([^"]+)"', page)) <= set(re.findall('id="([^"]+)"', page))
    assert max(len(cell) for cell in re.findall("<td>(.*?)</td>", page)) < 400  # long arrays are left out
    assert "MOCK" in page
    assert f"from all readings: {result['contacts']} contact" in page
    assert f"{result['ended_by_housing']} probe line" in page
    for sense in ("touch", "fused"):
        assert (folder / result["estimates"][sense]["mesh"]).stat().st_size > 100
    assert len(EXPERIMENT.lines(result)) == 3
    assert set(result) == {*COMMON, *SHAPE}
    for one in result["estimates"].values():
        assert set(one) == set(SHAPE_ESTIMATE)


@pytest.fixture(scope="module")
def blind(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    scene = scene_of(4, "random", camera=False, mesh="builtin:wrench", largest="15 cm")
    return ran(tmp_path_factory.mktemp("blind") / "run", scene, station, seed=1)


def test_a_way_that_met_nothing_is_a_reading(blind: Recording) -> None:
    evidence = evidence_of(RunFiles(blind), blind.steps())
    missed = [touch for touch in evidence.touches if not touch.met]
    assert len(evidence.touches) == 4
    assert missed
    for touch in missed:
        assert touch.points.shape == touch.normals.shape == (0, 3)
        planned = blind.step(touch.index).step.parameters["search_m"]
        assert touch.way == pytest.approx(planned, abs=3e-3)
        assert not touch.stopped


def test_a_way_that_the_housing_ended_says_where_the_surface_is(tmp_path: Path, station: Station) -> None:
    scene = scene_of(3, "random", camera=False, mesh="builtin:bowl", largest="20 cm")
    recording = ran(tmp_path / "run", scene, station)
    found = evidence_of(RunFiles(recording), recording.steps())
    ended = [touch for touch in found.touches if touch.by_housing]
    assert len(ended) >= 2  # a flat sensor meets a bowl with little but its housing
    x, y = np.meshgrid(*(np.linspace(-0.5, 0.5, 61) * side for side in found.housing))
    face = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -found.gel_thickness)])
    for touch in ended:
        planned = recording.step(touch.index).step.parameters["search_m"]
        assert touch.way < planned - 2e-3
        assert to_truth(recording, apply(touch.stand_from_gel, face)).min() < 2e-3
    assert answered(recording)["ended_by_housing"] == len(ended)


def refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    """No way is free to any press."""

    def planned(_self: ShapeExplorer, _recording: Recording, _index: int) -> dict[str, Any]:
        raise WrongUse("no free way was found")

    monkeypatch.setattr(ShapeExplorer, "plan", planned)


def test_a_run_without_a_free_way_ends_and_keeps_why(
    tmp_path: Path, station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuses(monkeypatch)
    recording = ran(tmp_path / "run", scene_of(8, "farthest", camera=False), station)
    steps = [record.step for record in recording.steps()]
    assert [step.kind for step in steps] == [SKIPPED] * MOST_SKIPPED
    assert "no free way" in steps[0].parameters["why"]


@pytest.mark.slow  # a whole run
def test_presses_on_the_drawing_are_a_benchmark_and_say_so(tmp_path: Path, station: Station) -> None:
    recording = ran(tmp_path / "run", scene_of(2, "planned", camera=False), station, gap="none")
    evidence = evidence_of(RunFiles(recording), recording.steps())
    assert len(evidence.contacts) == 2
    for touch in evidence.contacts:
        # Without a gap only what the gel's picture says is left, of all that a sigma stands for.
        assert off_truth(recording, touch.points) < 0.5 * touch.sigma
    assert any("benchmark" in one for one in answered(recording)["warnings"])


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ({"sensors": {"touch": False}}, "vision.*presses"),
        ({"shape": {"presses": 0}}, "vision.*presses"),
        ({"object": {"mesh": "builtin:mug", "pose": {"anchor": "origin"}}}, "anchor"),
    ],
    ids=["no sense", "no press", "origin"],
)
def test_a_scene_that_cannot_be_explored_is_refused_before_anything_moves(
    tmp_path: Path, station: Station, tree: dict[str, Any], words: str
) -> None:
    scene = scene_from_json({"schema": 1, "object": {"mesh": "builtin:mug"}, **tree}, "the scene")
    with pytest.raises(WrongUse, match=words):
        begin(EXPERIMENT, scene, station, 0, "none", tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.fixture(scope="module")
def quick(evidence: ShapeEvidence) -> ShapeEstimate:
    return estimated(QUICK, evidence)


@pytest.mark.parametrize(
    ("until", "bounded", "sure"), [(0.5, True, True), (1e-9, True, False), (0.5, False, False)]
)
def test_a_run_ends_when_the_shape_is_known_as_well_as_was_asked_and_nothing_is_open(
    touched: Recording,
    quick: ShapeEstimate,
    monkeypatch: pytest.MonkeyPatch,
    until: float,
    bounded: bool,
    sure: bool,
) -> None:
    run, found = RunFiles(touched), replace(quick, not_bounded=() if bounded else ("z",))
    monkeypatch.setattr(RunningShape, "after", lambda *_: found)
    asked = run.scene.section(ShapeRun).model_copy(update={"until": until})
    object.__setattr__(run, "scene", run.scene.with_section(asked))
    assert ShapeExplorer(run, QUICK).is_sure(touched, 2) is sure


def test_readings_of_nothing_are_refused_with_what_to_do_next(blind: Recording) -> None:
    evidence = evidence_of(RunFiles(blind), blind.steps())
    missed = tuple(touch for touch in evidence.touches if not touch.met)
    for method in ("rbf", "family"):
        with pytest.raises(FitRefused, match=f"{len(missed)} .*camera"):
            estimated(method, replace(evidence, touches=missed))


@pytest.mark.parametrize("level", REMOVED)
def test_a_removed_method_is_refused_and_a_stored_one_is_replaced(level: str) -> None:
    assert REMOVED[level] in METHODS
    with pytest.raises(WrongUse, match=f"'{level}'.* {REMOVED[level]}"):
        METHOD.checked(level)
    assert current_levels([METHOD], {METHOD.name: level}) == {METHOD.name: REMOVED[level]}
    measured = measurement_of(EXPERIMENT)
    scene = scene_from_json({"schema": 1, "object": {"mesh": "builtin:mug"}}, "mug")
    assert "touchstone cost" in str(measured.explain_refusal(scene, {METHOD.name: level}))
    assert measured.explain_refusal(scene, {METHOD.name: QUICK}) is None
