"""Dots as they were measured: read as written, refused when spoiled, and drawn and moved where they are."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from calibration.markers.dots import find_dots
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, DataRefused, OutOfDomain, WrongUse
from harness.basics.files.json_file import write_model
from harness.basics.toml_file import validate
from harness.bench.scene import SceneFile
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.touch_press import press_heights
from harness.sim.gel.markers import MarkerDot, MarkerFile, marker_displacements, read_markers, rest_markers
from harness.sim.optics.known_gel import known_gel

ROWS, COLUMNS = GELSIGHT_R15.rows, GELSIGHT_R15.columns
WIDE, HIGH, STEP, RADIUS, TURNED = 9, 7, 15.0, 3.0, 0.03


def measured(pitch: float | None = GELSIGHT_R15.pitch) -> MarkerFile:
    """A print that is turned, off the middle, and has lost one dot."""
    index = np.array([(c, r) for r in range(HIGH) for c in range(WIDE) if (c, r) != (4, 2)])
    away = STEP * (index - (np.array([WIDE, HIGH]) - 1) / 2.0)
    turn = np.array([[np.cos(TURNED), -np.sin(TURNED)], [np.sin(TURNED), np.cos(TURNED)]])
    places = away @ turn.T + (81.7, 58.2)
    dots = [
        MarkerDot(row=int(r), column=int(c), x_px=float(x), y_px=float(y), sigma_px=0.01, radius_px=RADIUS)
        for (c, r), (x, y) in zip(index, places, strict=True)
    ]
    return MarkerFile(
        schema=1,
        sensor="drawn",
        serial="7",
        made_from="nothing",
        picture_rows=ROWS,
        picture_columns=COLUMNS,
        pitch_m=pitch,
        ink=0.3,
        rows=HIGH,
        columns=WIDE,
        spacing_px=STEP,
        turned_rad=TURNED,
        dots=dots,
    )


def scene() -> SceneFile:
    return validate({"schema": 1, "object": {"mesh": "x.npy", "material": "steel"}}, SceneFile, "here")


def ball(depth: float) -> FloatArray:
    """How deep a ball of 4 mm reaches, metres."""
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(float)
    away = GELSIGHT_R15.pitch * np.hypot(x - 75.0, y - 62.0)
    cap = 4e-3 - np.sqrt(np.maximum(16e-6 - away**2, 0.0))
    reached: FloatArray = np.where(away < 4e-3, np.maximum(depth - cap, 0.0), 0.0)
    return reached


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "dots.json"
    write_model(measured(), path)
    assert read_markers(path) == measured()
    first = path.read_bytes()
    write_model(measured(), path)
    assert path.read_bytes() == first


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda tree: tree.pop("dots"), "dots"),
        (lambda tree: tree.update(schema=2), "schema"),
        (lambda tree: tree.update(dots=[]), "dots"),
        (lambda tree: tree.update(extra=1), "extra"),
        (lambda tree: tree["dots"][3].update(x_px="wide"), r"dots\.3\.x_px"),
        (lambda tree: tree["dots"][3].update(sigma_px=0.0), r"dots\.3\.sigma_px"),
        (lambda tree: tree.update(ink=1.5), "ink"),
    ],
)
def test_what_is_not_such_a_file_is_refused_by_name(spoil: object, says: str, tmp_path: Path) -> None:
    tree = measured().model_dump(by_alias=True)
    assert callable(spoil)
    spoil(tree)
    path = tmp_path / "dots.json"
    path.write_text(json.dumps(tree))
    with pytest.raises(CalibrationRefused, match=says):
        read_markers(path)
    path.write_text("no json")
    with pytest.raises(CalibrationRefused, match="calibrate markers"):
        read_markers(path)
    with pytest.raises(WrongUse, match=r"nowhere\.json"):
        read_markers(tmp_path / "nowhere.json")


def test_places_in_the_gel_are_those_of_the_sensors_own_pixels() -> None:
    file = measured()
    at = file.in_gel()
    # Pixel (row i, column j) has its centre at ((j + 0.5 - columns / 2), (i + 0.5 - rows / 2)) pitches.
    wanted = (file.places + 0.5 - 0.5 * np.array([COLUMNS, ROWS])) * GELSIGHT_R15.pitch
    assert at == pytest.approx(wanted)
    assert file.in_gel(2e-4) == pytest.approx(at * 2e-4 / GELSIGHT_R15.pitch)
    grid = file.grid()
    assert (grid.rows, grid.columns) == (HIGH, WIDE)
    assert grid.spacing == pytest.approx(STEP * GELSIGHT_R15.pitch)
    assert grid.radius == pytest.approx(RADIUS * GELSIGHT_R15.pitch)
    with pytest.raises(OutOfDomain, match="--spacing"):
        measured(None).in_gel()


def test_untouched_dots_are_drawn_where_they_were_measured_and_found_there_again() -> None:
    gel = known_gel(None, None).with_dots(measured())
    press = press_heights(np.zeros((ROWS, COLUMNS)), "object", gel, scene())
    found = find_dots(press.image)
    away, at = cKDTree(measured().places).query(found.places)
    assert len(found.places) == len(measured().dots)
    assert np.unique(at).size == len(found.places)
    # The drawing's edge is one pixel of straight slope, and grey levels are whole.
    assert np.max(away) < 0.05
    assert np.median(found.radius) == pytest.approx(RADIUS, abs=0.05)
    assert np.median(found.ink) == pytest.approx(0.3, abs=0.02)


def test_a_press_moves_them_by_what_is_computed() -> None:
    gel = known_gel(None, None).with_dots(measured())
    press = press_heights(ball(0.6e-3), "object", gel, scene())
    moved = press.evaluation.values["touch_marker_motion"][0]
    alone = marker_displacements(ball(0.6e-3)[None], gel.sensor, rest=measured().in_gel())[0]
    assert np.array_equal(moved, alone)
    away = measured().in_gel() - GELSIGHT_R15.pitch * (np.array([75.0, 62.0]) + 0.5 - (COLUMNS / 2, ROWS / 2))
    near = np.hypot(*away.T) < 4e-3
    outwards = np.sum(moved * away, axis=1)[near]
    assert np.mean(outwards > 0.0) > 0.9
    assert np.abs(moved).max() > 0.05 * GELSIGHT_R15.pitch


def test_the_sensors_own_grid_measured_is_the_sensors_own_grid() -> None:
    """A file of the dots that the description has changes neither picture nor motion."""
    own = replace(GELSIGHT_R15, markers=measured().grid())
    middle = 0.5 * np.array([COLUMNS, ROWS]) - 0.5
    places = rest_markers(own) / GELSIGHT_R15.pitch + middle
    dots = [
        MarkerDot(
            row=k // WIDE, column=k % WIDE, x_px=float(x), y_px=float(y), sigma_px=0.01, radius_px=RADIUS
        )
        for k, (x, y) in enumerate(places)
    ]
    file = measured().model_copy(update={"dots": dots, "ink": 0.15})
    plain = replace(known_gel(None, None), sensor=own)
    for depth in (0.0, 0.6e-3):
        pictures = [
            press_heights(ball(depth), "object", gel, scene()).image
            for gel in (plain, known_gel(None, None).with_dots(file))
        ]
        assert np.abs(pictures[0].astype(int) - pictures[1]).max() <= 1


def test_dots_of_another_picture_are_refused_and_so_are_dots_of_a_gel_of_which_nothing_is_known() -> None:
    other = measured().model_copy(update={"picture_rows": 240})
    gel = known_gel(None, None)
    with pytest.raises(DataRefused, match="240 x 160 pixels"):
        gel.with_dots(other)
    with pytest.raises(WrongUse, match="--reached"):
        press_heights(np.zeros((ROWS, COLUMNS)), "gel", gel.with_dots(measured()), scene())
