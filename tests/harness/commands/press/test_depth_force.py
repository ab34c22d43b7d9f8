"""``touchstone depth --force``: forces of presses that were drawn, read from their pictures alone."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import OutOfDomain
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.cli import invoke
from harness.effects.touch_press import press_heights
from harness.picture.image_file import write_png
from harness.sim.gel.contact_force import contact_force
from harness.sim.gel.elastic import GelElastic
from harness.sim.optics.depth_reading import DepthReading, read_force, read_press
from harness.sim.optics.inverse import DRIFTING
from harness.sim.optics.known_gel import Gel
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples.pressed_shapes import Pair, places

SCENE = scene_from_options("builtin:mug")
BENCH = shipped_calibration("gelsight_r15_bench")
WORLD = Gel(GELSIGHT_R15, shipped_calibration("gelsight_r15_world"))
"""The gel that is pressed: calibrated by other presses than the one that reads."""

STIFF = GelElastic(0.3e6, 0.0, 0.485, 0.0, 0.0)
PITCH, THICK = GELSIGHT_R15.pitch, GELSIGHT_R15.gel_thickness
WORDS = ("--calibration", "gelsight_r15_bench", "--force", "--thickness", "2.5mm")
KNOWN = (*WORDS, "--gel-modulus", "0.3MPa", "--gel-modulus-error", "0%")

BALLS = [(2e-3, 0.3e-3), (2e-3, 0.8e-3), (5e-3, 0.3e-3), (5e-3, 1e-3), (15e-3, 0.3e-3), (15e-3, 0.8e-3)]


def _ball(radius: float, depth: float, at: Pair = (1e-3, -0.5e-3)) -> FloatArray:
    x, y = places(PITCH, 120, 160, at)
    away = np.minimum(x * x + y * y, radius**2)
    return np.asarray(np.maximum(0.0, depth - radius + np.sqrt(radius**2 - away)))


def _picture(heights: FloatArray) -> ByteArray:
    return press_heights(heights, "object", WORLD, SCENE, ["touch.optics=smooth"]).image


def _read(heights: FloatArray) -> DepthReading:
    return read_press(_picture(heights)[None], BENCH, DRIFTING)


def _answered(capsys: pytest.CaptureFixture[str], folder: Path, heights: FloatArray, *words: str) -> Any:
    write_png(folder / "press.png", _picture(heights))
    given = ["depth", str(folder / "press.png"), "--out", str(folder / "d.npz"), *words, "--json"]
    assert invoke(given) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(("radius", "depth"), BALLS)
def test_a_press_that_was_drawn_is_read_with_its_force(radius: float, depth: float) -> None:
    """By the calibration of other presses, and a skirt that is not the layer's: within a tenth."""
    heights = _ball(radius, depth)
    true = contact_force(heights[None], PITCH, THICK, STIFF).newtons[0]
    found = read_force(_read(heights), THICK, STIFF)
    assert found.newtons == pytest.approx(true, rel=0.1)
    assert abs(found.newtons - true) < 2.0 * found.uncertainty < 0.5 * true


def test_an_untouched_gel_is_read_with_no_force_at_all() -> None:
    found = read_force(_read(np.zeros((120, 160))), THICK, STIFF)
    assert found.newtons == 0.0 == found.uncertainty


def test_a_gel_thinner_than_the_reading_is_deep_is_refused() -> None:
    with pytest.raises(OutOfDomain, match=r" mm .* mm"):
        read_force(_read(_ball(5e-3, 1e-3)), 0.5e-3, STIFF)


def test_the_command_answers_the_force_with_what_it_is_off_by(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    heights = _ball(5e-3, 0.3e-3)
    answer = _answered(capsys, tmp_path, heights, *KNOWN)
    assert answer["force_n"] == pytest.approx(
        contact_force(heights[None], PITCH, THICK, STIFF).newtons[0], rel=0.1
    )
    shares = answer["force"]["uncertainty_shares"]
    assert 0.0 < shares["reading"] < 0.2
    whole = answer["force_n"] * np.sqrt(sum(share**2 for share in shares.values()))
    assert answer["force_uncertainty_n"] == pytest.approx(whole)
    assert answer["force"]["thickness_m"] == pytest.approx(2.5e-3)
    assert answer["force"]["centre_m"] == pytest.approx([1e-3, -0.5e-3], abs=PITCH)
    assert answer["seconds"]["force_cpu"] > 0.0


def test_without_being_asked_there_is_no_force(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    answer = _answered(capsys, tmp_path, _ball(5e-3, 0.3e-3), "--calibration", "gelsight_r15_bench")
    assert answer["force_n"] is answer["force_uncertainty_n"] is answer["force"] is None
    assert answer["seconds"]["force_cpu"] is None


def test_the_sensor_that_a_calibration_names_gives_the_thickness(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    answer = _answered(capsys, tmp_path, _ball(5e-3, 0.3e-3), *WORDS[:3])
    assert answer["force"]["thickness_m"] == THICK


def test_a_bench_says_how_thick_its_gel_is(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    answer = _answered(capsys, tmp_path, _ball(5e-3, 0.3e-3), "--station", "mock", "--force")
    assert answer["force"]["thickness_m"] == THICK
    assert any("--gel-modulus" in note for note in answer["notes"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((*WORDS[:2], "--thickness", "2.5mm"), "add --force"),
        ((*WORDS[:4], "0mm"), "above zero"),
        ((*WORDS, "--gel-modulus", "0.3MPa"), "say both"),
    ],
)
def test_what_cannot_be_answered_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    write_png(tmp_path / "press.png", _picture(_ball(5e-3, 0.3e-3)))
    assert invoke(["depth", str(tmp_path / "press.png"), "--out", str(tmp_path / "d.npz"), *words]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
