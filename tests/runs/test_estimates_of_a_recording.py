"""What an estimate depends on: the readings, the models, the levels and the seed; nothing else."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.report.result import true_points
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.recording.truth_file import write_truth_file
from tests.support.localization import answer, chosen
from tests.support.sessions import score
from tests.support.whole_run import copied, edited, rewritten, with_reading

MOVED = np.array([0.03, -0.02, 0.01])


def answered(recording: Recording) -> Answer:
    return answer(RunFiles(recording), chosen([]))


def numbers(found: Answer) -> dict[str, Any]:
    """Every number of an answer that is not a time."""
    each = [one for one in found.by_sense.values() if isinstance(one, Estimate)]
    return {
        "points": [e.points for e in each],
        "weights": [e.weights for e in each],
        "positions": [e.position_in_object for e in each],
        "contacts": [e.contacts for e in each],
        "candidates": [e.candidates for e in each],
        "credible90": [e.credible90 for e in each],
        "area": [e.region.area for e in each],
        "yaw": [(e.yaw, e.yaw_sigma) for e in each],
        "modes": [[(m.position, m.weight, m.covariance) for m in e.modes] for e in each],
        "fits": [[g.fit for g in e.gates] for e in each],
    }


def assert_same(one: Any, other: Any) -> None:
    """To the bit."""
    np.testing.assert_equal(one, other)


@pytest.fixture(scope="module")
def found(done: Recording) -> Answer:
    return answered(done)


def test_an_answer_is_the_same_to_the_bit_each_time(done: Recording, found: Answer) -> None:
    assert_same(numbers(answered(Recording(done.folder))), numbers(found))


def test_the_truth_is_not_looked_at(done: Recording, found: Answer, tmp_path: Path) -> None:
    without = copied(done, tmp_path / "run", truth=False)
    assert_same(numbers(answered(without)), numbers(found))


def test_a_false_truth_changes_no_estimate(done: Recording, found: Answer, tmp_path: Path) -> None:
    lied = copied(done, tmp_path / "run")
    truth = json.loads(lied.truth_path.read_text())
    for contact in truth["contacts"]:
        contact["point_in_object_m"] = [0.5, 0.5, 0.5]
    write_truth_file(lied.truth_path, truth)
    assert_same(numbers(answered(lied)), numbers(found))


def test_base_and_object_moved_together_change_no_estimate(
    done: Recording, found: Answer, tmp_path: Path
) -> None:
    def move_scene(tree: dict[str, Any]) -> None:
        pose = tree["scene"]["object"]["pose"]
        position = [float(text.removesuffix(" m")) for text in pose["position"]]
        pose["position"] = [f"{value!r} m" for value in (np.array(position) + MOVED).tolist()]

    def move(values: FloatArray) -> FloatArray:
        values[:, :3] += MOVED
        return values

    moved = edited(copied(done, tmp_path / "run"), move_scene)
    assert RunFiles(moved).scene.base_from_object(RunFiles(moved).mesh)[:3, 3] == pytest.approx(
        RunFiles(done).scene.base_from_object(RunFiles(done).mesh)[:3, 3] + MOVED, abs=1e-12
    )
    moved = rewritten(moved, lambda record: with_reading(record, "arm.base_from_flange", move))
    again = answered(moved)
    before = done.step(0).readings["arm.base_from_flange"].values
    assert moved.step(0).readings["arm.base_from_flange"].values[:, :3] == pytest.approx(
        before[:, :3] + MOVED, abs=1e-15
    )
    assert again.last.position_in_object == pytest.approx(found.last.position_in_object, abs=1e-9)
    assert again.last.contacts == pytest.approx(found.last.contacts, abs=1e-9)
    assert again.last.credible90 == pytest.approx(found.last.credible90, abs=1e-9)
    assert [m.weight for m in again.last.modes] == pytest.approx([m.weight for m in found.last.modes])
    assert np.array([m.position for m in again.last.modes]) == pytest.approx(
        np.array([m.position for m in found.last.modes]), abs=1e-9
    )


def test_the_object_moved_alone_changes_no_estimate(done: Recording, found: Answer, tmp_path: Path) -> None:
    """The absolute position is not known to the estimator, so the scene's own is not used."""

    def move(tree: dict[str, Any]) -> None:
        tree["scene"]["object"]["pose"]["position"] = ["-0.3 m", "0.2 m", "0.4 m"]

    assert_same(numbers(answered(edited(copied(done, tmp_path / "run"), move))), numbers(found))


def test_what_was_planned_is_not_looked_at(done: Recording, found: Answer, tmp_path: Path) -> None:
    def forget(tree: dict[str, Any]) -> None:
        tree["plan"] = {}

    emptied = edited(copied(done, tmp_path / "run"), forget)
    emptied = rewritten(emptied, lambda record: replace(record, step=replace(record.step, parameters={})))
    assert_same(numbers(answered(emptied)), numbers(found))


def test_other_readings_than_images_and_poses_are_not_looked_at(
    done: Recording, found: Answer, tmp_path: Path
) -> None:
    needed = ("gel.image", "arm.base_from_flange")
    bare = rewritten(
        copied(done, tmp_path / "run"),
        lambda record: replace(record, readings={name: record.readings[name] for name in needed}),
    )
    assert_same(numbers(answered(bare)), numbers(found))


def test_the_poses_are_looked_at(done: Recording, found: Answer, tmp_path: Path) -> None:
    """A control of the tests above: they compare something that a reading can change."""

    def shift(record: StepRecord) -> StepRecord:
        by = np.array([0.002, 0, 0, 0, 0, 0, 0]) if record.step.index == 1 else 0.0
        return with_reading(record, "arm.base_from_flange", lambda values: values + by)

    changed = answered(rewritten(copied(done, tmp_path / "run"), shift))
    assert np.linalg.norm(changed.last.contacts - found.last.contacts, axis=1).max() > 1e-5


def test_the_images_are_looked_at(done: Recording, found: Answer, tmp_path: Path) -> None:
    """Another: one contact's images in the place of another's."""

    def swap(record: StepRecord) -> StepRecord:
        images = done.step((1, 0, 2)[record.step.index]).readings["gel.image"]
        taken = replace(images, times=record.readings["gel.image"].times)
        return replace(record, readings={**record.readings, "gel.image": taken})

    swapped = rewritten(copied(done, tmp_path / "run"), swap)
    try:
        changed = answered(swapped)
    except FitRefused:
        return
    assert [gate.fit for gate in changed.last.gates] != [gate.fit for gate in found.last.gates]


def test_scores_are_null_without_a_truth(done: Recording, tmp_path: Path) -> None:
    scored = score(copied(done, tmp_path / "run", truth=False), chosen([]))
    assert scored.truth is None
    assert true_points(scored) is None
