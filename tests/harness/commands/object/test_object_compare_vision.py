"""``touchstone object compare vision``: exposures found as they were made; what it says and refuses."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.arrays import FloatArray
from harness.cli import invoke
from harness.objectfile.vision.render import open_vision
from harness.objectfile.vision.view import camera_for, light_for
from harness.picture.image_file import read_image, write_png
from harness.picture.linear_image import LinearImage
from harness.picture.srgb import bytes_from_linear
from tests.oracles.plain_look import patchy_look
from tests.samples.exposed_pictures import BENCH, GAIN, OFFSET
from tests.samples.look_bench import BOX, OPAQUE, box_file

EYE = (0.3, -0.25, 0.2)
CAMERA = ("--camera", *map(str, EYE))
LIGHT = ("--light", "1", "-1", "2")
WIDTH, HEIGHT = 160, 120


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Opaque, and of another colour in every cell."""
    look = patchy_look(surface_cells(BOX, 8), OPAQUE)
    return box_file(tmp_path_factory.mktemp("objects") / "box", look).folder


@pytest.fixture(scope="module")
def image(box: Path) -> LinearImage:
    """Of the camera above, as the command draws it."""
    from harness.objectfile.file import ObjectFile

    vision = open_vision(ObjectFile.open(box), 1)
    camera = camera_for(vision.surface, WIDTH, HEIGHT, EYE)
    return vision.picture(camera, light_for(camera)).image


def photographed(image: LinearImage, path: Path, moved: int = 0, gain: FloatArray = GAIN) -> Path:
    """By a camera of known gains and some noise; the object so many pixels to the right."""
    colour, alpha = (np.roll(each, moved, axis=1) for each in (image.colour, image.alpha))
    light = gain * colour + OFFSET * alpha[..., None] + (1.0 - alpha)[..., None] * BENCH
    write_png(path, bytes_from_linear(light + np.random.default_rng(0).normal(0.0, 0.004, light.shape)))
    return path


def compare(box: Path, live: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, Any]:
    asked = [
        "--live",
        str(live),
        *CAMERA,
        "--out",
        str(live.parent / "sheet.png"),
        "--threads",
        "1",
        "--json",
    ]
    assert invoke(["object", "compare", "vision", str(box), *asked, *more]) == 0
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    return said


def test_an_exposure_is_found_as_it_was_made(
    box: Path, image: LinearImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = LinearImage(0.0 * image.colour, 0.0 * image.alpha, image.depth)
    bench = photographed(empty, tmp_path / "bench.png")
    said = compare(box, photographed(image, tmp_path / "a.png"), capsys, "--background", str(bench))
    fit = said["exposure"]
    off = np.abs(np.array(fit["gain"]) - GAIN)
    assert (off < 4.0 * np.array(fit["gain_error"]) + 1.0 / 255.0).all()
    assert np.abs(np.array(fit["offset"]) - OFFSET).max() < 2.0 / 255.0
    np.testing.assert_allclose(fit["white_balance"], GAIN / GAIN[1], atol=0.01)
    assert said["mask"]["by"] == "background"
    # Within half a pixel along the outline, which is 190 pixels long around 2,613.
    assert said["mask"]["overlap"] > 1.0 - 0.5 * 190 / 2613
    assert said["difference"]["psnr_db"] > 36.0
    assert said["difference"]["psnr_db"] > said["difference_before_fit"]["psnr_db"] + 10.0
    assert (said["rows"], said["columns"], said["light_assumed"]) == (HEIGHT, WIDTH, True)
    assert set(said["seconds"]) == {"load", "live", "render", "fit", "mask", "difference", "draw"}
    sheet = cv2.imread(said["image"])
    assert sheet is not None
    assert sheet.shape[1] > 2 * sheet.shape[0]
    assert sheet.std() > 5.0


def test_what_is_wrong_shows_in_the_difference(
    box: Path, image: LinearImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In its place, then in another."""
    right = photographed(image, tmp_path / "right.png")
    said = compare(box, right, capsys)
    wrong = compare(box, photographed(image, tmp_path / "moved.png", 12), capsys, "--fit", "gain")
    assert wrong["difference"]["psnr_db"] < said["difference"]["psnr_db"] - 10.0
    assert wrong["mask"]["overlap"] < said["mask"]["overlap"] - 0.1
    assert wrong["exposure"]["offset"] == [0.0, 0.0, 0.0]


def test_people_are_told_what_differs(
    box: Path, image: LinearImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    live = photographed(image, tmp_path / "a.png")
    asked = ["--live", str(live), *CAMERA, *LIGHT, "--out", str(tmp_path / "s.png"), "--fit", "none"]
    assert invoke(["object", "compare", "vision", str(box), *asked]) == 0
    said = capsys.readouterr().out
    for words in (
        "box from (300, -250, 200) mm, 160 x 120",
        "over the object: ",
        "red: gain 1.0000",
        "s.png",
    ):
        assert words in said


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (("--camera", "0", "0", "0.01"), 1, "within the object"),
        (("--camera", "3", "0", "0"), 1, "are needed to fit an exposure"),
        ((*CAMERA, "--look-at", "1", "-1", "0"), 1, "covers 0 whole pixels"),
        ((*CAMERA, "--light", "0", "0", "0"), 1, "the way to the light is zero"),
        ((*CAMERA, "--fit", "offset"), 2, "did you mean 'gain-offset'?"),
        ((*CAMERA, "--level", "fused"), 2, "--level was removed"),
        ((*CAMERA, "--station", "mock", "--scene", "s.toml"), 2, "are of a camera without a station"),
        (("--station", "mock"), 2, "needs --scene FILE"),
        ((*CAMERA, "--scene", "s.toml"), 2, "say which with --station NAME"),
        ((), 2, "--live IMAGE with --camera X Y Z"),
        ((*CAMERA, "--background", "none.png"), 2, "none.png cannot be read"),
    ],
)
def test_what_cannot_be_compared_is_refused(
    box: Path,
    image: LinearImage,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...],
    code: int,
    said: str,
) -> None:
    live, out = photographed(image, tmp_path / "a.png"), tmp_path / "s.png"
    asked = ["--live", str(live), "--out", str(out), "--json", *more]
    assert invoke(["object", "compare", "vision", str(box), *asked]) == code
    caught = capsys.readouterr()
    assert said in caught.err
    assert json.loads(caught.out)["exit_code"] == code
    assert not out.exists()


def test_pictures_that_say_nothing_are_refused(
    box: Path, image: LinearImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    white = tmp_path / "white.png"
    write_png(white, np.full((HEIGHT, WIDTH, 3), 255, np.uint8))
    half = tmp_path / "half.png"
    write_png(half, read_image(photographed(image, tmp_path / "a.png"))[:60])
    asked = ["object", "compare", "vision", str(box), *CAMERA, "--out", str(tmp_path / "s.png")]
    for more, code, said in (
        (("--live", str(white)), 1, "are saturated"),
        (("--live", str(tmp_path / "a.png"), "--background", str(half)), 1, "take all by one camera"),
        (("--live", str(tmp_path / "no.png")), 2, "cannot be read"),
    ):
        assert invoke([*asked, *more]) == code
        assert said in capsys.readouterr().err


def test_a_station_needs_the_object_of_its_scene(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('schema = 1\n[object]\nmesh = "builtin:mug"\nmaterial = "ceramic"\n', encoding="utf-8")
    asked = ["--station", "mock", "--scene", str(scene), "--out", str(tmp_path / "s.png")]
    assert invoke(["object", "compare", "vision", str(box), *asked]) == 2
    assert " mm" in capsys.readouterr().err
