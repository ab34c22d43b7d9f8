"""Transfer functions from blows: what noise on either side does, and blows that do not count."""

import re
from collections.abc import Callable

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.sim.sound.modal_sound import ring
from harness.strikes.frequency_response import FrequencyResponse, frequency_response
from harness.strikes.modal_identification import modes_of_decay, modes_of_response
from harness.strikes.pole_fit import PoleSearch
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
    with pytest.raises(DataRefused, match=r"blow 2 .*twice"):
        frequency_response(twice, response, RATE)
    with pytest.raises(DataRefused, match=r"blow 1 .*clipped"):
        frequency_response(np.minimum(force, 20.0), response, RATE)
    with pytest.raises(DataRefused, match="shape"):
        frequency_response(force, response[:, 1:], RATE)
    with pytest.raises(DataRefused, match="finite"):
        frequency_response(force, np.where(response == response.max(), np.nan, response), RATE)


STRUCK = np.array([410.0, 1130.0, 1142.0])
DECAYS = np.array([6.0, 14.0, 11.0])
STRUCK_RATE = 25000.0
STRUCK_SAMPLES = 25000
PEAKS = (75.0, 60.0, 66.0)
WIDTH = 0.4e-3


def struck(seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Three half-sine blows, 10 ms into records of 1 s, and the responses of three modes, with noise."""
    random = np.random.default_rng(seed)
    force = np.zeros((3, STRUCK_SAMPLES))
    for row, peak in zip(force, PEAKS, strict=True):
        pulse = half_sine(STRUCK_RATE, WIDTH, peak)
        row[250 : 250 + len(pulse)] = pulse
    gains = np.array([[1.0, 0.8, 0.6]])
    response = np.concatenate([ring(STRUCK, DECAYS, gains, row[None], STRUCK_RATE) for row in force])
    hiss = 1e-4 * np.abs(response).max() * random.normal(size=force.shape)
    return force + 0.02 * random.normal(size=force.shape), response + hiss


def impulse(peak: float) -> float:
    """N s of a blow as sampled."""
    return float(half_sine(STRUCK_RATE, WIDTH, peak).sum()) / STRUCK_RATE


def require_three_modes(measured: FrequencyResponse) -> None:
    search = PoleSearch(low=20.0, high=measured.band[1])
    modes = modes_of_response(measured.frequencies, measured.h1, search).modes
    assert [mode.frequency for mode in modes] == pytest.approx(STRUCK, abs=0.02)
    assert [mode.damping for mode in modes] == pytest.approx(DECAYS, abs=0.05)


@pytest.mark.parametrize("drift", [0.0, 10.0, -10.0, 100.0])
def test_a_drift_of_the_force_changes_neither_impulse_nor_modes(drift: float) -> None:
    """N/s, of an amplifier that warms up, on a rest of 3 N."""
    force, response = struck()
    measured = frequency_response(
        force + 3.0 + drift * np.arange(STRUCK_SAMPLES) / STRUCK_RATE, response, STRUCK_RATE
    )
    for blow, peak in zip(measured.blows, PEAKS, strict=True):
        assert blow.impulse == pytest.approx(impulse(peak), abs=0.05e-3)
        assert blow.peak == pytest.approx(peak, abs=1.5)
        assert blow.drift == pytest.approx(drift, abs=1.0)
        assert blow.touches == 1
    assert measured.notes == ()
    require_three_modes(measured)


def test_a_drift_that_is_no_straight_line_changes_no_impulse() -> None:
    """A cell that cools: 20 N, with a time constant of 0.3 s; its blow is 0.4 s into the record."""
    force, response = struck()
    times = np.arange(STRUCK_SAMPLES) / STRUCK_RATE
    cooling = np.roll(force, 10000, axis=1) + 20.0 * np.exp(-times / 0.3)
    for blow, peak in zip(
        frequency_response(cooling, np.roll(response, 10000, axis=1), STRUCK_RATE).blows, PEAKS, strict=True
    ):
        assert blow.impulse == pytest.approx(impulse(peak), abs=0.05e-3)
        assert blow.touches == 1


@pytest.mark.parametrize("level", [0.9, 0.7, 0.4])
@pytest.mark.parametrize("counts", [0.0, 1e-3])
def test_a_clipped_response_is_refused(level: float, counts: float) -> None:
    """At a share of its peak, by a converter (flat) or an amplifier in front of it (with noise on top)."""
    force, response = struck()
    top = level * np.abs(response[1]).max()
    hiss = counts * top * np.random.default_rng(1).normal(size=STRUCK_SAMPLES)
    response[1] = np.clip(response[1], -top, top) + hiss
    with pytest.raises(DataRefused, match=r"response .*blow 2 .*clipped"):
        frequency_response(force, response, STRUCK_RATE)


def test_a_clipped_decay_is_noted() -> None:
    response = struck()[1][:, 400:8000]
    clipped = response.copy()
    clipped[1] = np.clip(response[1], -1e-2, 1e-2)
    assert modes_of_decay(response, STRUCK_RATE, PoleSearch(low=20.0, high=3000.0)).notes == ()
    (note,) = modes_of_decay(clipped, STRUCK_RATE, PoleSearch(low=20.0, high=3000.0, most=3)).notes
    assert "row 2 " in note


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda row: np.roll(row, 3), "comes 120 us later"),
        (lambda row: np.roll(row, -5), "comes 200 us earlier"),
        (lambda row: -row, "has the opposite sign"),
        (lambda row: 1.3 * row, "is 1.3 times as large"),
        (
            lambda row: np.concatenate([row[:4000], row[4050:], np.zeros(50)]),
            "samples of a channel were lost",
        ),
        (lambda row: np.concatenate([row[:4000], row[4005:], np.zeros(5)]), "samples of a channel were lost"),
    ],
)
def test_a_response_unlike_the_others_is_reported(
    change: Callable[[FloatArray], FloatArray], said: str
) -> None:
    force, response = struck()
    response[1] = change(response[1])
    (note,) = frequency_response(force, response, STRUCK_RATE).notes
    assert "blow 2" in note
    assert said in note
    pair = frequency_response(force[:2], response[:2], STRUCK_RATE).notes
    assert "lost" in said or [said in each for each in pair] == [True]


@pytest.mark.parametrize(
    ("shift", "said"), [(-100, "(3.9|4.0)[0-9] ms before"), (75, "3.[01][0-9] ms after")]
)
def test_a_channel_that_is_late_in_all_blows_is_reported(shift: int, said: str) -> None:
    force, response = struck()
    later = np.roll(force, 2000, axis=1), np.roll(response, 2000 + shift, axis=1)
    notes = frequency_response(*later, STRUCK_RATE).notes
    assert len(notes) == 3
    for note in notes:
        assert re.search(said, note)


def test_a_force_of_the_wrong_sign_is_named() -> None:
    force, response = struck()
    with pytest.raises(DataRefused, match="sign"):
        frequency_response(-force, response, STRUCK_RATE)
