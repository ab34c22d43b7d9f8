"""``touchstone depth``: heights, errors and points of presses that were drawn, and of real ones."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.geometry import inverse
from harness.bench.sensor import GELSIGHT_R15, sensor_path
from harness.bench.station_file import load_station, station_path
from harness.cli import invoke
from harness.picture.image_file import write_png
from harness.picture.square_pixels import MADE_SQUARE, made_square
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.depth_reading import DepthReading, read_press
from harness.sim.optics.inverse import STEADY
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import TactileCalibration, save_calibration, shipped_calibration

NAME = "gelsight_r15_bench"
BALL, DEPTH = 8e-3, 0.5e-3
CENTRE = (70.0, 50.0)


@pytest.fixture(scope="module")
def known() -> TactileCalibration:
    return shipped_calibration(NAME)


@pytest.fixture(scope="module")
def surface() -> FloatArray:
    """``(rows, columns)`` metres: a shallow ball, so that no slope is beyond the calibration."""
    y, x = np.mgrid[:120, :160].astype(np.float64)
    away = GELSIGHT_R15.pitch * np.hypot(x - CENTRE[0], y - CENTRE[1])
    reached = np.sqrt(np.maximum(BALL**2 - away**2, 0.0)) - BALL + DEPTH
    return np.asarray(deform(np.maximum(reached, 0.0)[None], R15_SKIRT)[0])


@pytest.fixture(scope="module")
def picture(known: TactileCalibration, surface: FloatArray) -> ByteArray:
    return np.asarray(Optics(known, "smooth").render(surface[None]).images[0])


@pytest.fixture(scope="module")
def read(known: TactileCalibration, picture: ByteArray) -> DepthReading:
    return read_press(picture[None], known, STEADY)


def _answered(capsys: pytest.CaptureFixture[str], *words: str | Path, code: int = 0) -> dict[str, Any]:
    assert invoke(["depth", *map(str, words), "--json"]) == code
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def test_a_drawn_press_is_read_within_its_stated_error(read: DepthReading, surface: FloatArray) -> None:
    apart = (read.height - surface)[read.contact] / read.sigma[read.contact]
    assert (np.abs(apart) < 2.0).mean() > 0.9
    assert (read.sigma > 0.0).all()
    assert read.sigma[read.contact].min() > read.sigma[0, 0]


def test_points_are_where_the_gel_is_in_its_own_frame_and_in_the_tools(read: DepthReading) -> None:
    points = read.points()
    assert len(points) == read.contact.sum()
    top = points[np.argmin(points[:, 2])]
    pitch = GELSIGHT_R15.pitch
    middle = np.array([CENTRE[0] + 0.5 - 80.0, CENTRE[1] + 0.5 - 60.0]) * pitch
    assert top[:2] == pytest.approx(middle, abs=3.0 * pitch)
    assert (points[:, 2] <= 0.0).all()
    flange_from_gel = load_station(station_path("mock")).flange_from_gel
    moved = read.points(flange_from_gel)
    back = moved @ inverse(flange_from_gel)[:3, :3].T + inverse(flange_from_gel)[:3, 3]
    assert back == pytest.approx(points, abs=1e-12)


def test_the_command_writes_arrays_and_a_picture_and_answers(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, picture: ByteArray, read: DepthReading
) -> None:
    write_png(tmp_path / "press.png", picture)
    words = ("--calibration", NAME, "--out", tmp_path / "d.npz", "--picture", tmp_path / "d.png")
    answer = _answered(
        capsys, tmp_path / "press.png", *words, "--height-out", tmp_path / "h.npy", "--station", "mock"
    )
    assert answer["contact"]
    assert answer["frame"] == "flange"
    assert answer["deepest_m"] == pytest.approx(read.height.max(), rel=0.2)
    assert answer["deepest_sigma_m"] > 0.0
    assert not answer["flags"]["touches_border"]
    assert not answer["flags"]["not_anchored"]
    with np.load(tmp_path / "d.npz", allow_pickle=False) as kept:
        assert kept["points"].shape == (answer["contact_pixels"], 3)
        assert kept["points_sigma"].shape == (answer["contact_pixels"],)
        assert kept["sigma"].shape == kept["height"].shape == (120, 160)
        assert np.array_equal(np.load(tmp_path / "h.npy"), kept["height"])
    assert (tmp_path / "d.png").stat().st_size > 1000


LIGHT = Path(__file__).parents[3] / "samples/tactile_light"


@pytest.mark.parametrize("light", ["", "_dim", "_tv", "_ae2"])
def test_figures_are_answered_without_a_file_and_right_in_every_light(
    capsys: pytest.CaptureFixture[str], light: str
) -> None:
    press, rest = (LIGHT / f"{name}{light}.png" for name in ("press", "rest"))
    answer = _answered(capsys, press, "--background", rest, "--calibration", NAME)
    assert answer["deepest_m"] == pytest.approx(0.599e-3, abs=0.05e-3)
    assert answer["deepest_sigma_m"] < 0.05e-3
    assert answer["out"] is None
    assert answer["sensor"]["gel_thickness_m"] == GELSIGHT_R15.gel_thickness
    if not light:
        assert invoke(["depth", str(press), "--background", str(rest), "--calibration", NAME]) == 0
        assert "mm at the deepest" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("press", "rest", "reason"),
    [
        ("press_bgr", "rest_bgr", "channels blue, green, red"),
        ("press_bgr", "rest", "channels blue, green, red"),
        ("press_half", "rest", "part of the frame was lost"),
        ("black", "rest", "lights are off"),
        ("press", "black", "lights are off"),
    ],
)
def test_pictures_in_no_light_or_another_channel_order_are_refused(
    capsys: pytest.CaptureFixture[str], press: str, rest: str, reason: str
) -> None:
    words = (LIGHT / f"{press}.png", "--background", LIGHT / f"{rest}.png", "--calibration", NAME)
    assert reason in _answered(capsys, *words, code=1)["error"]


def test_a_press_without_its_own_resting_picture_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    answer = _answered(capsys, LIGHT / "press_ae2.png", "--calibration", NAME)
    assert answer["deepest_m"] == pytest.approx(0.599e-3, abs=0.05e-3)
    assert any("--background" in note for note in answer["notes"])


def test_the_thickness_is_that_of_the_sensor_and_not_of_one_with_the_same_pixels(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, known: TactileCalibration
) -> None:
    words = (LIGHT / "press.png", "--background", LIGHT / "rest.png", "--calibration", tmp_path / "c.npz")
    save_calibration(replace(known, header=replace(known.header, sensor="of my own")), tmp_path / "c.npz")
    answer = _answered(capsys, *words)
    assert answer["sensor"] is None
    assert any("give --sensor" in note for note in answer["notes"])
    text = sensor_path("gelsight-r1.5").read_text()
    thin = tmp_path / "thin.toml"
    thin.write_text(text.replace('"2.5 mm"', '"0.6 mm"'))
    assert "0.60 mm" in _answered(capsys, *words, "--sensor", thin, code=1)["error"]
    other = _answered(capsys, *words, "--sensor", "gelsight-mini")
    assert other["sensor"]["name"] == "GelSight Mini"


def test_a_calibration_of_another_shipped_sensor_is_noted(capsys: pytest.CaptureFixture[str]) -> None:
    words = (LIGHT / "press.png", "--background", LIGHT / "rest.png", "--calibration", NAME, "--sensor")
    note = "--sensor is 'GelSight Mini', "
    assert any(note in each for each in _answered(capsys, *words, "gelsight-mini")["notes"])
    assert not any("--sensor is" in each for each in _answered(capsys, *words, "gelsight-r1.5")["notes"])


def test_frames_of_two_presses_are_refused_and_one_press_in_two_lights_is_read(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("--background", LIGHT / "rest.png", "--calibration", NAME)
    error = _answered(capsys, LIGHT / "press.png", LIGHT / "rest.png", *words, code=1)["error"]
    assert "frame 2 of 2" in error
    answer = _answered(capsys, LIGHT / "press.png", LIGHT / "press_dim.png", *words)
    assert answer["deepest_m"] == pytest.approx(0.599e-3, abs=0.05e-3)


def test_a_missing_output_folder_is_named_before_the_pictures_are_read(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for option, name in (("--out", "d.npz"), ("--picture", "d.png"), ("--height-out", "h.npy")):
        words = (tmp_path / "nosuch.png", "--calibration", NAME, option, tmp_path / "none" / name)
        assert str(tmp_path / "none") in _answered(capsys, *words, code=2)["error"]


def test_the_untouched_gel_is_no_contact(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, known: TactileCalibration
) -> None:
    write_png(tmp_path / "rest.png", known.background)
    words = ("--background", tmp_path / "rest.png", "--calibration", NAME, "--out", tmp_path / "d.npz")
    answer = _answered(capsys, tmp_path / "rest.png", *words)
    assert answer["flags"]["no_contact"]
    assert answer["deepest_m"] == 0.0
    assert answer["deepest_point_m"] is None
    with np.load(tmp_path / "d.npz", allow_pickle=False) as kept:
        assert kept["points"].shape == (0, 3)


def test_pictures_of_high_pixels_are_made_square_as_the_presses_were(
    known: TactileCalibration, picture: ByteArray, read: DepthReading
) -> None:
    high = 1.05
    header = replace(known.header, made_from=known.header.made_from + f", {MADE_SQUARE} {high:.6f}")
    squared = replace(known, header=header)
    seen = made_square(picture, 1.0 / high)
    rest = made_square(known.background, 1.0 / high)
    again = read_press(seen[None], squared, STEADY, rest)
    assert again.aspect == pytest.approx(high)
    # Two splines there and back blur by a part of a pixel.
    assert np.abs(again.height - read.height).max() < 0.1 * DEPTH
    wrong = read_press(seen[None], known, STEADY, rest)
    assert np.abs(wrong.height - read.height).max() > 2.0 * np.abs(again.height - read.height).max()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--out", "d.txt", "--calibration", NAME), "end in .npz"),
        (("--out", "d.npz"), "--calibration FILE"),
        (("--out", "d.npz", "--calibration", "no_such"), "no shipped calibration"),
        (("--sensor", "no_such", "--calibration", NAME), "no sensor 'no_such'"),
    ],
)
def test_what_is_missing_is_said(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    picture: ByteArray,
    words: tuple[str, ...],
    sentence: str,
) -> None:
    write_png(tmp_path / "press.png", picture)
    assert invoke(["depth", str(tmp_path / "press.png"), *words, "--json"]) in (1, 2)
    assert sentence in json.loads(capsys.readouterr().out)["error"]


def test_a_picture_of_another_camera_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, known: TactileCalibration
) -> None:
    write_png(tmp_path / "press.png", np.zeros((60, 80, 3), np.uint8))
    save_calibration(known, tmp_path / "c.npz")
    words = ("--calibration", tmp_path / "c.npz", "--out", tmp_path / "d.npz")
    assert "8-bit" in _answered(capsys, tmp_path / "press.png", *words, code=1)["error"]
