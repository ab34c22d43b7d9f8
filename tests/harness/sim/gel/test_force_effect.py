"""The force of a press as an effect: computed where it is asked for, once, and by nothing else."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, OutOfDomain, WrongUse
from harness.basics.files.json_file import write_model
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.force import look_up_force
from harness.effects.touch_press import press_heights
from harness.sim.gel import contact_force as forces
from harness.sim.gel.contact_force import ForceTable, read_force_table
from harness.sim.gel.elastic import GelElastic
from harness.sim.optics.known_gel import Gel
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples.pressed_shapes import paraboloid

SCENE = scene_from_options("builtin:mug")
BENCH = Gel(GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"), elastic=GelElastic(0.3e6, 0.05))
PITCH, THICK = GELSIGHT_R15.pitch, GELSIGHT_R15.gel_thickness

TABLE: dict[str, Any] = {
    "schema": 1,
    "sensor": "GelSight R1.5",
    "serial": "B-17",
    "indenter": "steel ball of 4 mm",
    "made_from": "forty presses on 14 March",
    "of": "depth_m",
    "rows": [
        {"at": 0.2e-3, "force_n": 0.1, "sigma_n": 0.01},
        {"at": 0.4e-3, "force_n": 0.3, "sigma_n": 0.02},
        {"at": 0.8e-3, "force_n": 1.0, "sigma_n": 0.06},
    ],
}


def _ball(depth: float) -> FloatArray:
    heights = np.zeros((120, 160))
    heights[10:110, 30:130] = paraboloid(5e-3, depth, PITCH, 100)
    return heights


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Levels of the contacts that were solved, in order."""
    calls: list[str] = []
    alone = forces._pressed

    def counted(*given: Any) -> FloatArray:
        calls.append(given[4])
        return alone(*given)

    monkeypatch.setattr(forces, "_pressed", counted)
    return calls


def test_no_force_is_computed_that_nobody_asked_for(solved: list[str]) -> None:
    press = press_heights(_ball(0.5e-3), "object", BENCH, SCENE)
    assert solved == []
    assert press.force is None
    skipped = {effect.effect.provides: effect.reason for effect in press.plan.skipped}
    assert skipped["touch.force"] == "nothing asked for touch.force"


@pytest.mark.parametrize("level", ["layer", "winkler"])
def test_a_force_that_is_asked_for_is_computed_once_and_changes_no_picture(
    solved: list[str], level: str
) -> None:
    press = press_heights(_ball(0.5e-3), "object", BENCH, SCENE, [f"touch.force={level}"], force=True)
    # Twice: on squares twice as large as well, to say what squares cost.
    assert solved == [level, level]
    assert press.evaluation.calls["touch.force"] == 1
    assert press.plan.levels["touch.force"] == level
    assert ("touch.force_cells" in press.plan.levels) == (level == "layer")
    assert np.array_equal(press.image, press_heights(_ball(0.5e-3), "object", BENCH, SCENE).image)
    wanted = forces.contact_force(_ball(0.5e-3)[None], PITCH, THICK, BENCH.elastic, level)  # type: ignore[arg-type]
    assert press.force is not None
    assert press.force.newtons == wanted.newtons


def test_nothing_presses_with_exactly_no_force(solved: list[str]) -> None:
    press = press_heights(np.zeros((120, 160)), "object", BENCH, SCENE, force=True)
    assert solved == []
    assert press.force is not None
    assert press.force.newtons[0] == 0.0 == press.force.uncertainty[0]
    assert not press.force.lower_bound.any()
    assert not press.force.beyond_checked.any()


def test_the_surface_of_a_gel_asks_for_the_force_of_what_it_is_a_surface_of() -> None:
    """Drawn by a skirt that is not physics: within a tenth, to 2 % of the radius deep and to 20 %."""
    for depth in (0.1e-3, 0.5e-3, 1e-3):
        whole = press_heights(_ball(depth), "object", BENCH, SCENE, force=True)
        again = press_heights(whole.surface, "gel", BENCH, SCENE, force=True)
        assert whole.force is not None
        assert again.force is not None
        assert again.force.newtons == pytest.approx(whole.force.newtons, rel=0.1)
    assert forces.pressed_of_gel(np.array([[-1.0, 0.05, 0.2, 1.0]])).tolist() == [[0.0, 0.0, 0.2, 1.0]]


