"""``touchstone sim touch``: what it draws, says and refuses."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.cli import invoke
from harness.effects.evaluate import evaluate
from harness.effects.explain import scene_plan
from harness.effects.quantities import Quantities
from harness.picture.image_file import read_image, write_png
from harness.picture.image_metrics import psnr
from harness.sim.optics.tactile_calibration import shipped_calibration
from harness.sim.solid.intake import take_in
from tests.support.touch_command import answered, bump, saved

BENCH = shipped_calibration("gelsight_r15_bench")


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball of 20 mm radius, in millimetres."""
    path = tmp_path_factory.mktemp("ball") / "ball.ply"
    trimesh.creation.icosphere(subdivisions=5, radius=20.0).export(path)
    return path


@pytest.mark.slow  # as a mesh clear of the gel
def test_a_map_without_contact_is_the_untouched_gel_byte_for_byte(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, np.zeros((120, 160))))
    write_png(tmp_path / "background.png", BENCH.background)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "background.png").read_bytes()
    assert (answer["contact"], answer["contact_pixels"], answer["deepest_m"]) == (False, 0, 0.0)
    assert answer["flags"]["no_contact"] is True
    assert "no contact: the picture is the untouched gel's" in answer["notes"]
    assert (
        invoke(["sim", "touch", "--height", str(tmp_path / "h.npy"), "--out", str(tmp_path / "a.png")]) == 0
    )
    assert "no contact" in capsys.readouterr().out


