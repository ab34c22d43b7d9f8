"""An object that nobody has drawn is explored: its mesh is the mocked world's alone."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.experiment import EXPERIMENT
from experiments.scale_estimation.explorer import Explorer
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import finish
from harness.objects.builtin import build
from harness.picture.outline import SeenOutline
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.report.run_page import write_run_page
from harness.skills.exploring.unknown_space import margin_of, unknown_space
from harness.skills.strike import POSE
from harness.twin.rehearsal import rehearse
from tests.experiments.scale_estimation.runs import answering_of, outside, ran, scene_of, travels, true_mesh

MOST = 10


def unknown(contacts: int, mesh: str = "builtin:mug", camera: bool = True, sound: bool = False) -> SceneFile:
    return scene_of(contacts, camera=camera, sound=sound, mesh=mesh, shape="unknown")


@pytest.fixture(
    scope="module",
    params=[("builtin:mug", 60), pytest.param(("builtin:mug", 61), marks=pytest.mark.slow)],
    ids=str,
)
def explored(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, station: Station
) -> Recording:
    mesh, seed = request.param
    return ran(tmp_path_factory.mktemp("unknown") / "run", unknown(MOST, mesh), station, seed)


def test_most_lines_meet_it(explored: Recording) -> None:
    answering = answering_of(explored)
    assert len(answering.met) == MOST
    assert sum(answering.met) >= 6


def test_contacts_see_both_of_its_ends_and_what_is_between(explored: Recording) -> None:
    """Spread over more than half of the object, measured along its longest level side."""
    places = np.array([patch.points[0] for patch in answering_of(explored).patches])
    true = true_mesh(explored).vertices
    assert np.ptp(places[:, :2], axis=0).max() > 0.5 * np.ptp(true[:, :2], axis=0).max()


def test_no_travel_comes_near_the_true_object_nor_enters_the_space_it_may_take(explored: Recording) -> None:
    model, moved = answering_of(explored).model, list(travels(explored))
    assert len(moved) >= MOST
    assert not rehearse(model.twin_around(true_mesh(explored)), moved).refusals
    explorer = Explorer(RunFiles(explored))
    explorer.plan(explored, 1)
    space = explorer._surroundings().travels
    assert not rehearse(space, moved).refusals


def test_the_object_is_within_the_space_and_a_look_makes_it_small(explored: Recording) -> None:
    answering = answering_of(explored)
    assert isinstance(answering.outline, SeenOutline)
    largest = answering.model.sizes.high
    unseen = unknown_space(answering.model.unknown_stand, None, largest)
    seen = unknown_space(answering.model.unknown_stand, answering.outline, largest)
    assert outside(explored, seen) < 0.0
    assert outside(explored, unseen) < 0.0
    assert ConvexHull(seen.vertices).volume < 0.5 * ConvexHull(unseen.vertices).volume


def test_the_space_of_what_was_never_seen_holds_the_largest_box_at_any_turn(explored: Recording) -> None:
    model = answering_of(explored).model
    space, largest = unknown_space(model.unknown_stand, None, model.sizes.high), model.sizes.high
    low, high = space.bounds
    reach = largest / np.sqrt(2.0) + 3.0 * model.place_error
    assert np.all(high[:2] - model.place[:2] >= reach)
    assert np.all(model.place[:2] - low[:2] >= reach)
    assert high[2] - model.place[2] >= largest + margin_of(largest)


@pytest.mark.parametrize("camera", [True, False], ids=["seen", "never seen"])
def test_the_mesh_of_the_scene_changes_no_plan(tmp_path: Path, station: Station, camera: bool) -> None:
    """Another thing of the same longest side in the planner's eyes: the same first contact."""
    recording = ran(tmp_path / "run", unknown(1, camera=camera), station, 60)
    other, run = build("wrench"), RunFiles(recording)
    longest = float(np.ptp(run.mesh.bounds, axis=0).max())
    scaled = Mesh(other.vertices * (longest / np.ptp(other.bounds, axis=0).max()), other.faces)
    object.__setattr__(run, "mesh", scaled)
    made = recording.step(int(camera)).step.parameters
    planned = Explorer(run).plan(recording, int(camera))
    assert {key: made[key] for key in planned} == planned


@pytest.fixture(scope="module")
def struck(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Recording:
    return ran(tmp_path_factory.mktemp("struck") / "run", unknown(3, sound=True), station, 61)


@pytest.mark.slow  # as in test_exploring.py
def test_it_is_struck_where_the_gel_has_met_it(struck: Recording) -> None:
    made = [record.step.index for record in struck.steps() if POSE in record.readings]
    assert made
    assert len(answering_of(struck).strikes) == len(made)


@pytest.mark.slow  # a whole run with strikes; each sense has tests of its own
def test_every_sense_answers_and_none_looks_at_the_drawing(struck: Recording, tmp_path: Path) -> None:
    accuracy = Accuracy.default(EXPERIMENT.knobs)
    draw = partial(write_run_page, EXPERIMENT)
    result = finish(EXPERIMENT, RunFiles(struck), accuracy, draw, folder=tmp_path)
    assert not result["shape_known"]
    for sense in ("vision", "audio", "touch", "fused"):
        one = result["estimates"][sense]
        assert one["refused"] is None
        assert 0.04 < one["low90_m"] < one["size_m"] < one["high90_m"] < 0.65
    page = Path(result["report"]).read_text()
    assert "household things" in page
    assert "the model is drawn" not in page
    run = RunFiles(struck)
    other = build("wrench")
    longest = float(np.ptp(run.mesh.bounds, axis=0).max())
    scaled = Mesh(other.vertices * (longest / np.ptp(other.bounds, axis=0).max()), other.faces)
    object.__setattr__(run, "mesh", scaled)
    answering = ScaleAnswering(run, accuracy)
    for record in struck.steps():
        answering.read(record)
    assert answering.answer().fused.size == result["size_m"]
