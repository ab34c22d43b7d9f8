"""Shadows from ball presses: one cast by geometry is found again, and nothing else is taken for one."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.held_out import teach
from calibration.taxim.mark_free import Identity, MarkFree, calibrate
from calibration.taxim.pictures import Pictures
from calibration.taxim.shadow import DIRECTIONS, fit_shadow, rim_reach
from calibration.taxim.smooth_fit import changes
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.bench.station_file import load_station, station_path
from harness.recording.run_folder import station_calibration
from harness.sim.optics.lit_calibration import ShadowedCalibration, read_calibration, shadow_of, with_shadow
from harness.sim.optics.shadow import rim
from harness.sim.optics.shadow_file import read_shadow_table, write_shadow_table
from harness.sim.optics.tactile_calibration import save_calibration
from tests.samples.ball_depth import usable
from tests.samples.drawn_presses import (
    BALL,
    COLUMNS,
    CONTACT,
    LIGHTS,
    ROWS,
    DrawnGel,
    press_set,
    rounded,
    spread_centres,
)
from tests.samples.real_press import R15, set_of

ROOT = Path(__file__).parents[3]
WHO = Identity("drawn", "0", "none", "2026-01-01", pitch=1e-4, ball_radius=BALL * 1e-4)
GREEN = 1
DARK = 24.0
GRAZING = 0.12
"""Tangent of the green light's elevation: its shadows reach two contacts past the rim."""

AWAY = float(np.arctan2(-LIGHTS[GREEN, 1], -LIGHTS[GREEN, 0]) % (2.0 * np.pi))
"""Rad: where the green light, whose direction the drawn slopes have too, throws its shadows."""


def _height(away: FloatArray) -> FloatArray:
    """Pixels, of the ball with a short skirt."""
    cap = np.sqrt(np.maximum(BALL**2 - np.minimum(away, CONTACT) ** 2, 0.0)) - np.sqrt(BALL**2 - CONTACT**2)
    height: FloatArray = np.where(away < CONTACT, cap + 2.0, 2.0 * np.exp(-(away - CONTACT) / 2.0))
    return height


def _in_shadow(centre: FloatArray) -> FloatArray:
    """``(rows, columns)`` share of the light that the ball takes: from every pixel one looks at it."""
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    right, down = x - centre[0], y - centre[1]
    here, highest = _height(np.hypot(right, down)), np.full(x.shape, -np.inf)
    for step in np.arange(1.0, 40.0):
        toward = np.hypot(right - step * np.cos(AWAY), down - step * np.sin(AWAY))
        highest = np.maximum(highest, _height(toward) - step * GRAZING)
    # A light is not a point: its edge is soft over half a pixel of height.
    share: FloatArray = np.clip((highest - here) / 0.5, 0.0, 1.0)
    return np.where(np.hypot(right, down) > CONTACT, share, 0.0)


@cache
def _shadowed(colour: int = GREEN) -> Pictures:
    gel, images = DrawnGel(dimming=12.0), []
    for seed, centre in enumerate(spread_centres(20)):
        picture = gel.press((centre[0], centre[1]), seed)
        picture[..., colour] -= DARK * _in_shadow(centre)
        images.append(rounded(picture))
    return press_set(images, rounded(gel.rest()))


@cache
def _made() -> MarkFree:
    return calibrate(_shadowed(), WHO)


