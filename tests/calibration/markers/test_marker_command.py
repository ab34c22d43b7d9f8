"""``touchstone calibrate markers``: from pictures to file, answer and page; real dots beside drawn ones."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from calibration.markers.at_rest import lay_lattice
from calibration.markers.dots import find_dots
from harness.cli import invoke
from harness.picture.image_file import read_image, write_png
from harness.sim.gel.markers import read_markers
from tests.samples.drawn_dots import DrawnDots

UNMARKED = (
    "fots_ball_presses/gelsight_bg.png",
    "fots_ball_presses/gelsight/0001.png",
    "gelsight_mini/background.png",
    "digit_background/bg_digit_240_320.jpg",
    "9dtact/sensor_1/camera_ref.png",
)

DRAWN = DrawnDots(turned=0.015, barrel=3.0)


def run(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, object]]:
    code = invoke(["calibrate", "markers", *arguments, "--json"])
    answer: dict[str, object] = json.loads(capsys.readouterr().out)
    return code, answer


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "rest"
    place.mkdir()
    for seed in range(2):
        write_png(place / f"{seed}.png", DRAWN.picture(seed=seed))
    return place


def test_a_folder_becomes_a_file_an_answer_and_a_page(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, page = folder / "dots.json", folder / "page"
    code, answer = run([str(folder), "--spacing", "1.5mm", "--out", str(out), "--report", str(page)], capsys)
    assert code == 0
    assert (answer["dots"], answer["rows"], answer["columns"]) == (70, 7, 10)
    assert answer["missing"] == answer["misprinted"] == []
    file = read_markers(out)
    away, _ = cKDTree(DRAWN.places()).query(file.places)
    assert np.max(away) < 0.05
    assert file.pitch_m == answer["pitch_m"]
    assert "2 pictures" in file.made_from
    text = Path(str(answer["report"])).read_text(encoding="utf-8")
    assert text.count("<tr>") > 70
    assert (page / "found.png").is_file()
    assert (page / "off.png").is_file()


def test_with_a_pitch_the_spacing_is_known_and_with_neither_nothing_is_claimed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = str(folder / "0.png")
    _, known = run([picture, "--pitch", "0.05mm", "--out", str(tmp_path / "a.json")], capsys)
    assert known["spacing_m"] == pytest.approx(0.05e-3 * float(str(known["spacing_px"])))
    assert known["wander_px"] is None
    _, unknown = run([picture, "--out", str(tmp_path / "b.json")], capsys)
    assert unknown["pitch_m"] is unknown["spacing_m"] is unknown["scale"] is None


def test_wrong_use_and_nothing_to_read_are_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, answer = run([str(folder / "0.png"), "--pitch", "-1mm"], capsys)
    assert (code, "--pitch" in str(answer["error"])) == (2, True)
    (tmp_path / "empty").mkdir()
    code, answer = run([str(tmp_path / "empty")], capsys)
    assert code == 1
    assert "empty" in str(answer["error"])


def test_measured_dots_are_drawn_by_the_simulator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """End to end at the paper's own resolution: picture, calibration, and a drawing with the same dots."""
    small = DrawnDots(spacing=32.0, radius=7.0, wide=9, high=7, turned=0.02)
    picture = cv2.resize(small.picture(), (160, 120), interpolation=cv2.INTER_AREA)
    write_png(tmp_path / "rest.png", np.asarray(picture, dtype=np.uint8))
    np.save(tmp_path / "flat.npy", np.zeros((120, 160)))
    dots, drawn = tmp_path / "dots.json", tmp_path / "drawn.png"
    code, _ = run([str(tmp_path / "rest.png"), "--pitch", "0.1245mm", "--out", str(dots)], capsys)
    assert code == 0
    flat = ["--height", str(tmp_path / "flat.npy"), "--markers", str(dots), "--out", str(drawn), "--json"]
    assert invoke(["sim", "touch", *flat]) == 0
    found = find_dots(read_image(drawn)).places
    away, _ = cKDTree(read_markers(dots).places).query(found)
    assert np.size(away) == 63
    assert np.max(away) < 0.06


@pytest.mark.parametrize("number", [0, 1])
def test_real_dots_lie_where_they_were_published_to_be(shared_data: Path, number: int) -> None:
    """Tracked dots in whole pixels, cut off, not rounded: half a pixel lies between, and a scatter of 0.3."""
    folder = shared_data / "tactile/fots_markers"
    dots = find_dots(read_image(folder / f"{number}.png"))
    rows = np.genfromtxt(folder / f"{number}.csv", delimiter=",", names=True)
    published = np.column_stack([rows["Mx"] + rows["dx"], rows["My"] + rows["dy"]]) + 0.5
    away, at = cKDTree(published).query(dots.places)
    off = dots.places - published[at]
    assert np.abs(np.median(off, axis=0)).max() < 0.3
    assert np.median(away) < 0.7
    lattice = lay_lattice(dots.places)
    assert (lattice.columns, lattice.rows) == (10, 9)
    assert lattice.on.all()


def test_real_pictures_of_a_touched_gel_are_refused_and_of_gels_without_dots(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tactile, out = shared_data / "tactile", ["--out", str(tmp_path / "x.json")]
    for number in (0, 1):
        code, answer = run([str(tactile / f"fots_markers/{number}.png"), *out], capsys)
        assert code == 1
        assert " 6%" in str(answer["error"])
    for plain in UNMARKED:
        code, answer = run([str(tactile / plain), *out], capsys)
        assert code == 1
        assert "15 %" in str(answer["error"])
    assert not (tmp_path / "x.json").exists()
