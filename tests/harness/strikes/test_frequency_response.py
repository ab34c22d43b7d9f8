"""Transfer functions from blows: what noise on either side does, and blows that do not count."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.sim.sound.modal_sound import ring
from harness.strikes.frequency_response import FrequencyResponse, frequency_response
from harness.strikes.modal_identification import modes_of_response
from harness.strikes.pole_search import PoleSearch
from tests.samples.blows import half_sine

RATE = 8000.0
SAMPLES = 8000
FREQUENCIES = np.array([120.0, 410.0])
DAMPINGS = np.array([8.0, 15.0])
AMPLITUDES = np.array([[1.0, -0.7]])
ONSET = 80


def blows(count: int, noise: float = 0.0, hiss: float = 0.0, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Forces with ``noise`` N and responses with ``hiss`` upon them."""
    random = np.random.default_rng(seed)
    force = np.zeros((count, SAMPLES))
    for row in force:
        pulse = half_sine(RATE, 1e-3, random.uniform(30.0, 60.0))
        row[ONSET : ONSET + len(pulse)] = pulse
    response = np.concatenate([ring(FREQUENCIES, DAMPINGS, AMPLITUDES, row[None], RATE) for row in force])
    return (
        force + noise * random.normal(size=force.shape),
        response + hiss * random.normal(size=force.shape),
    )


def expected(measured: FrequencyResponse) -> FloatArray:
    """Of the sampled modes: the transform of their answer to one sample of 1 N."""
    unit = np.zeros((1, SAMPLES))
    unit[0, 0] = 1.0
    answer = ring(FREQUENCIES, DAMPINGS, AMPLITUDES, unit, RATE)[0]
    return np.asarray(
        np.exp(-2j * np.pi * np.outer(measured.frequencies[1:600:7], np.arange(SAMPLES)) / RATE) @ answer
    )


def test_without_noise_all_three_are_exact() -> None:
    measured = frequency_response(*blows(3), RATE)
    assert measured.coherence is not None
    assert np.abs(measured.h1[1:600:7] / expected(measured) - 1.0).max() < 1e-3
    assert np.abs(measured.h2[1:600] / measured.h1[1:600] - 1.0).max() < 1e-9
    assert np.abs(measured.coherence[1:600] - 1.0).max() < 1e-9
    assert measured.band[0] == 1.0
    assert 800.0 < measured.band[1] < 1500.0


def test_noise_in_the_response_lowers_the_coherence_and_raises_h2() -> None:
    measured = frequency_response(*blows(4, hiss=0.01), RATE)
    assert measured.coherence is not None
    assert measured.sigma is not None
    assert np.all(measured.coherence <= 1.0 + 1e-12)
    assert np.all(np.abs(measured.h2) >= np.abs(measured.h1) * (1.0 - 1e-12))
    assert np.abs(measured.h1 / measured.h2 - measured.coherence).max() < 1e-9
    assert np.median(measured.coherence[600:1200]) < 0.99
    off = np.abs(measured.h1[1:600:7] - expected(measured)) / measured.sigma[1:600:7]
    # Complex errors of sigma in each part: rms of the square root of two, of 86 lines.
    assert np.sqrt(np.mean(off**2)) == pytest.approx(np.sqrt(2.0), rel=0.6)


def test_one_blow_has_no_coherence() -> None:
    measured = frequency_response(*blows(1), RATE)
    assert measured.coherence is None
    assert measured.sigma is None


def test_noise_of_the_cell_after_the_contact_is_left_out() -> None:
    clean, noisy = (frequency_response(*blows(3, noise=level), RATE) for level in (0.0, 0.05))
    assert np.abs(noisy.h1[1:600] / clean.h1[1:600] - 1.0).max() < 0.01


@pytest.mark.parametrize("window", [0.0, 10.0])
def test_modes_of_a_measured_response(window: float) -> None:
    measured = frequency_response(*blows(3, hiss=1e-4), RATE, decay=window)
    search = PoleSearch(low=20.0, high=measured.band[1])
    modes = modes_of_response(measured.frequencies, measured.h1, search, window).modes
    assert [mode.frequency for mode in modes] == pytest.approx(FREQUENCIES, abs=0.02)
    assert [mode.damping for mode in modes] == pytest.approx(DAMPINGS, rel=0.01)


def test_a_double_hit_and_what_does_not_belong_together_are_refused() -> None:
    force, response = blows(2)
    twice = force.copy()
    twice[1] += 0.4 * np.roll(force[1], 300)
    with pytest.raises(DataRefused, match="blow 2 hit twice"):
        frequency_response(twice, response, RATE)
    with pytest.raises(DataRefused, match="blow 1 was clipped"):
        frequency_response(np.minimum(force, 20.0), response, RATE)
    with pytest.raises(DataRefused, match="shape"):
        frequency_response(force, response[:, 1:], RATE)
    with pytest.raises(DataRefused, match="finite"):
        frequency_response(force, np.where(response == response.max(), np.nan, response), RATE)