def test_a_mesh_clear_of_the_gel_is_the_untouched_gel_too(
    ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pose = ("--contact", "0", "0", "0.02", "--depth", "-0.5mm", "--units", "mm")
    answer = answered(capsys, tmp_path, ball, *pose)
    assert answer["flags"]["no_contact"] is True
    assert np.array_equal(read_image(tmp_path / "a.png"), BENCH.background)


def test_a_mesh_is_drawn_as_the_catalogue_draws_it(
    ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pose = ("--contact", "0.001", "-0.002", "0.0199", "--depth", "0.8mm", "--tilt", "6deg", "--yaw", "40deg")
    answer = answered(capsys, tmp_path, ball, *pose, "--units", "mm", "--height-out", tmp_path / "h.npy")
    mesh = take_in(ball, "mm").mesh
    given: Quantities = {
        "object_mesh": mesh,
        "contact_gel_from_object": np.array(answer["gel_from_object"])[None],
        "sensor": GELSIGHT_R15,
        "sensor_calibration": BENCH,
    }
    directly = evaluate(scene_plan(scene_from_options("builtin:mug"), GELSIGHT_R15), given)
    assert np.array_equal(read_image(tmp_path / "a.png"), directly.values["touch_image"][0])
    assert np.array_equal(np.load(tmp_path / "h.npy"), directly.values["touch_height_map"][0])
    assert answer["contact_pixels"] == int((directly.values["touch_height_map"] > 0.0).sum())
    ran = {step["effect"] for step in answer["effects"]["ran"]}
    assert ran <= set(answer["seconds"])
    assert not {name for name in ran if name.startswith(("object.modes", "room", "touch.shadow", "arm"))}
    shapes = {"touch.shapes": "reference"}
    assert answer["levels"] == {
        "touch.supersampling": 1, **shapes, "touch.gel": "exact", "touch.optics": "fast"
    }  # fmt: skip
    assert answer["error_estimate"]["held_out_db"] == pytest.approx(BENCH.header.held_out_db)
    again = answered(capsys, tmp_path, "--height", tmp_path / "h.npy", "--out", tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert again["deepest_m"] == answer["deepest_m"]


@pytest.mark.parametrize("depth", [0.3, 0.7, 1.2])
def test_depth_in_is_deepest_out(
    ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], depth: float
) -> None:
    pose = ("--contact", "0", "0", "0.02", "--depth", f"{depth}mm", "--units", "mm")
    answer = answered(capsys, tmp_path, ball, *pose)
    # The nearest pixel is 0.09 mm beside the pole, and the ball has faces.
    assert answer["deepest_m"] == pytest.approx(depth * 1e-3, abs=2e-6)
    assert answer["depth_m"] == depth * 1e-3
    assert answer["contact_area_m2"] == pytest.approx(np.pi * 2 * 0.02 * depth * 1e-3, rel=0.06)


def test_half_a_turn_of_the_sensor_turns_the_height_map(
    ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    maps = []
    for yaw in ("25deg", "205deg"):
        pose = ("--contact", "0", "0", "0.02", "--tilt", "9deg", "--yaw", yaw, "--units", "mm")
        answered(capsys, tmp_path, ball, *pose, "--height-out", tmp_path / "h.npy")
        maps.append(np.load(tmp_path / "h.npy"))
    assert maps[1][::-1, ::-1] == pytest.approx(maps[0], abs=1e-9)
    assert np.abs(maps[1] - maps[0]).max() > 1e-4


def test_a_live_picture_is_compared_beside_the_background(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heights = saved(tmp_path, bump(1e-3))
    answered(capsys, tmp_path, "--height", heights)
    simulated = read_image(tmp_path / "a.png")
    live = np.clip(simulated.astype(int) + 3, 0, 255).astype(np.uint8)
    write_png(tmp_path / "live.png", live)
    words = ("--height", heights, "--live", tmp_path / "live.png", "--picture", tmp_path / "p.png")
    compared = answered(capsys, tmp_path, *words)["live"]
    touched = bump(1e-3) > 0.0
    for name, drawn in (("simulated", simulated), ("background", BENCH.background)):
        assert compared[name]["psnr_db"] == pytest.approx(psnr(live, drawn))
        assert compared[name]["psnr_contact_db"] == pytest.approx(psnr(live, drawn, touched))
    assert compared["background"]["psnr_contact_db"] < 25.0 < compared["simulated"]["psnr_contact_db"]
    assert read_image_rgba(tmp_path / "p.png")[0] > 600
    same = answered(capsys, tmp_path, "--height", heights, "--live", tmp_path / "a.png")["live"]["simulated"]
    assert same == {"psnr_db": None, "psnr_contact_db": None, "identical": True}
    assert invoke(["sim", "touch", *map(str, words), "--out", str(tmp_path / "a.png")]) == 0
    shown = capsys.readouterr().out
    assert "live against simulated" in shown
    assert "live against background" in shown


def read_image_rgba(path: Path) -> tuple[int, ...]:
    from matplotlib.image import imread

    return tuple(imread(path).shape)


@pytest.mark.parametrize("level", ["touch.optics=exact", "touch.optics=smooth", "touch.gel=fast"])
def test_levels_are_taken_and_said(tmp_path: Path, capsys: pytest.CaptureFixture[str], level: str) -> None:
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, bump(1e-3)), "--level", level)
    name, _, value = level.partition("=")
    assert answer["levels"][name] == value


def test_noise_is_the_seeds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heights = saved(tmp_path, bump(1e-3))
    seen = []
    for seed in ("4", "4", "5"):
        answered(capsys, tmp_path, "--height", heights, "--noise", "2", "--seed", seed)
        seen.append((tmp_path / "a.png").read_bytes())
    assert seen[0] == seen[1] != seen[2]


@pytest.mark.parametrize("of", ["object", "gel"])
def test_heights_that_are_missing_are_masked_counted_and_handed_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], of: str
) -> None:
    holed = bump(1e-3)
    holed[58:61, 78:80], holed[0, 0] = np.nan, np.inf
    words = ("--heights-of", of, "--height-out", tmp_path / "out.npy", "--picture", tmp_path / "p.png")
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, holed), *words)
    whole = answered(capsys, tmp_path, "--height", saved(tmp_path, bump(1e-3), "w.npy"), *words[:2])
    assert (answer["flags"]["missing_heights"], whole["flags"]["missing_heights"]) == (7, 0)
    assert answer["contact_pixels"] == whole["contact_pixels"] - 6
    assert any("7 of 19200" in note for note in answer["notes"])
    assert np.array_equal(np.isnan(np.load(tmp_path / "out.npy")), ~np.isfinite(holed))
    first = answered(capsys, tmp_path, "--height", tmp_path / "h.npy", "--heights-of", of)
    seen = read_image(tmp_path / "a.png")
    again = answered(capsys, tmp_path, "--height", tmp_path / "out.npy", "--heights-of", of)
    assert np.array_equal(read_image(tmp_path / "a.png"), seen)
    assert again["flags"] == first["flags"] == answer["flags"]


def test_how_deep_an_object_reaches_below_a_gel_may_be_missing_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    holed = bump(1e-3)
    holed[58:61, 78:80] = np.nan
    reached = saved(tmp_path, holed, "r.npy")
    words = ("--height", saved(tmp_path, bump(1e-3)), "--heights-of", "gel", "--reached")
    answer = answered(capsys, tmp_path, *words, reached)
    whole = answered(capsys, tmp_path, *words, saved(tmp_path, bump(1e-3), "w.npy"))
    assert answer["flags"]["missing_heights"] == 6
    assert answer["contact_pixels"] == whole["contact_pixels"] - 6


def test_a_contact_that_fills_the_window_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    level = np.full((120, 160), 1e-3)
    for patch in (1e-3, np.nan):
        level[40:50, 40:50] = patch
        answer = answered(capsys, tmp_path, "--height", saved(tmp_path, level))
        assert answer["flags"]["fills_window"] is True
        assert answer["flags"]["touches_border"] is True
        assert any("fills the window" in note for note in answer["notes"])
    assert not answered(capsys, tmp_path, "--height", saved(tmp_path, bump(1e-3)))["flags"]["fills_window"]


