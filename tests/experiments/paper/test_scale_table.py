"""The table's trivial rows: what they say of a model's own readings."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from experiments.paper.scale_networks import SIZE_INPUTS
from experiments.paper.scale_table import (
    METHODS,
    PAPER_ROWS,
    by_area,
    by_box,
    by_first_peak,
    constant,
    random_error,
)
from experiments.scale_estimation.answer import STARTS
from experiments.scale_estimation.cells import ScaleCell
from experiments.scale_estimation.experiment import EXPERIMENT
from experiments.scale_estimation.size import SizeRange
from harness.bench.scene import scene_from_json
from harness.bench.station_file import Station
from harness.experiment.measuring import measurement_of, table_of
from tests.experiments.paper.test_scale_networks import write_means
from tests.experiments.scale_estimation.test_sound import NOMINAL, model, peaks_at
from tests.experiments.scale_estimation.test_vision import nominal, outline_at, view_of

RANGE = SizeRange(0.05, 0.2)


def test_a_constant_is_the_middle_and_random_is_worse() -> None:
    assert constant(RANGE) == pytest.approx(0.1)
    for true in (0.05, 0.1, 0.2):
        assert random_error(RANGE, true) > 0.6 * abs(constant(RANGE) - true)
    assert random_error(RANGE, 0.1) == pytest.approx(
        np.mean(np.abs(np.exp(np.linspace(np.log(0.05), np.log(0.2), 100_001)) - 0.1)), rel=2e-3
    )


def test_the_first_peak_is_right_where_the_first_mode_is_heard() -> None:
    assert by_first_peak(peaks_at(1.3, every=1), model(), NOMINAL) == pytest.approx(1.3 * NOMINAL)


@pytest.mark.parametrize("scale", [0.7, 1.5])
def test_the_outline_s_area_gives_a_round_object_s_size_where_it_stands(scale: float) -> None:
    view = view_of("bowl")
    found = by_area(outline_at(view, scale), view, nominal(view))
    assert found == pytest.approx(scale * nominal(view), rel=0.02)


def test_the_outline_s_box_is_foreshortened_and_knows_no_model() -> None:
    view = view_of("bowl")
    assert by_box(outline_at(view, 1.0), view) == pytest.approx(nominal(view), rel=0.1)
    doubled = by_box(outline_at(view, 2.0), view) / by_box(outline_at(view, 1.0), view)
    assert doubled == pytest.approx(2.0, rel=0.15)


@pytest.mark.slow  # a whole run with strikes; runs and methods are tested each by themselves
def test_a_cell_is_answered_by_every_method_and_a_refusal_claims_no_more_than_the_range(
    station: Station, tmp_path: Path
) -> None:
    write_means(tmp_path, *SIZE_INPUTS)
    asked = {"contacts": 3, "strikes": 1, "paper_networks": str(tmp_path)}
    tree = {"schema": 1, "object": {"mesh": "builtin:mug"}, "scale": asked}
    cell = ScaleCell("mug", "unplaced", 3, "yes")
    result = table_of(EXPERIMENT).run_cell(cell, scene_from_json(tree, "the test"), station)
    rows, true = result["rows"], result["size_m"]
    assert result["steps"] == 4
    assert set(rows) <= set(METHODS)
    assert {"random", "constant", "outline's area", "outline's box", "vision", "touch", "fused"} <= set(rows)
    assert set(PAPER_ROWS.values()) <= set(rows)
    for row in rows.values():
        if "size_m" in row:
            assert row["error_m"] == pytest.approx(abs(row["size_m"] - true))
            assert row["gross"] == (row["error_m"] > 0.1 * true)
        if "refused" in row:
            assert row["size_m"] == pytest.approx(rows["constant"]["size_m"])
            assert "in_region90" not in row
    assert rows["vision"]["error_m"] < rows["constant"]["error_m"]


def test_networks_that_answer_a_run_are_no_part_of_it() -> None:
    cell = ScaleCell("mug", "unplaced", 3, "yes")
    tree = {"schema": 1, "object": {"mesh": "builtin:mug"}}
    plain = cell.create_scene(scene_from_json(tree, "the test"))
    named = cell.create_scene(scene_from_json({**tree, "scale": {"paper_networks": "somewhere"}}, "the test"))
    assert plain == named


@pytest.mark.parametrize(
    ("shapes", "levels"),
    [(["known"], STARTS.levels), (["unknown"], [STARTS.default]), (["known", "unknown"], STARTS.levels)],
)
def test_a_cost_curve_turns_the_dial_that_the_answer_depends_on(
    shapes: list[str], levels: Sequence[int]
) -> None:
    asked = measurement_of(EXPERIMENT).list_answers(False, {"shape": shapes}, {}, (4,))
    assert {setting[STARTS.name] for _, setting in asked} == set(levels)
