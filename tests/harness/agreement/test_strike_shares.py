"""Strikes share a resonance as the gains at their places do, in any basis; a moved microphone changes it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, special_ortho_group

from harness.agreement.sound import (
    PhaseNoise,
    ShareNoise,
    StruckModes,
    gain_score,
    microphone_residual,
    mode_groups,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.strikes.peaks import Peak
from harness.strikes.spectra import ComplexArray

STRIKES = 6
PAIRS: FloatArray = np.sort(
    np.concatenate([np.geomspace(900.0, 9000.0, 8), 1.004 * np.geomspace(900.0, 9000.0, 8)])
)
NOISE, PHASES = ShareNoise(), PhaseNoise()


def modes_of(gains: FloatArray, error: float = 0.0) -> StruckModes:
    return StruckModes(PAIRS, gains, np.ones(len(PAIRS)), error)


def peaks_of(rng: np.random.Generator, gains: FloatArray, moved: float = 0.0) -> list[Peak]:
    """One for each pair: any ways to the microphone, and what each strike's way changes by."""
    found = []
    for first in range(0, len(PAIRS), 2):
        ways = rng.normal(size=2) + 1j * rng.normal(size=2)
        changes = moved * (rng.normal(size=STRIKES) + 1j * rng.normal(size=STRIKES))
        y: ComplexArray = np.asarray(gains[:, first : first + 2] @ ways * np.exp(changes), np.complex128)
        heard = np.ones(STRIKES, np.bool_)
        sigma, unit = np.full(STRIKES, 1e-4), y / np.linalg.norm(y)
        found.append(Peak(float(PAIRS[first]), 2.0, unit, sigma, heard, 0.0, 0.0))
    return found


def residual_of(peaks: list[Peak], gains: FloatArray) -> float:
    found = microphone_residual(5, peaks, modes_of(gains), NOISE, PHASES)
    assert found is not None
    return float(chi2.sf(found.chi_square, found.dof))


def off_by(rng: np.random.Generator, gains: FloatArray) -> FloatArray:
    """A model's gains beside true ones: each pair off by a share of its own, as the noise states."""
    shares = NOISE.gain * np.exp(NOISE.spread * rng.normal(size=len(PAIRS) // 2))
    return np.asarray(gains + np.sqrt(2.0) * np.repeat(shares, 2) * rng.normal(size=gains.shape))


def test_gains_that_are_off_as_stated_fit() -> None:
    rng = np.random.default_rng(0)
    truth = rng.normal(size=(200, STRIKES, len(PAIRS)))
    chances = np.array([residual_of(peaks_of(rng, gains), off_by(rng, gains)) for gains in truth])
    assert np.mean(chances < 0.01) < 0.04


def test_a_microphone_that_moves_between_strikes_does_not_fit() -> None:
    rng = np.random.default_rng(1)
    truth = rng.normal(size=(40, STRIKES, len(PAIRS)))
    chances = [residual_of(peaks_of(rng, gains, 0.4), off_by(rng, gains)) for gains in truth]
    assert np.mean(np.array(chances) < 2e-3) > 0.8


def test_the_basis_of_a_pair_does_not_matter() -> None:
    rng = np.random.default_rng(2)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    turned = gains.copy()
    for first in range(0, len(PAIRS), 2):
        turned[:, first : first + 2] @= special_ortho_group.rvs(2, random_state=first)
    peaks = peaks_of(rng, gains, 0.4)
    found = [[gain_score(peak, modes_of(g), NOISE) for peak in peaks] for g in (gains, turned)]
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_a_factor_common_to_all_strikes_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    peak = peaks_of(rng, gains, 0.4)[0]
    turned = Peak(peak.frequency, 2.0, peak.y * np.exp(2.0j), peak.sigma, peak.heard, 0.0, 0.0)
    scores = [gain_score(one, modes_of(gains), NOISE) for one in (peak, turned)]
    assert scores[1] == pytest.approx(scores[0], rel=1e-6)


def test_a_source_that_states_a_larger_error_is_allowed_more() -> None:
    rng = np.random.default_rng(4)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    peak = peaks_of(rng, gains, 0.4)[0]
    sure, unsure = (gain_score(peak, modes_of(gains, error), NOISE) for error in (0.0, 0.5))
    assert sure is not None
    assert unsure is not None
    assert unsure < sure


def test_a_broad_peak_holds_the_skirts_of_its_neighbours() -> None:
    rng = np.random.default_rng(8)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    narrow = peaks_of(rng, gains, 0.4)[3]
    broad = replace(narrow, damping=0.1 * 2.0 * np.pi * narrow.frequency)
    scores = [gain_score(one, modes_of(gains), NOISE) for one in (narrow, broad)]
    assert scores[0] is not None
    assert scores[1] is not None
    assert scores[1] < scores[0] - 0.2


def test_one_peak_that_is_no_modes_is_no_doubt() -> None:
    rng = np.random.default_rng(9)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    peaks, strange = peaks_of(rng, off_by(rng, gains)), peaks_of(rng, rng.normal(size=gains.shape))[0]
    assert residual_of([strange, *peaks[1:]], gains) > 0.01


def test_an_error_that_all_modes_share_counts_once() -> None:
    rng = np.random.default_rng(10)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    peaks = peaks_of(rng, gains, 0.2)
    alone, together = (
        microphone_residual(0, peaks, modes_of(gains), replace(NOISE, shared=shared), PHASES)
        for shared in (0.0, 1.0)
    )
    assert alone is not None
    assert together is not None
    assert together.chi_square < alone.chi_square


def test_too_few_strikes_or_no_mode_near_have_nothing_to_compare() -> None:
    rng = np.random.default_rng(5)
    gains = rng.normal(size=(STRIKES, len(PAIRS)))
    peak = peaks_of(rng, gains)[0]
    three = Peak(peak.frequency, 2.0, peak.y, peak.sigma, np.arange(STRIKES) < 3, 0.0, 0.0)
    far = Peak(20e3, 2.0, peak.y, peak.sigma, peak.heard, 0.0, 0.0)
    assert [gain_score(one, modes_of(gains), NOISE) for one in (three, far)] == [None, None]
    assert microphone_residual(0, [three, far], modes_of(gains), NOISE, PHASES) is None


def test_strikes_that_no_mode_answers_are_finite() -> None:
    silent = np.zeros((STRIKES, len(PAIRS)))
    peak = peaks_of(np.random.default_rng(6), silent + 1.0)[0]
    score = gain_score(
        Peak(peak.frequency, 2.0, peak.y, 0.0 * peak.sigma, peak.heard, 0.0, 0.0), modes_of(silent), NOISE
    )
    assert score is not None
    assert np.isfinite(score)


def test_groups_are_whole_and_no_larger_than_stated() -> None:
    close = np.array([1000.0, 1005.0, 1010.0, 1015.0, 1100.0])
    assert mode_groups(close, NOISE) == [slice(0, 3), slice(3, 4), slice(4, 5)]
    assert mode_groups(np.zeros(0), NOISE) == []


def test_gains_of_other_strikes_are_refused() -> None:
    gains = np.ones((STRIKES, len(PAIRS)))
    with pytest.raises(WrongUse, match="16 modes"):
        modes_of(gains[:, 1:])
    peak = peaks_of(np.random.default_rng(7), gains)[0]
    with pytest.raises(WrongUse, match="peak of 6"):
        gain_score(peak, modes_of(gains[1:]), NOISE)