def test_measured_forces_pass_their_rows_rise_between_them_and_carry_their_scatter() -> None:
    table = ForceTable.model_validate(TABLE)
    for row in table.rows:
        assert table.at(row.at) == pytest.approx((row.force_n, row.sigma_n))
    between = [table.at(depth)[0] for depth in np.linspace(0.0, 0.8e-3, 200)]
    assert between[0] == 0.0
    assert (np.diff(between) > 0.0).all()
    found = look_up_force(_ball(0.4e-3)[None], GELSIGHT_R15, table)
    deepest = _ball(0.4e-3).max()
    assert (found.newtons[0], found.uncertainty[0]) == pytest.approx(table.at(deepest))
    assert found.centre[0] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_table_by_volume_goes_by_the_volume_that_the_object_takes() -> None:
    rows = [
        {"at": at * 1e-9, "force_n": force, "sigma_n": 0.1} for at, force in ((1, 1.0), (2, 3.0), (9, 20.0))
    ]
    table = ForceTable.model_validate({**TABLE, "of": "volume_m3", "rows": rows})
    depth = _ball(0.5e-3)
    assert table.measure(depth, PITCH) == pytest.approx(np.pi * 5e-3 * 0.5e-3**2, rel=1e-3)
    assert look_up_force(depth[None], GELSIGHT_R15, table).newtons == pytest.approx(
        table.at(float(depth.sum()) * PITCH**2)[0]
    )


def test_a_press_takes_measured_forces_where_they_are_chosen() -> None:
    measured = Gel(BENCH.sensor, BENCH.calibration, forces=ForceTable.model_validate(TABLE))
    press = press_heights(_ball(0.4e-3), "object", measured, SCENE, ["touch.force=table"], force=True)
    assert press.force is not None
    assert press.force.newtons[0] == pytest.approx(0.3, rel=0.01)
    with pytest.raises(OutOfDomain, match=r"0\.8992 mm.*0\.8\b"):
        press_heights(_ball(0.9e-3), "object", measured, SCENE, ["touch.force=table"], force=True)
    with pytest.raises(WrongUse, match="--force-table"):
        press_heights(_ball(0.4e-3), "object", BENCH, SCENE, ["touch.force=table"], force=True)


def test_a_table_reads_back_as_it_was_written(tmp_path: Path) -> None:
    table = ForceTable.model_validate(TABLE)
    write_model(table, tmp_path / "f.json")
    assert read_force_table(tmp_path / "f.json") == table


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": TABLE["rows"][::-1]}, "row 2 .*row 1"),
        ({"rows": TABLE["rows"][:2]}, "rows: .*3 items"),
        ({"rows": [*TABLE["rows"], {"at": 1e-3, "force_n": 0.9, "sigma_n": 0.1}]}, "row 4 .*0.9 N"),
        (
            {"rows": [{"at": 0.0, "force_n": 0.1, "sigma_n": 0.1}, *TABLE["rows"]]},
            "rows.0.at: ",
        ),
        ({"rows": [{"at": 1e-4, "force_n": 0.05, "sigma_n": 0.0}, *TABLE["rows"]]}, "rows.0.sigma_n"),
        ({"rows": [{"at": 1e-4, "force_n": "0.05 N", "sigma_n": 0.1}, *TABLE["rows"]]}, "rows.0.force_n"),
        ({"of": "depth_mm"}, "of: "),
        ({"unit": "N"}, "unit: "),
        ({"schema": 2}, "schema: "),
    ],
)
def test_what_is_no_table_of_forces_is_refused_by_its_place(
    tmp_path: Path, change: dict[str, Any], said: str
) -> None:
    (tmp_path / "f.json").write_text(json.dumps({**TABLE, **change}))
    with pytest.raises(CalibrationRefused, match=said):
        read_force_table(tmp_path / "f.json")


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": 1}', '{"rows": [NaN]}'])
def test_a_file_that_is_no_json_of_forces_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "f.json").write_text(text)
    with pytest.raises(CalibrationRefused, match=r"f\.json"):
        read_force_table(tmp_path / "f.json")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"young": 0.0}, "modulus of 0 Pa"),
        ({"young": np.nan}, "modulus of nan Pa"),
        ({"poisson": 0.51}, "0.51 "),
        ({"poisson": -0.1}, "-0.1 .*gel"),
        ({"young_share": -0.1}, "-0.1 of the modulus"),
        ({"thickness_share": np.nan}, "nan of the thickness"),
    ],
)
def test_a_gel_that_cannot_be_is_refused(given: dict[str, float], said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        GelElastic(**{"young": 1e5, "young_share": 0.1, **given})  # type: ignore[arg-type]
