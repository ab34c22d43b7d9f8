"""``touchstone object render vision``: pictures in metres; what it says and refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import AnyArray
from harness.cli import invoke
from harness.picture.image_file import read_image
from harness.picture.srgb import linear_from_srgb
from tests.samples.look_bench import BOX, LOGITS, box_file, told_look

COLOUR = 1.0 / (1.0 + np.exp(-np.array(LOGITS)))


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Opaque and of one colour under any light."""
    return box_file(tmp_path_factory.mktemp("objects") / "box").folder


class Drawn:
    """A picture, its arrays, and what was said of it."""

    def __init__(self, said: dict[str, Any], image: AnyArray, depth: AnyArray, alpha: AnyArray) -> None:
        self.said, self.image, self.depth, self.alpha = said, image, depth, alpha


def draw(box: Path, folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> Drawn:
    files = [folder / name for name in ("a.png", "depth.npy", "alpha.npy")]
    out, depth, alpha = (str(file) for file in files)
    asked = ["--out", out, "--depth-out", depth, "--alpha-out", alpha, "--threads", "1", "--json", *more]
    assert invoke(["object", "render", "vision", str(box), *asked]) == 0
    return Drawn(json.loads(capsys.readouterr().out), read_image(files[0]), *map(np.load, files[1:]))


def test_a_picture_is_what_its_arrays_say(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = draw(box, tmp_path, capsys, "--size", "40x30")
    assert seen.image.shape == (30, 40, 3)
    assert seen.depth.shape == seen.alpha.shape == (30, 40)
    inside, outside = seen.alpha > 0.9999, seen.alpha == 0.0
    assert inside.any()
    assert (seen.image[outside] == 255).all()
    assert np.isinf(seen.depth[outside]).all()
    assert np.abs(linear_from_srgb(seen.image[inside] / 255.0) - COLOUR).max() < 0.01
    camera = np.array(seen.said["camera"]["object_from_camera"])
    away = np.linalg.norm(camera[:3, 3] - BOX.bounds.mean(axis=0))
    assert np.abs(seen.depth[inside] - away).max() < 0.5 * BOX.diagonal
    assert (seen.said["level"], seen.said["networks"]) == ("one_sample", "osf")
    assert set(seen.said["seconds"]) == {"load", "render"}
    assert seen.said["samples"] == seen.said["rays"] > 0
    assert seen.said["error_estimate"]["networks_measured"] == {"psnr_db_mean": 40.0}


def test_the_camera_that_nobody_chose_shows_all_of_the_object(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for size in ("24", "48x12", "12x48"):
        alpha = draw(box, tmp_path, capsys, "--size", size).alpha
        border = np.concatenate([alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]])
        assert (border == 0.0).all()
        assert alpha.max() > 0.99


def test_more_rays_in_a_pixel_change_nothing_of_one_colour(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, more = (draw(box, tmp_path, capsys, "--size", "24", "--rays", rays) for rays in ("1", "3"))
    assert more.image.shape == one.image.shape
    assert more.said["rays"] > 8 * one.said["rays"]
    inside = (one.alpha > 0.999) & (more.alpha > 0.999)
    assert np.abs(one.image.astype(int) - more.image)[inside].max() <= 1
    # Three sub-pixels along a pixel against nine.
    assert np.abs(one.alpha - more.alpha).max() < 0.25
    assert one.alpha.mean() == pytest.approx(more.alpha.mean(), rel=0.02)


def test_metres_are_metres(box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Twice as far is half as large, and depth says how far."""
    asked = ("--size", "96", "--field-of-view", "20deg")
    for away in (1.0, 2.0):
        seen = draw(box, tmp_path, capsys, "--camera", "0", str(-away), "0", *asked)
        # The front of the box is 0.1 by 0.06 m and lies 0.04 m before its middle.
        pixel = 2.0 * np.tan(np.radians(10.0)) * (away - 0.04) / 96
        # A side is known to a sub-pixel, a third of a pixel.
        off = pixel / 3.0 * (1.0 / 0.1 + 1.0 / 0.06)
        assert seen.alpha.sum() * pixel**2 == pytest.approx(0.1 * 0.06, rel=off)
        inside = seen.alpha > 0.9999
        assert np.median(seen.depth[inside]) == pytest.approx(away - 0.04, abs=2e-3)


def test_a_turntable_begins_with_the_picture_and_turns_the_object(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("--size", "40x32", "--camera", "0.2", "0", "0.05")
    one = draw(box, tmp_path, capsys, *asked)
    sheet = draw(box, tmp_path, capsys, *asked, "--turntable", "4")
    assert sheet.image.shape == (64, 80, 3)
    np.testing.assert_array_equal(sheet.image[:32, :40], one.image)
    assert sheet.alpha.shape == (4, 32, 40)
    # Half a turn later a box looks the same; a quarter shows its longer side.
    np.testing.assert_allclose(sheet.alpha[2], sheet.alpha[0], atol=0.12)
    wide, other = ((sheet.alpha[k].max(axis=0) > 0.0).sum() for k in (1, 0))
    assert wide > other + 2
    assert len(sheet.said["turntable"]["seconds_a_picture"]) == 4
    assert one.said["turntable"] is None
    assert sheet.said["samples"] > 3 * one.said["samples"]


def test_the_lamp_stays_with_the_room_when_the_object_turns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Lit from above: what is seen of the top stays white, and the sides in view from the front do not."""
    told = box_file(tmp_path / "told", told_look()).folder
    asked = ("--size", "24", "--camera", "0.2", "-0.2", "0.2", "--turntable", "3")
    lit = draw(told, tmp_path, capsys, *asked, "--light", "0", "0", "7")
    dark = draw(told, tmp_path, capsys, *asked, "--light", "0", "0", "-1e-3")
    assert lit.said["networks"] == "osf-v"
    assert lit.said["light"]["direction"] == [0.0, 0.0, 1.0]
    for k in range(3):
        inside = lit.alpha[k] > 0.9999
        i, j = divmod(k, 2)
        picture = lit.image[24 * i : 24 * i + 24, 24 * j : 24 * j + 24]
        assert picture[inside].max() >= 254
        assert picture[inside].min() < 30
        assert dark.image[24 * i : 24 * i + 24, 24 * j : 24 * j + 24][inside].max() < 30


@pytest.mark.parametrize("eye", [("0", "0", "0.4"), ("1e-6", "0", "-0.4"), ("25", "-25", "10")])
def test_views_along_the_axis_and_from_far_away(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], eye: tuple[str, str, str]
) -> None:
    seen = draw(box, tmp_path, capsys, "--camera", *eye, "--size", "16", "--field-of-view", "0.4deg")
    assert np.isfinite(seen.alpha).all()
    assert seen.alpha.max() > 0.99


def test_a_camera_that_looks_away_sees_nothing_and_says_so(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    away = ("--camera", "0", "-0.5", "0", "--look-at", "0", "-1", "0", "--size", "12x8")
    seen = draw(box, tmp_path, capsys, *away)
    assert (seen.image == 255).all()
    assert not seen.alpha.any()
    assert np.isinf(seen.depth).all()
    assert (seen.said["samples"], seen.said["covered_share"]) == (0, 0.0)


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (("--camera", "0", "0", "0.01"), 1, "within the object, whose box of 100 x 80 x 60 mm"),
        (("--camera", "0", "0", "nan"), 1, "give three finite numbers"),
        (("--camera", "0", "0", "0"), 1, "has no direction"),
        (("--camera", "0.3", "0", "0", "--up", "-1", "0", "0"), 1, "give another direction for up"),
        (("--light", "0", "0", "0"), 1, "the way to the light is zero"),
        (("--light", "inf", "0", "0"), 1, "give three finite numbers"),
        (("--size", "0"), 1, "a picture of 0 x 0 pixels"),
        (("--size", "4096x2048"), 1, "at most 4194304"),
        (("--size", "9000x1"), 1, "1 to 8192"),
        (("--size", "1024", "--rays", "3"), 1, "a picture of 1024 x 1024 pixels with 3 x 3 rays in each"),
        (("--rays", "9"), 2, "--rays"),
        (("--size", "big"), 2, "--size big is no number of pixels"),
        (("--size", "-5"), 2, "no number of pixels"),
        (("--level", "onnx"), 2, "--level was removed: there is one way to a picture"),
        (("--level=fused",), 2, "say --rays 2 for a finer picture"),
        (("--compare",), 2, "`touchstone cost vision` compares it with exact pictures"),
        (("--field-of-view", "180deg"), 1, "between 0 and 180 deg"),
        (("--field-of-view", "0deg"), 1, "between 0 and 180 deg"),
        (("--field-of-view", "40"), 2, "--field-of-view"),
        (("--turntable", "0"), 2, "--turntable 0"),
        (("--turntable", "5", "--size", "2048"), 2, "say 1 to 4 pictures"),
        (("--out", "a.jpg"), 2, "--out a.jpg would be a .png file"),
        (("--depth-out", "d.png"), 2, "--depth-out d.png would be a .npy file"),
        (("--depth-out", "d.npy", "--alpha-out", "d.npy"), 2, "are both d.npy"),
    ],
)
def test_what_cannot_be_drawn_is_refused_with_the_limit(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], code: int, said: str
) -> None:
    out = tmp_path / "a.png"
    assert invoke(["object", "render", "vision", str(box), "--out", str(out), "--json", *more]) == code
    caught = capsys.readouterr()
    assert said in caught.err
    assert json.loads(caught.out)["exit_code"] == code
    assert not out.exists()


def test_people_are_told_what_was_drawn(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["object", "render", "vision", str(box), "--out", str(tmp_path / "a.png"), "--size", "16x12"]
    assert invoke(asked) == 0
    said = capsys.readouterr().out
    for words in ("box from (", "16 x 12 pixels", "osf", "samples ", "load ", "a.png"):
        assert words in said
    assert invoke(["object", "info", str(box)]) == 0
    assert "osf: " in capsys.readouterr().out
