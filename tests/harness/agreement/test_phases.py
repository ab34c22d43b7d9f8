"""Strikes that one microphone at rest hears are in phase or opposed; nothing else is asked of them."""

import numpy as np
import pytest

from harness.agreement.phases import PhaseNoise, is_single, phase_apart, phase_residual
from harness.basics.arrays import FloatArray
from harness.strikes.peaks import Peak
from harness.strikes.spectra import ComplexArray

MODES: FloatArray = np.geomspace(900.0, 900.0 * 1.3**7, 8)
NOISE = PhaseNoise()


def peaks_of(shares: list[ComplexArray]) -> list[Peak]:
    heard = np.ones(6, np.bool_)
    return [
        Peak(float(frequency), 20.0, y / np.linalg.norm(y), np.full(6, 1e-3), heard, 0.0, 0.0)
        for frequency, y in zip(MODES, shares, strict=True)
    ]


def peak_at(frequency: float, damping: float = 20.0) -> Peak:
    return Peak(frequency, damping, np.ones(2, complex), np.full(2, 1e-3), np.ones(2, np.bool_), 0.0, 0.0)


def drawn(rng: np.random.Generator, phases: float) -> list[ComplexArray]:
    """Real gains of either sign, one phase a mode, and one more of each strike."""
    gains = rng.normal(size=(len(MODES), 6))
    turns = 2.0 * np.pi * rng.random((len(MODES), 1)) + phases * rng.normal(size=gains.shape)
    return list(gains * np.exp(1j * turns))


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0])
def test_gains_of_either_sign_are_in_phase(turn: float) -> None:
    found = phase_apart(np.array([0.2, -0.9, 0.5]) * np.exp(1j * turn), NOISE.strong)
    assert found == pytest.approx(0.0, abs=1e-7)


def test_a_strike_that_hardly_moved_the_mode_has_no_phase() -> None:
    assert phase_apart(np.array([1.0, 0.01j]), NOISE.strong) is None
    assert phase_apart(np.array([1.0, 0.9j]), NOISE.strong) == pytest.approx(np.pi / 2.0)
    assert phase_apart(np.array([1.0 + 0.0j]), NOISE.strong) is None


@pytest.mark.parametrize(("phases", "moved"), [(0.0, False), (0.05, False), (1.6, True)])
def test_a_microphone_that_moves_between_strikes_is_improbable(phases: float, moved: bool) -> None:
    found = phase_residual(5, peaks_of(drawn(np.random.default_rng(3), phases)), MODES, NOISE)
    assert found is not None
    assert found.step == 5
    assert (found.chi_square > 20.0) == moved


def test_modes_in_pairs_have_no_phase_of_their_own() -> None:
    pairs: FloatArray = np.sort(np.concatenate([MODES, 1.005 * MODES]))
    assert not any(is_single(peak_at(float(frequency)), pairs, NOISE) for frequency in MODES)
    assert phase_residual(0, peaks_of(drawn(np.random.default_rng(4), 1.6)), pairs, NOISE) is None


def test_a_peak_far_from_every_mode_is_no_modes() -> None:
    assert is_single(peak_at(1000.0), np.array([1000.0, 1300.0]), NOISE)
    assert not is_single(peak_at(1100.0), np.array([1000.0, 1300.0]), NOISE)
    assert not is_single(peak_at(1000.0), np.zeros(0), NOISE)


def test_a_broad_peak_may_hold_its_neighbour_too() -> None:
    assert is_single(peak_at(1000.0, 20.0), np.array([1000.0, 1100.0]), NOISE)
    assert not is_single(peak_at(1000.0, 200.0), np.array([1000.0, 1100.0]), NOISE)
