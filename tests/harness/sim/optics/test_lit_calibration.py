"""The light of a press: what is written is what is read, and what it may and may not change."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.lit_calibration import LIGHT_POWERS, LitCalibration, read_calibration
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.shading import KNEE, design, scaled_position
from harness.sim.optics.tactile_calibration import (
    TactileCalibration,
    load_calibration,
    save_calibration,
    shipped_calibration,
    with_background,
)
from tests.oracles.light_design import light_design

PITCH = 0.1245e-3
LIGHTS = 6 * len(LIGHT_POWERS)


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


def _lit(known: TactileCalibration, light: FloatArray) -> LitCalibration:
    parts = {field.name: getattr(known, field.name) for field in dataclasses.fields(TactileCalibration)}
    return LitCalibration(**parts, lit=np.concatenate([known.smooth, light]))


@pytest.fixture(scope="module")
def lit(bench: TactileCalibration) -> LitCalibration:
    """Light of the size of a real one: some ten grey levels a millimetre."""
    return _lit(bench, np.random.default_rng(0).normal(0.0, 8e3, (LIGHTS, 3)))


def _dent(height: float = 0.4e-3) -> FloatArray:
    y, x = np.mgrid[:120, :160] - np.array([60.0, 70.0])[:, None, None]
    return np.asarray(height * np.exp(-(x * x + y * y) / (2 * 14.0**2))[None])


def test_it_reads_back_as_it_was_written(lit: LitCalibration, tmp_path: Path) -> None:
    save_calibration(lit, tmp_path / "a.npz")
    again = read_calibration(tmp_path / "a.npz")
    assert isinstance(again, LitCalibration)
    assert again.header == lit.header
    assert again.sha256 == lit.sha256
    assert np.array_equal(again.lit, lit.lit)
    save_calibration(again, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_calibration_without_light_reads_as_ever(bench: TactileCalibration, tmp_path: Path) -> None:
    save_calibration(bench, tmp_path / "a.npz")
    again = read_calibration(tmp_path / "a.npz")
    assert type(again) is TactileCalibration
    assert again.sha256 == load_calibration(tmp_path / "a.npz").sha256


def test_every_bit_of_the_light_counts(lit: LitCalibration) -> None:
    other = lit.lit.copy()
    other[140, 1] = np.nextafter(other[140, 1], np.inf)
    assert dataclasses.replace(lit, lit=other).sha256 != lit.sha256


def test_another_background_keeps_the_light(lit: LitCalibration) -> None:
    other = with_background(lit, 255 - lit.background)
    assert isinstance(other, LitCalibration)
    assert np.array_equal(other.lit, lit.lit)


def test_damage_is_refused(lit: LitCalibration, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    save_calibration(lit, path)
    with np.load(path, allow_pickle=False) as archive:
        good = {name: archive[name] for name in archive.files}
    cases = [
        ("not what was written", {"lit": 2.0 * good["lit"]}),
        ("lit .*float64", {"lit": good["lit"][:-1]}),
        ("lit .*finite", {"lit": np.full_like(good["lit"], np.nan)}),
        ("holds", {"support": None}),
        ("holds", {"mood": good["lit"]}),
        ("a.npz .*header", {"header": np.array("{")}),
        ("a.npz", {"lit": np.array([{}], dtype=object)}),
    ]
    for words, change in cases:
        np.savez(path, **{k: v for k, v in (good | change).items() if v is not None})
        with pytest.raises(CalibrationRefused, match=words):
            read_calibration(path)


def test_errors_of_colours_are_read_back_and_counted(lit: LitCalibration, tmp_path: Path) -> None:
    errors = np.random.default_rng(1).uniform(0.0, 9.0, (lit.bins, lit.bins, 3)).astype(np.float32)
    known = dataclasses.replace(lit, uncertainty=errors)
    assert known.sha256 != lit.sha256
    save_calibration(known, tmp_path / "a.npz")
    again = read_calibration(tmp_path / "a.npz")
    assert isinstance(again, LitCalibration)
    assert np.array_equal(again.uncertainty, errors)
    assert again.sha256 == known.sha256
    assert np.array_equal(dataclasses.replace(again, lit=lit.lit).uncertainty, errors)


def test_a_file_of_before_errors_were_measured_reads_and_says_none(
    lit: LitCalibration, tmp_path: Path
) -> None:
    save_calibration(lit, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as archive:
        assert "uncertainty" not in archive.files
    again = read_calibration(tmp_path / "a.npz")
    assert isinstance(again, LitCalibration)
    assert again.uncertainty.size == 0


@pytest.mark.parametrize(
    "errors",
    [
        np.full((120, 120, 3), -1.0, np.float32),
        np.full((120, 120, 3), np.nan, np.float32),
        np.zeros((120, 120, 3)),
        np.zeros((120, 119, 3), np.float32),
    ],
    ids=["below zero", "no number", "double", "a column short"],
)
def test_errors_that_cannot_be_are_refused(lit: LitCalibration, errors: Any) -> None:
    with pytest.raises(CalibrationRefused, match="uncertainty"):
        dataclasses.replace(lit, uncertainty=errors)


def test_a_file_of_one_array_is_named_for_what_it_is(tmp_path: Path) -> None:
    np.save(tmp_path / "heights.npy", np.zeros((3, 3)))
    with pytest.raises(CalibrationRefused, match=r"heights.npy .* \.npz"):
        read_calibration(tmp_path / "heights.npy")
    with pytest.raises(WrongUse, match=r"absent\.npz"):
        read_calibration(tmp_path / "absent.npz")


def test_without_contact_there_is_no_light(lit: LitCalibration) -> None:
    assert np.array_equal(Optics(lit, "smooth").render(np.zeros((1, 120, 160))).images[0], lit.background)
    drawn = Optics(lit, "smooth").render(deform(np.maximum(_dent() - 0.2e-3, 0.0), R15_SKIRT)).images[0]
    assert np.array_equal(drawn[:, 130:], lit.background[:, 130:])
    assert not np.array_equal(drawn, lit.background)


def test_no_light_draws_as_the_smooth_model_to_the_bit(bench: TactileCalibration) -> None:
    dark = _lit(bench, np.zeros((LIGHTS, 3)))
    drawn, known = (Optics(which, "smooth").render(_dent()) for which in (dark, bench))
    assert np.array_equal(drawn.images, known.images)
    assert np.array_equal(drawn.extrapolated, known.extrapolated)


def test_tables_take_no_light(lit: LitCalibration, bench: TactileCalibration) -> None:
    """They hold what a contact does to the colour themselves, and published ones are drawn as published."""
    levels: tuple[OpticsLevel, ...] = ("exact", "fast")
    for level in levels:
        drawn, known = (Optics(which, level).render(_dent()).images for which in (lit, bench))
        assert np.array_equal(drawn, known)


@pytest.mark.parametrize("height", [0.1e-3, 0.4e-3])
def test_light_grows_with_the_indentation(bench: TactileCalibration, height: float) -> None:
    """Over a flat gel pushed in as a whole, the constant term is all there is, and it is proportional."""
    per_metre = np.array([-3e4, 2e4, -5e4])
    light = np.zeros((LIGHTS, 3))
    light[0] = per_metre
    grey = with_background(_lit(bench, light), np.full((120, 160, 3), 128, np.uint8))
    drawn = Optics(grey, "smooth").render(np.full((1, 120, 160), height)).images[0].astype(float)
    assert np.abs(drawn - 128.0 - height * per_metre).max() <= 0.501


def test_the_kernel_is_the_model_it_says(lit: LitCalibration) -> None:
    heights = _dent()[0]
    z = heights / PITCH
    a, b = (np.pad(np.gradient(z)[k][1:-1, 1:-1], 1, mode="edge") for k in (0, 1))
    normal = (np.stack([-b, -a], axis=-1) / np.sqrt(1 + a * a + b * b)[..., None]).reshape(-1, 2)
    assert np.hypot(*normal.T).max() < KNEE * lit.header.slope_limit
    y, x = (axis.ravel().astype(float) for axis in np.mgrid[:120, :160])
    where = scaled_position(x, y, 120, 160)
    change = design(normal, where) @ lit.slopes
    change += heights.reshape(-1, 1) * (light_design(normal, where) @ lit.light)
    wanted = np.clip(np.rint(lit.background + change.reshape(120, 160, 3)), 0, 255)
    drawn = Optics(lit, "smooth").render(heights[None]).images[0]
    assert np.abs(drawn - wanted).max() <= 1
    assert (drawn != wanted).mean() < 1e-3  # heights are held to the optics' grid


def test_no_direction_has_a_seam(lit: LitCalibration) -> None:
    """A plane turned through every direction by little steps changes its colour by little steps."""
    grey = with_background(lit, np.full((120, 160, 3), 128, np.uint8))
    y, x = np.mgrid[-1:2, -1:2] * PITCH
    turned, steps = Optics(grey, "smooth"), 720
    heights = np.zeros((steps, 120, 160))
    for k, turn in enumerate(2.0 * np.pi * np.arange(steps) / steps):
        heights[k, 59:62, 79:82] = 0.3e-3 + 0.3 * (np.cos(turn) * x + np.sin(turn) * y)
    seen = turned.render(heights).images[:, 60, 80].astype(int)
    jumps = np.abs(seen - np.roll(seen, 1, axis=0)).max()
    assert jumps <= 2 < np.ptp(seen, axis=0).min()
