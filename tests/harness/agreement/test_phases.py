"""Strikes that one microphone at rest hears are in phase or opposed; nothing else is asked of them."""

import numpy as np
import pytest
from scipy.stats import norm

from harness.agreement.sound import PhaseNoise, is_single, phase_score
from harness.basics.arrays import FloatArray
from harness.strikes.peaks import Peak
from harness.strikes.spectra import ComplexArray

MODES: FloatArray = np.geomspace(900.0, 900.0 * 1.3**7, 8)
NOISE = PhaseNoise()
FITS = norm.isf(1e-3)


def peak_of(y: ComplexArray, frequency: float = 900.0, damping: float = 2.0, sigma: float = 0.0) -> Peak:
    heard = np.ones(len(y), np.bool_)
    return Peak(frequency, damping, y / np.linalg.norm(y), np.full(len(y), sigma), heard, 0.0, 0.0)


def scored(y: ComplexArray, sigma: float = 0.0) -> float:
    score = phase_score(peak_of(y, sigma=sigma), MODES, NOISE)
    assert score is not None
    return score


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0])
def test_gains_of_either_sign_are_in_phase(turn: float) -> None:
    assert scored(np.array([0.2, -0.9, 0.5, 0.1]) * np.exp(1j * turn)) < -1.0


def test_a_microphone_that_moves_between_strikes_turns_them() -> None:
    rng = np.random.default_rng(3)
    gains, turns = rng.normal(size=(50, 6)), 0.5 * rng.normal(size=(50, 6))
    scores = np.array([scored(one) for one in gains * np.exp(1j * turns)])
    assert np.median(scores) > 2.0


def test_what_noise_turns_is_no_sign_of_it() -> None:
    rng, sigma = np.random.default_rng(5), 0.1
    noisy = sigma * (rng.normal(size=(200, 6)) + 1j * rng.normal(size=(200, 6))) / np.sqrt(2.0)
    gains = np.array([0.5, -0.5, 0.5, 0.3, 0.3, -0.25])
    assert max(scored(gains + one, sigma) for one in noisy) < FITS
    assert max(scored(gains + one) for one in noisy) > scored(gains + noisy[0], sigma)


def test_the_skirts_of_modes_around_turn_a_broad_peak() -> None:
    y, modes = np.array([1.0, 0.5 + 0.1j, -0.4]), np.array([900.0, 950.0])
    narrow, broad = (phase_score(peak_of(y, damping=damping), modes, NOISE) for damping in (0.5, 15.0))
    assert narrow is not None
    assert broad is not None
    assert broad < narrow - 0.5


def test_two_strikes_have_no_phase_to_compare() -> None:
    assert phase_score(peak_of(np.array([1.0, 0.9j])), MODES, NOISE) is None


def test_modes_in_pairs_have_no_phase_of_their_own() -> None:
    pairs: FloatArray = np.sort(np.concatenate([MODES, 1.005 * MODES]))
    y = np.array([1.0, 0.9j, 0.5])
    assert phase_score(peak_of(y), pairs, NOISE) is None
    assert not any(is_single(peak_of(y, float(frequency)), pairs, NOISE) for frequency in MODES)


def test_a_peak_far_from_every_mode_is_no_modes() -> None:
    y = np.ones(3, np.complex128)
    assert is_single(peak_of(y, 1000.0), np.array([1000.0, 1300.0]), NOISE)
    assert not is_single(peak_of(y, 1100.0), np.array([1000.0, 1300.0]), NOISE)
    assert not is_single(peak_of(y, 1000.0), np.zeros(0), NOISE)


def test_a_broad_peak_may_hold_its_neighbour_too() -> None:
    y, modes = np.ones(3, np.complex128), np.array([1000.0, 1100.0])
    assert is_single(peak_of(y, 1000.0, 20.0), modes, NOISE)
    assert not is_single(peak_of(y, 1000.0, 200.0), modes, NOISE)