@pytest.mark.parametrize(
    ("words", "reason", "code"),
    [
        ((), "either a MESH", 2),
        (("builtin:mug",), "--contact X Y Z", 2),
        (("builtin:mug", "--contact", "0", "0", "0.5"), "off the surface", 1),
        (("builtin:mug", "--contact", "-40", "0", "50"), "write metres", 1),
        (("builtin:mug", "--contact", "0.04", "0", "0.05"), "in the sensor's way", 1),
        (("builtin:mug", "--contact", "0.04", "0", "0.05", "--force"), "the gel 2.5 mm thick", 1),
        (("builtin:mgu", "--contact", "0", "0", "0"), "did you mean 'mug'", 2),
        (("none.obj", "--contact", "0", "0", "0"), "none.obj", 2),
        (("builtin:mug", "--contact", "-0.04", "0", "0.05", "--depth", "1"), "no unit", 2),
        (("builtin:mug", "--contact", "-0.04", "0", "0.05", "--tilt", "80deg"), "60 deg", 2),
        (("builtin:mug", "--contact", "-0.04", "0", "0.05", "--yaw", "1mm"), "--yaw", 2),
        (("builtin:mug", "--contact", "-0.04", "0", "0.05", "--heights-of", "gel"), "--heights-of", 2),
        (("builtin:mug", "--height", "h.npy"), "either a MESH", 2),
        (("--height", "h.npy", "--depth", "1mm"), "are of a mesh", 2),
        (("--height", "absent.npy"), "there is no height map", 2),
        (("--height", "h.npy", "--heights-of", "gle"), "object and gel", 2),
        (("--height", "h.npy", "--sensor", "gelsight"), "did you mean 'gelsight-r1.5'", 2),
        (("--height", "h.npy", "--calibration", "."), "polycalib.npz", 1),
        (("--height", "h.npy", "--calibration", "h.npy"), "does not read", 1),
        (("--height", "h.npy", "--pitch", "-1mm"), "above zero", 2),
        (("--height", "h.npy", "--thickness", "0mm"), "above zero", 2),
        (("--height", "h.npy", "--shadow"), "needs a table", 2),
        (("--height", "h.npy", "--level", "touch.optics=exat"), "did you mean 'exact'", 2),
        (("--height", "h.npy", "--level", "touch.supersampling=2"), "leave it out", 2),
        (("--height", "h.npy", "--live", "small.png"), "not cropped", 1),
        (("--height", "h.npy", "--live", "h.npy"), "is no picture", 1),
        (("--height", "h.npy", "--background", "small.png"), "not cropped", 1),
        (("--height", "h.npy", "--picture", "p.jpg"), ".png", 2),
        (("--height", "h.npy", "--picture", "a.png", "--out", "a.png"), "two names", 2),
        (("--height", "h.npy", "--reached", "h.npy"), "includes the indentation", 2),
        (("--height", "h.npy", "--heights-of", "gel", "--reached", "mm.npy"), "look like millimetres", 1),
        (("builtin:mug", "--contact", "0", "0", "0", "--reached", "h.npy"), "are of --height", 2),
        (("--height", "h.npy", "--noise", "inf"), "finite", 2),
        (("--height", "h.npy", "--height-out", "h.txt"), "let its name end in .npy", 2),
        (("--height", "mm.npy"), "look like millimetres", 1),
        (("--height", "deep.npy"), "this gel is 2.5 mm thick", 1),
        (
            ("--height", "h.npy", "--heights-of", "gel", "--reached", "deep.npy"),
            "this gel is 2.5 mm thick",
            1,
        ),
        (("builtin:mug", "--vertex", "3000", "--depth", "80mm"), "80 mm deep; this gel is 2.5 mm thick", 1),
        (("builtin:mug", "--vertex", "3000", "--depth", "2.6mm"), "2.6 mm deep; this gel is 2.5 mm thick", 1),
        (("--height", "pixels.npy"), "look like pixels of 0.1245 mm", 1),
        (("--height", "nan.npy"), "none of its 19200 heights", 1),
        (("--height", "turned.npy"), "transpose it", 1),
    ],
)
def test_errors_say_what_to_do(
    words: tuple[str, ...],
    reason: str,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    maps = {
        "h": bump(1e-3),
        "mm": bump(1.0),
        "pixels": bump(8.0),
        "deep": bump(2.6e-3),
        "turned": bump(1e-3).T,
    }
    for name, heights in {**maps, "nan": np.full((120, 160), np.nan)}.items():
        saved(tmp_path, heights, f"{name}.npy")
    saved(tmp_path, bump(2.6e-3), "deep.npy")
    write_png(tmp_path / "small.png", np.zeros((60, 80, 3), np.uint8))
    answer = answered(capsys, tmp_path, *words, code=code)
    assert reason in answer["error"]
    assert answer["exit_code"] == code
    assert not (tmp_path / "a.png").exists()


def test_the_picture_needs_a_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heights = str(saved(tmp_path, bump(1e-3)))
    assert invoke(["sim", "touch", "--height", heights]) == 2
    assert "--out FILE.png" in capsys.readouterr().err
    assert invoke(["sim", "touch", "--height", heights, "--out", "a.jpg"]) == 2
    assert ".png" in capsys.readouterr().err
