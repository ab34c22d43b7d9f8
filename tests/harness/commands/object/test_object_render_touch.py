"""``touchstone object render touch``: what it draws, says and refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from harness.cli import invoke
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.touch import open_touch
from harness.picture.image_file import read_image
from harness.sim.gel.press_pose import Presses
from tests.samples import touch_bench as tb
from tests.samples.object_bench import egg_file
from tests.support.touch_command import answered

PLACE = ("--contact", "0.0101", "0.0203", "0.0502")
POSE = ("--depth", "1.2mm", "--tilt", "6deg", "--azimuth", "50deg", "--yaw", "30deg")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tb.ball_file(tmp_path_factory.mktemp("render") / "ball").folder


def rendered(
    folder: Path, out: Path, capsys: pytest.CaptureFixture[str], *more: str, code: int = 0
) -> dict[str, Any]:
    named = [] if "--out" in more else ["--out", str(out / "a.png")]
    assert invoke(["object", "render", "touch", str(folder), *more, *named, "--json"]) == code
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


@pytest.mark.parametrize("level", ["codes", "reference"])
def test_the_picture_is_of_the_level_s_own_map(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], level: Any
) -> None:
    heights = tmp_path / "h.npy"
    answer = rendered(folder, tmp_path, capsys, *PLACE, *POSE, "--level", level, "--height-out", str(heights))
    angles = (answer[f"{name}_rad"] for name in ("tilt", "azimuth", "yaw"))
    asked = Presses.one(np.array(answer["point_m"]), np.array(answer["normal"]), answer["depth_m"], *angles)
    truth = open_touch(ObjectFile.open(folder), level).at(asked)[0]
    np.testing.assert_array_equal(np.load(heights), truth)
    assert answer["deepest_m"] == truth.max()
    assert answer["level"] == level
    again = answered(
        capsys, tmp_path, "--height", heights, "--heights-of", "gel", "--out", str(tmp_path / "b.png")
    )
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert answer["contact_pixels"] == again["contact_pixels"]
    stages = {"load", "render"} | ({"reference"} if level == "codes" else set())
    assert set(answer["seconds"]) == stages
    assert all(seconds > 0.0 for seconds in answer["seconds"].values())


FORCE = ("--force", "--gel-modulus", "0.2MPa", "--gel-modulus-error", "10%")


def test_the_force_is_that_of_the_gel_that_is_drawn(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heights = tmp_path / "h.npy"
    answer = rendered(folder, tmp_path, capsys, *PLACE, *POSE, *FORCE, "--height-out", str(heights))
    truth = rendered(folder, tmp_path, capsys, *PLACE, *POSE, *FORCE, "--level", "reference")
    again = answered(capsys, tmp_path, "--height", heights, "--heights-of", "gel", *FORCE)
    assert answer["force_n"] == again["force_n"]
    assert answer["force"] == again["force"]
    assert answer["error_estimate"]["from_mesh"]["force_n"] == answer["force_n"] - truth["force_n"]
    assert 0.1 < answer["force_n"] == pytest.approx(truth["force_n"], rel=0.02)


def test_no_force_is_computed_that_nobody_asked_for(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = rendered(folder, tmp_path, capsys, *PLACE, *POSE)
    assert answer["force_n"] is answer["force"] is answer["error_estimate"]["from_mesh"]["force_n"] is None
    refused = rendered(folder, tmp_path, capsys, *PLACE, "--gel-poisson", "0.4", code=2)
    assert "add --force" in str(refused)


def test_the_error_estimate_is_the_distance_to_the_rasteriser(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = [tmp_path / f"{level}.npy" for level in ("codes", "reference")]
    answers = [
        rendered(
            folder, tmp_path, capsys, *PLACE, *POSE, "--level", each.stem, "--height-out", str(each),
            "--out", str(each.with_suffix(".png")),
        )
        for each in kept
    ]  # fmt: skip
    found = answers[0]["error_estimate"]["from_mesh"]
    apart = np.abs(np.load(kept[0]) - np.load(kept[1]))
    assert found["rms_m"] == pytest.approx(np.sqrt((apart**2).mean()), rel=1e-12)
    assert found["most_m"] == apart.max()
    assert 0.0 < found["rms_m"] <= found["p99_m"] <= found["most_m"] < 1e-4
    images = [read_image(each.with_suffix(".png")).astype(float) for each in kept]
    assert found["image_rms_grey"] == pytest.approx(np.sqrt(((images[0] - images[1]) ** 2).mean()))
    assert answers[0]["error_estimate"]["maps_measured"] == {"psnr_db": 50.0}
    assert answers[1]["error_estimate"]["from_mesh"] is None
    assert answers[1]["error_estimate"]["maps_measured"] == {}


def test_sim_touch_draws_the_same_press_from_the_same_codes(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rendered(folder, tmp_path, capsys, *PLACE, *POSE)
    mesh = folder / "mesh.ply"
    codes = ("--objectfile", folder, "--level", "touch.shapes=network")
    given = (mesh, *PLACE, *POSE, "--units", "m", "--out", tmp_path / "b.png")
    answer = answered(capsys, tmp_path, *given, *codes)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    alone = (folder, *PLACE, *POSE, "--out", tmp_path / "c.png", "--level", "touch.shapes=network")
    answered(capsys, tmp_path, *alone)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "c.png").read_bytes()
    assert answer["levels"]["touch.shapes"] == "network"
    assert answer["error_estimate"]["maps_measured"] == {"psnr_db": 50.0}
    ran = {step["effect"] for step in answer["effects"]["ran"]}
    assert "object.touch_codes" in ran
    assert not ran & {"touch.height_map", "object.raster", "contact.presses"}
    unasked = answered(capsys, tmp_path, *given, "--objectfile", folder)
    assert unasked["error_estimate"]["maps_measured"] is None
    assert "object.touch_codes" not in {step["effect"] for step in unasked["effects"]["ran"]}
    refused = answered(capsys, tmp_path, *given, "--level", "touch.shapes=network", code=2)
    assert "ObjectFile" in refused["error"]


def test_a_picture_of_level_rasteriser_and_difference(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sizes = []
    for level in ("codes", "reference"):
        path = tmp_path / f"{level}.png"
        more = ("--level", level, "--picture", str(path))
        answer = rendered(folder, tmp_path, capsys, *PLACE, *more)
        assert answer["picture"] == str(path)
        assert answer["seconds"]["picture"] > 0.0
        sizes.append(imread(path).shape[0])
    assert sizes[0] > 1.5 * sizes[1]


def test_for_people_it_says_level_place_and_distance(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["object", "render", "touch", str(folder), *PLACE, "--out", str(tmp_path / "a.png")]
    assert invoke(arguments) == 0
    said = capsys.readouterr().out
    assert "ball pressed at" in said
    assert "rasteriser" in said
    assert invoke([*arguments, "--level", "reference"]) == 0
    assert "rasteriser" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (
            (*PLACE, "--depth", "2.6mm"),
            1,
            "2.6 mm deep was asked of the touch's codes, which knows 0 to 2.5 mm",
        ),
        ((*PLACE, "--depth", "-0.1mm"), 1, "which knows 0 to 2.5 mm"),
        (
            (*PLACE, "--tilt", "30deg"),
            1,
            "a tilt of 30 deg was asked of the touch's codes, which knows 0 to 26 deg",
        ),
        (("--contact", "0.01", "0.02", "0.06"), 1, "10 mm off the surface; the limit is 2 mm"),
        ((*PLACE, "--level", "fine"), 2, "--level takes codes, or reference"),
        (
            (*PLACE, "--level", "perceptron"),
            2,
            "no longer has the level 'perceptron'; take --level codes",
        ),
        ((*PLACE, "--depth", "1"), 2, "--depth"),
        ((*PLACE, "--out", "a.jpg"), 2, "--out a.jpg would be a .png file"),
        ((*PLACE, "--picture", "a.jpg"), 2, "--picture a.jpg would be a .png file"),
    ],
    ids=["deep", "shallow", "tilt", "place", "level", "perceptron", "unit", "out", "picture"],
)
def test_what_cannot_be_rendered_is_one_sentence(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...],
    code: int,
    said: str,
) -> None:
    assert said in rendered(folder, tmp_path, capsys, *more, code=code)["error"]
    assert not (tmp_path / "a.png").exists()


def test_an_object_without_a_touch_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    egg = egg_file(tmp_path / "egg").folder
    error = rendered(egg, tmp_path, capsys, "--contact", "0", "0", "0.1", code=1)["error"]
    assert "`touchstone object build --only touch`" in error


def test_a_place_at_which_another_part_reaches_through_the_gel_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Inside the mug the sensor's window meets the opposite wall."""
    out = tmp_path / "press.png"
    words = ["object", "render", "touch", "mug", "--vertex", "3000", "--depth", "2mm", "--out", str(out)]
    assert invoke(words) == 1
    assert "2.5 mm" in capsys.readouterr().err
    assert not out.exists()
