"""Contacts on an object of unknown size: travels keep clear of all it may be, and misses are readings."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.dials import KNOBS
from experiments.scale_estimation.envelope import blind_envelope, seen_envelope
from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply
from harness.basics.mesh import Mesh
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.twin.rehearsal import Segment, rehearse
from tests.experiments.scale_estimation.runs import answered, ran, scene_of


def answering_of(recording: Recording) -> ScaleAnswering:
    answering = ScaleAnswering(RunFiles(recording), Accuracy.default(KNOBS))
    for record in recording.steps():
        answering.read(record)
    return answering


def outside(recording: Recording, space: Mesh) -> float:
    """M by which the true object, as it stands in base, leaves a convex space."""
    truth = json.loads(recording.truth_path.read_text())
    run = RunFiles(recording)
    nominal = float(np.ptp(run.mesh.bounds, axis=0).max())
    size = truth["differences"]["longest_side_m"] / nominal
    places = apply(np.array(truth["base_from_object"]), run.mesh.vertices * size)
    low = run.scene.object.pose.position[2]
    above = places[places[:, 2] > low + 2e-3]
    sides = ConvexHull(space.vertices).equations
    return float((above @ sides[:, :3].T + sides[:, 3]).max())


@pytest.mark.parametrize("mesh", ["builtin:mug", "builtin:wrench"])
@pytest.mark.parametrize("seed", [2, 3, 4])
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
    return ran(tmp_path_factory.mktemp("blind") / "run", scene_of(6, camera=False), station, 31)


def travels(recording: Recording) -> Iterator[Segment]:
    for record in recording.steps():
        parameters = record.step.parameters
        here: FloatArray = np.array(parameters["start_rad"])
        for there in np.array(parameters["travel_rad"]).reshape(-1, 6):
            yield Segment(record.step.index, "travel", "joint", here, there)
            here = there


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
