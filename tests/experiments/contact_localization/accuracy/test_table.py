"""The localization table: rows aggregate what runs say, nothing is left out because it went badly."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.accuracy import measurement
from experiments.contact_localization.accuracy.measurement import METHODS
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.baselines import mean_random_error
from experiments.contact_localization.posterior.estimate import SPACING
from experiments.contact_localization.posterior.policy import read
from harness.basics.errors import WrongUse
from harness.basics.symmetry import find_symmetries
from harness.bench.scene import scene_from_options
from harness.experiment.in_process import RunCell
from harness.experiment.measuring import measurement_of
from harness.experiment.subjects import objects
from harness.experiment.tables import TableRow, measure
from harness.experiment.tables import rows as rows_of
from harness.recording.observation import Observation
from harness.sim.optics.inverse import GelReader
from tests.support.localization import conditions

MEASURED = measurement_of(EXPERIMENT)
Results = dict[RunCell, Mapping[str, Any]]


def result(errors: Mapping[str, float], held: bool = True, **more: Any) -> dict[str, Any]:
    """As a cell's file holds it."""
    written: dict[str, Any] = {}
    for method in METHODS:
        error = errors.get(method, 0.05)
        written[method] = {"error_m": error, "error_symmetric_m": 0.5 * error, "seconds": 0.2, **more}
    written["random"]["error_symmetric_m"] = None
    for method in ("paper's touch filter", "touch"):
        written[method]["in_region90"] = held
    return {"schema": 1, "rows": written}


def runs(errors: list[float], gap: str = "default", spacing: str = "close") -> Results:
    """One seed each."""
    return {
        ContactCell("mug", gap, seed, spacing): result({"touch": error}, held=error < GROSS)
        for seed, error in enumerate(errors)
    }


GROSS = MEASURED.gross


def rows(results: Results) -> list[TableRow]:
    return rows_of(EXPERIMENT, results)


def row(found: list[TableRow], method: str, spacing: str = "close", gap: str = "default") -> TableRow:
    wanted = (method, spacing, gap)
    (only,) = [r for r in found if (r.method, r.conditions["spacing"], r.conditions["gap"]) == wanted]
    return only


ERRORS = [1e-3, 2e-3, 3e-3, 60e-3, 1e-3, 4e-3, 2e-3]


def test_a_row_has_the_median_the_mean_and_the_share_of_failures() -> None:
    ours = row(rows(runs(ERRORS)), "touch")
    assert ours.runs == len(ERRORS)
    assert [interval.value for interval in ours.raw] == pytest.approx(
        [np.median(ERRORS), np.mean(ERRORS), 1.0 / len(ERRORS)]
    )
    assert ours.symmetric is not None
    assert [interval.value for interval in ours.symmetric] == pytest.approx(
        [0.5 * np.median(ERRORS), 0.5 * np.mean(ERRORS), 1.0 / len(ERRORS)]
    )
    assert ours.held == pytest.approx(6.0 / 7.0)
    assert ours.seconds == 0.2


def test_every_number_has_an_interval_around_it() -> None:
    for interval in row(rows(runs(ERRORS)), "touch").raw:
        assert interval.low <= interval.value <= interval.high
    wide, narrow = (row(rows(runs(ERRORS * n)), "touch").raw[1] for n in (1, 16))
    # Sixteen times the runs, a quarter of the width.
    assert (wide.high - wide.low) / (narrow.high - narrow.low) == pytest.approx(4.0, rel=0.4)


def test_a_failure_is_counted_at_its_full_value() -> None:
    good, bad = (row(rows(runs([1e-3] * 9 + [last])), "touch").raw for last in (1e-3, 0.1))
    assert bad[1].value - good[1].value == pytest.approx(0.099 / 10.0)
    assert (good[2].value, bad[2].value) == (0.0, 0.1)


def test_conditions_are_not_mixed() -> None:
    both = {**runs([1e-3, 1e-3]), **runs([5e-3], gap="none"), **runs([9e-3], spacing="spread")}
    found = rows(both)
    assert len(found) == 3 * len(METHODS)
    assert row(found, "touch").raw[0].value == pytest.approx(1e-3)
    assert row(found, "touch", gap="none").raw[0].value == pytest.approx(5e-3)
    assert row(found, "touch", spacing="spread").raw[0].value == pytest.approx(9e-3)


def test_every_method_has_its_row_and_only_ours_a_region() -> None:
    found = rows(runs(ERRORS))
    assert [r.method for r in found] == list(METHODS)
    assert [r.held is None for r in found] == [method != "touch" for method in METHODS]
    assert row(found, "random").symmetric is None


