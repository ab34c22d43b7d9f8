"""Gain and offset of a camera: found as they were made, to the error that is stated; or a named error."""

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.picture.exposure_fit import ExposureKind, exposure_kind, fit_exposure
from harness.picture.srgb import bytes_from_linear
from tests.samples.exposed_pictures import GAIN, OFFSET, disc, everywhere, shaded

LIGHT = shaded(0)


def exposed(light: FloatArray, noise: float, seed: int = 1) -> ByteArray:
    seen = GAIN * light + OFFSET + np.random.default_rng(seed).normal(0.0, noise, light.shape)
    return bytes_from_linear(seen).copy()


def test_what_was_exposed_is_found_to_a_grey_level() -> None:
    found = fit_exposure(exposed(LIGHT, 0.0), LIGHT, everywhere(LIGHT))
    np.testing.assert_allclose(found.gain, GAIN, atol=1.0 / 255.0)
    np.testing.assert_allclose(found.offset, OFFSET, atol=0.5 / 255.0)
    np.testing.assert_allclose(found.balance, GAIN / GAIN[1], atol=2.0 / 255.0)
    assert found.stops == pytest.approx(np.log2(0.8), abs=0.01)
    assert (found.pixels + found.saturated == LIGHT[..., 0].size).all()


def test_errors_are_as_large_as_they_are_said_to_be() -> None:
    """Over pictures of independent noise: 18 of each kind, whose spread is then known to a sixth."""
    off = []
    for seed in range(18):
        light = shaded(seed)
        found = fit_exposure(exposed(light, 0.02, 100 + seed), light, everywhere(light))
        one = found.gain / found.gain[1] - GAIN / GAIN[1]
        off.append([(found.gain - GAIN) / found.gain_error, (found.offset - OFFSET) / found.offset_error])
        off[-1].append(one[[0, 2]] / (GAIN[[0, 2]] / GAIN[1] * found.balance_error[[0, 2]]))
        assert found.balance_error[1] == 0.0
    for each in zip(*off, strict=True):
        assert 0.7 < np.concatenate(each).std() < 1.4


@pytest.mark.parametrize("kind", ["gain-offset", "gain", "none"])
def test_twice_the_exposure_is_twice_the_gain(kind: ExposureKind) -> None:
    """And half the simulated light too, where anything is fitted."""
    live = exposed(LIGHT, 0.005)
    one, half = (fit_exposure(live, k * LIGHT, everywhere(LIGHT), kind) for k in (1.0, 0.5))
    factor = 1.0 if kind == "none" else 2.0
    np.testing.assert_allclose(half.gain, factor * one.gain, rtol=1e-6)
    np.testing.assert_allclose(half.gain_error, factor * one.gain_error, rtol=1e-4)
    assert (one.offset == 0.0).all() == (kind != "gain-offset")


def test_neither_highlights_nor_shadows_move_the_fit() -> None:
    clean, spoiled = exposed(LIGHT, 0.005), exposed(LIGHT, 0.005)
    spoiled[:30, :30] = 240
    spoiled[60:80, 40:70] = 5
    one, other = (fit_exposure(live, LIGHT, everywhere(LIGHT)) for live in (clean, spoiled))
    assert (np.abs(other.gain - one.gain) < 4.0 * other.gain_error + 1.0 / 255.0).all()
    share = (30 * 30 + 20 * 30) / LIGHT[..., 0].size
    assert (other.outliers > 0.8 * share).all()
    assert (one.outliers < 0.01).all()


def test_saturated_pixels_say_nothing() -> None:
    """A long exposure: white where it is bright, and the gain as it is all the same."""
    seen = bytes_from_linear(1.6 * LIGHT)
    found = fit_exposure(seen, LIGHT, everywhere(LIGHT))
    assert (found.saturated == (seen > 250).sum(axis=(0, 1))).all()
    assert (found.saturated > 500).all()
    np.testing.assert_allclose(found.gain, 1.6, atol=0.01)


def test_errors_shrink_as_the_root_of_the_pixels() -> None:
    light = shaded(3, 256, 256)
    live = exposed(light, 0.02)
    few = everywhere(light)
    few[64:] = False
    many, less = (fit_exposure(live, light, mask) for mask in (everywhere(light), few))
    assert (less.gain_error / many.gain_error).mean() == pytest.approx(2.0, rel=0.35)


@pytest.mark.parametrize(("radius", "said"), [(0.0, " 0 whole pixels"), (6.0, r"pixels in \d+ blocks")])
def test_an_object_too_small_is_refused(radius: float, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        fit_exposure(exposed(LIGHT, 0.0), LIGHT, disc(96, 96, radius) > 0.5)


@pytest.mark.parametrize(("level", "said"), [(255, "9216 .*saturated"), (0, "9216 black")])
def test_a_picture_that_is_all_white_or_black_is_refused(level: int, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        fit_exposure(np.full(LIGHT.shape, level, np.uint8), LIGHT, everywhere(LIGHT))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_light_that_is_not_finite_is_refused(wrong: float) -> None:
    light = LIGHT.copy()
    light[3, 4, 1] = wrong
    with pytest.raises(DataRefused, match="1 of 27648"):
        fit_exposure(exposed(LIGHT, 0.0), light, everywhere(LIGHT))


def test_pictures_of_two_sizes_are_refused() -> None:
    with pytest.raises(DataRefused, match=r"\(95, 96, 3\).*\(96, 96, 3\)"):
        fit_exposure(exposed(LIGHT, 0.0)[:-1], LIGHT, everywhere(LIGHT))
    with pytest.raises(DataRefused, match="8 bits"):
        fit_exposure(LIGHT, LIGHT, everywhere(LIGHT))  # type: ignore[arg-type]


def test_one_brightness_tells_no_offset_but_a_gain() -> None:
    flat = np.full(LIGHT.shape, 0.5)
    with pytest.raises(DataRefused, match=r"0\.5 .*spread"):
        fit_exposure(exposed(flat, 0.01), flat, everywhere(flat))
    found = fit_exposure(exposed(flat, 0.01), flat, everywhere(flat), "gain")
    np.testing.assert_allclose(found.gain, GAIN + 2.0 * OFFSET, atol=0.002)
    black = np.zeros(LIGHT.shape)
    with pytest.raises(DataRefused, match=r"\(0 of 1\)"):
        fit_exposure(exposed(flat, 0.01), black, everywhere(black), "gain")


def test_pictures_of_two_things_are_refused() -> None:
    for other in (shaded(9), 1.0 - LIGHT):
        with pytest.raises(DataRefused, match=r"gain -?\d.* \+- "):
            fit_exposure(exposed(other, 0.01), LIGHT, everywhere(LIGHT))


def test_an_unknown_fit_names_those_there_are() -> None:
    assert exposure_kind("gain") == "gain"
    with pytest.raises(WrongUse, match=r"'gains'.*'gain'"):
        exposure_kind("gains")
