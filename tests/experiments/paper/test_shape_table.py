"""Rows of the table of shapes: what they are answered from, what they are called, and how they are scored."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from experiments.paper import shape_table
from experiments.paper.shape_table import (
    AVERAGE,
    COLUMNS,
    FLOOR,
    ROW_NAMES,
    ShapeRow,
    points_error,
    rows_after,
    scored_rows,
)
from experiments.shape_reconstruction.cells import PRESSES, ShapeCell
from experiments.shape_reconstruction.experiment import EXPERIMENT, NAME
from experiments.shape_reconstruction.section import ShapeRun
from harness.bench.scene import scene_from_options
from harness.experiment.measuring import table_of
from harness.objects.builtin import build
from harness.tasks.scenes import with_assignments
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses

MUG = build("mug", 6e-3)
TOUCHES = presses(MUG, 12, seed=3)
BOTH = evidence_of(TOUCHES, look_at(MUG))


@pytest.mark.parametrize("made", [0, 1, 6, 8, 20, 32, 100])
def test_every_row_of_a_run_has_a_place_in_the_table(made: int) -> None:
    names = [row.name for row in rows_after(made)]
    assert len(set(names)) == len(names)
    assert [name for name in ROW_NAMES if name in names] == names


def test_rows_after_many_presses_are_of_the_tabled_counts_and_after_few_of_all_that_there_are() -> None:
    whole = {row.name for row in rows_after(PRESSES[-1])}
    assert {
        "family, T8",
        "family, TV32",
        "family, V",
        "hull, T16",
        "retrieval, TV8",
    } <= whole
    few = {row.name for row in rows_after(6) if row.method == "family"}
    assert few == {"family, T6", "family, V", "family, TV2", "family, TV4", "family, TV6"}
    assert {row.presses for row in rows_after(0)} == {0}


def test_a_row_uses_the_senses_and_the_presses_that_it_is_named_for() -> None:
    both, touch = ShapeRow("rbf", "TV", 5).part(BOTH), ShapeRow("rbf", "T", 5).part(BOTH)
    assert both.touches == touch.touches == TOUCHES[:5]
    assert both.look is BOTH.look
    assert touch.look is None
    assert ShapeRow("visual-hull", "V", 0).part(BOTH).touches == ()


@pytest.fixture(scope="module")
def quick() -> dict[str, dict[str, Any]]:
    tabled = {"glance": {"V": (0,)}, "hull": {"T": (4,)}, "rbf": {"TV": (4,)}}
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(shape_table, "TABLED", tabled)
        return scored_rows(BOTH, MUG, len(TOUCHES))


def test_every_answer_is_scored_and_surfaces_by_their_stated_band_too(
    quick: dict[str, dict[str, Any]],
) -> None:
    counted = {f"{name}{count}" for name in ("hull, T", "rbf, TV") for count in (4, len(TOUCHES))}
    assert set(quick) == {FLOOR, AVERAGE, "glance, V"} | counted
    for name, row in quick.items():
        assert row["chamfer_points_m"] > 0.0
        assert 0.0 <= row["f_score"] <= 1.0
        assert row["hausdorff95_m"] >= 0.0
        assert row["error_m"] == pytest.approx(0.5 * (row["accuracy_m"] + row["completeness_m"]))
        stated = name == AVERAGE or name.startswith(("hull", "rbf"))
        assert ("within90_truth" in row) == stated


def test_the_truth_itself_is_the_floor_of_the_published_form(quick: dict[str, dict[str, Any]]) -> None:
    floor = quick[FLOOR]
    assert floor["error_m"] < 1e-9
    others = [row["chamfer_points_m"] for name, row in quick.items() if name != FLOOR]
    assert floor["chamfer_points_m"] < min(others)


def test_points_are_measured_to_the_surface_and_samples_to_points() -> None:
    corner = MUG.vertices[:1]
    found = points_error(np.repeat(corner, 3, axis=0), MUG, 4000)
    assert found.accuracy <= 1e-12
    away = trimesh.Trimesh(MUG.vertices, MUG.faces).sample(2000, seed=1)
    assert found.completeness == pytest.approx(np.linalg.norm(away - corner, axis=1).mean(), rel=0.03)


def test_a_refused_answer_counts_as_far_off_as_the_object_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shape_table, "TABLED", {"hull": {"T": (4,)}})
    missed = tuple(
        replace(touch, points=touch.points[:0], normals=touch.normals[:0]) for touch in TOUCHES[:4]
    )
    row = scored_rows(replace(BOTH, touches=missed), MUG, 4)["hull, T4"]
    assert row["error_m"] == MUG.diagonal
    assert "met nothing" in row["refused"]
    assert row["gross"]


def test_the_columns_of_the_table_are_keys_of_its_rows(quick: dict[str, dict[str, Any]]) -> None:
    rbf = quick["rbf, TV4"]
    assert {"error_m", *(column.key for column in COLUMNS)} <= set(rbf)


@pytest.mark.parametrize("choose", ["random", "active"])
def test_a_cell_makes_as_many_presses_as_its_table_says(choose: str) -> None:
    cell = ShapeCell("mug", "default", 3, choose)
    scene = scene_from_options("builtin:mug")
    assert cell.create_scene(scene).section(ShapeRun).presses == PRESSES[-1]
    few = with_assignments({"mug": scene}, ShapeRun, ["presses=6", "library=somewhere"])["mug"]
    stated = cell.create_scene(few).section(ShapeRun)
    assert (stated.presses, stated.choose, stated.library) == (6, choose, None)
    assert table_of(EXPERIMENT).cells(["mug"], [3], {"gap": ["default"], "choose": [choose]}) == [cell]
    assert EXPERIMENT.name == NAME == "shape-reconstruction"