def test_a_cast_shadow_is_found_in_its_colour_and_away_from_its_light() -> None:
    found = _made().shadow.colours[GREEN]
    assert _made().shadow_missing == ""
    assert [one.missing == "" for one in _made().shadow.colours] == [False, True, False]
    assert abs((found.falls - AWAY + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(3.0)
    # A part of the shadow is taken by the light's smooth terms, and none is made up.
    assert 0.5 * DARK < found.deepest < 1.15 * DARK
    assert found.falls_error < np.radians(3.0)


def test_presses_held_out_are_predicted_better_with_it() -> None:
    score = _made().shadow_score
    assert score is not None
    assert score.worth
    # Of a press at the border the shadow may fall outside the picture.
    assert 0.8 * score.of <= score.presses <= score.of == len(_made().used)
    assert score.gain > 3.0
    assert score.better > 0.9


def test_a_dark_wedge_towards_the_light_is_no_shadow() -> None:
    """The green light's shadow drawn in red, whose light comes from elsewhere."""
    pack = usable(_shadowed(0), BALL)
    change = changes(pack)
    model = teach(pack, change, BALL)
    fit = fit_shadow(pack, change - model.rest, model.fit.centres, model.light)
    assert fit.table is None
    assert all(colour.missing for colour in fit.colours)


def test_shallower_rims_throw_shorter_and_fainter_shadows() -> None:
    table = _made().shadow.table
    assert table is not None
    lengths = table.lengths[GREEN]
    assert (np.diff(lengths, axis=1) >= 0).all()
    lit = lengths[:, -1] > 0
    long = lengths[:, -1] >= 4
    assert (lengths[long, 0] < lengths[long, -1]).all()
    last = np.cumsum(table.lengths.ravel()).reshape(table.lengths.shape)
    darkest = np.array(
        [
            [
                table.values[last[GREEN, d, k] - lengths[d, k] : last[GREEN, d, k]].min(initial=0.0)
                for k in range(lengths.shape[1])
            ]
            for d in np.flatnonzero(lit)
        ]
    )
    assert (np.diff(darkest, axis=1) <= 1e-9).all()


def test_rays_begin_where_the_rim_of_the_simulator_ends() -> None:
    y, x = np.mgrid[-40:41, -40:41]
    core: BoolArray = np.hypot(x, y) <= 20.0
    ring = rim(core)
    directions = (np.arange(DIRECTIONS) + 0.5) * 2.0 * np.pi / DIRECTIONS
    for direction, reach in zip(directions, rim_reach(20.0, directions), strict=True):
        inside = 40.0 + (reach - 1.0) * np.array([np.sin(direction), np.cos(direction)])
        beyond = 40.0 + (reach + 1.5) * np.array([np.sin(direction), np.cos(direction)])
        assert ring[tuple(np.rint(inside).astype(int))]
        assert not ring[tuple(np.rint(beyond).astype(int))]


@pytest.mark.slow  # measured data that do not change
def test_real_presses_throw_a_blue_shadow_away_from_the_blue_light(shared_data: Path) -> None:
    """Slopes within the contact and the dark wedge outside it know nothing of each other, and agree."""
    pack = usable(set_of(shared_data, "r15"), R15.ball)
    change = changes(pack)
    model = teach(pack, change, R15.ball)
    blue = fit_shadow(pack, change - model.rest, model.fit.centres, model.light).colours[2]
    assert blue.missing == ""
    assert blue.deepest > 15.0
    assert abs(blue.falls - blue.dark_side) < np.radians(5.0)


def test_shadows_in_the_published_layout_read_back(tmp_path: Path) -> None:
    """Of a rim that is deep enough for that layout's rows, which begin at the untouched gel."""
    table = _made().shadow.in_metres(1e-3)
    assert table is not None
    write_shadow_table(table, tmp_path / "shadowTable.npz")
    back = read_shadow_table(tmp_path / "shadowTable.npz")
    assert back.lengths.shape == (3, 63, 9)
    assert not back.lengths[[0, 2]].any()
    assert not back.lengths[:, :, :2].any()
    for d in range(63):
        apart = (table.directions - back.directions[d] + np.pi) % (2.0 * np.pi) - np.pi
        row = int((-0.15e-3 + 8 * 0.1e-3 - table.shallowest) / table.depth_step)
        assert back.lengths[GREEN, d, 8] == table.lengths[GREEN, np.argmin(np.abs(apart)), row]


def test_a_calibration_keeps_its_shadows_on_the_disk(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("shadow") / "fitted.npz"
    made = _made().calibration
    assert isinstance(made, ShadowedCalibration)
    save_calibration(made, path)
    back = read_calibration(path)
    assert isinstance(back, ShadowedCalibration)
    assert back.sha256 == made.sha256
    assert np.array_equal(back.shadow.values, made.shadow.values)
    assert back.shadow_rays[5] == pytest.approx(_made().shadow.rim * WHO.pitch)


def test_a_station_whose_light_casts_shadows_needs_a_calibration_that_has_some(tmp_path: Path) -> None:
    made = _made().calibration
    assert isinstance(made, ShadowedCalibration)
    save_calibration(made, tmp_path / "shadowed.npz")
    rows, columns = made.background.shape[:2]
    shipped = (ROOT / "harness" / "bench" / "sensors" / "gelsight-r1.5.toml").read_text(encoding="utf-8")
    as_drawn = shipped.replace("rows = 120", f"rows = {rows}").replace(
        "columns = 160", f"columns = {columns}"
    )
    (tmp_path / "drawn.toml").write_text(as_drawn, encoding="utf-8")
    station = load_station(station_path("mock"))
    grazed = station.gel.model_copy(update={"casts_shadow": True})
    with pytest.raises(WrongUse, match=r"gel\.casts_shadow = true.*gelsight_r15_bench"):
        station_calibration(station.model_copy(update={"gel": grazed}))
    own = {"make": str(tmp_path / "drawn.toml"), "calibration": str(tmp_path / "shadowed.npz")}
    measured = grazed.model_copy(update=own)
    found = station_calibration(station.model_copy(update={"gel": measured}))
    assert shadow_of(found) is not None


def test_tables_that_do_not_hold_together_are_refused() -> None:
    made = _made().calibration
    assert isinstance(made, ShadowedCalibration)
    with pytest.raises(CalibrationRefused, match=r"\b692 .*\b691 "):
        replace(made, shadow_values=made.shadow_values[:-1])
    with pytest.raises(CalibrationRefused, match=r"shadow_rays.*\(5,\)"):
        replace(made, shadow_rays=made.shadow_rays[:-1])
    with pytest.raises(CalibrationRefused, match=r" 0 m, 1\.25 px.*0\.05 rad"):
        with_shadow(made, replace(made.shadow, depth_step=0.0), 1e-3)
