"""The light of a press: what is written is what is read, and what it may and may not change."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.sim.optics.lit_calibration import LIGHT_POWERS, LitCalibration, read_calibration
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.tactile_calibration import (
    TactileCalibration,
    load_calibration,
    save_calibration,
    shipped_calibration,
    with_background,
)

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
        ("lit is float64", {"lit": good["lit"][:-1]}),
        ("not finite", {"lit": np.full_like(good["lit"], np.nan)}),
        ("holds", {"support": None}),
        ("holds", {"mood": good["lit"]}),
        ("readable header", {"header": np.array("{")}),
        ("does not read", {"lit": np.array([{}], dtype=object)}),
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
    with pytest.raises(CalibrationRefused, match="uncertainty is"):
        dataclasses.replace(lit, uncertainty=errors)


def test_a_file_of_one_array_is_named_for_what_it_is(tmp_path: Path) -> None:
    np.save(tmp_path / "heights.npy", np.zeros((3, 3)))
    with pytest.raises(CalibrationRefused, match=r"heights.npy does not read .* no \.npz archive; give"):
        read_calibration(tmp_path / "heights.npy")
    with pytest.raises(WrongUse, match="there is no calibration"):
        read_calibration(tmp_path / "absent.npz")


def test_tables_take_no_light(lit: LitCalibration, bench: TactileCalibration) -> None:
    """They hold what a contact does to the colour themselves, and published ones are drawn as published."""
    levels: tuple[OpticsLevel, ...] = ("exact", "fast")
    for level in levels:
        drawn, known = (Optics(which, level).render(_dent()).images for which in (lit, bench))
        assert np.array_equal(drawn, known)