def test_the_order_of_the_runs_changes_no_value() -> None:
    forward = runs(ERRORS)
    backward = dict(reversed(list(forward.items())))
    for one, other in zip(rows(forward), rows(backward), strict=True):
        assert [i.value for i in one.raw] == pytest.approx([i.value for i in other.raw])


def test_a_run_that_could_not_be_performed_is_no_localization_and_none_at_all_is_refused() -> None:
    failed: Results = {ContactCell("mug", "default", 99, "close"): {"schema": 1, "failed": "NotTouched: ..."}}
    assert row(rows({**runs(ERRORS), **failed}), "touch").runs == len(ERRORS)
    with pytest.raises(WrongUse, match="table"):
        rows(failed)


def test_a_row_counts_the_answers_that_were_refused() -> None:
    found = dict(runs(ERRORS))
    found[ContactCell("mug", "default", 99, "close")] = result({"touch": 70e-3}, refused="it does not fit")
    assert row(rows(found), "touch").refused == 1
    assert row(rows(runs(ERRORS)), "touch").refused == 0


def test_a_refused_fit_of_the_right_object_is_a_failure_at_the_value_of_a_guess(
    block: Model, prior: Prior
) -> None:
    blank = np.repeat(block.calibration.background[None], 2, axis=0)
    poses = [np.eye(4), np.eye(4)]
    observations = tuple(Observation(pose, blank) for pose in poses)
    true = np.array([0.02, -0.0075, 0.025])
    symmetry = find_symmetries(block.mesh)
    answered = measurement._estimated(
        read(observations, GelReader(block.calibration), block, prior, seed=0),
        {SPACING.name: 3e-3},
        true,
        symmetry,
    )
    assert answered["error_m"] == answered["error_symmetric_m"] == mean_random_error(block.mesh, true)
    assert answered["in_region90"] is False
    assert "tactile image" in answered["refused"]


def test_the_value_of_a_guess_is_the_mean_distance_over_the_surface(block: Model) -> None:
    """Against the surface's own samples, weighed by their areas."""
    true = np.array([0.02, -0.0075, 0.025])
    surface = block.surface(3e-3)
    expected = surface.areas @ np.linalg.norm(surface.points - true, axis=1) / surface.areas.sum()
    # 4,000 points of distances that vary by 18 mm.
    assert mean_random_error(block.mesh, true) == pytest.approx(expected, abs=3.0 * 18e-3 / np.sqrt(4000.0))


def test_a_table_that_is_stopped_is_even() -> None:
    """Every object of a seed comes before the next seed."""
    chosen = conditions("close", "spread", yaws=["known", "unknown"])
    wanted = MEASURED.cells(["mug", "bowl"], [5, 6], chosen)
    assert len(wanted) == len(set(wanted)) == 16
    assert [cell.seed for cell in wanted] == [5] * 8 + [6] * 8
    assert len({cell.name for cell in wanted}) == 16


def test_what_is_on_the_disk_is_not_run_again(tmp_path: Path) -> None:
    wanted = MEASURED.cells(["mug"], [0, 1], conditions("close"))
    for cell in wanted:
        written = result({"touch": 1e-3 * (1 + cell.seed)})
        (tmp_path / f"{cell.name}.json").write_text(json.dumps(written))
    before = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    found = dict(measure(EXPERIMENT, wanted, objects(None), tmp_path, workers=1))
    assert [found[cell]["rows"]["touch"]["error_m"] for cell in wanted] == [1e-3, 2e-3]
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before


def test_every_run_turns_the_object_by_an_angle_of_its_own() -> None:
    scene = scene_from_options("builtin:mug")
    one, same, other = (
        ContactCell("mug", gap, seed, "spread").create_scene(scene).model_dump(mode="json", by_alias=True)
        for gap, seed in (("default", 3), ("none", 3), ("default", 4))
    )
    # The same seed meets the same contacts with the gap on and off: rows are paired.
    assert one == same
    assert one["object"]["pose"]["yaw"] != other["object"]["pose"]["yaw"]
    assert one["localization"]["spacing"] == "spread"


def test_without_the_data_the_table_has_our_own_objects() -> None:
    assert sorted(objects(None)) == ["bowl", "mug", "pitcher", "plate", "tray", "wrench"]


def test_with_the_data_it_has_real_ones_too(shared_data: Path) -> None:
    assert set(objects(shared_data)) - set(objects(None)) == {"025_mug", "wineglass", "teapot"}
