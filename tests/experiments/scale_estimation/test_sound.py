"""Size by sound: peaks of a model itself, larger or smaller, are read back."""

import numpy as np
import pytest

from experiments.scale_estimation.readings import peaks_of
from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.sound.hearing import SHAPE_SIGMA, Hearing, MaterialGuess, by_sound
from experiments.scale_estimation.sound.model import RingingModel
from experiments.scale_estimation.sound.peaks import Peaks
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.materials import KNOWN, MATERIALS
from harness.bench.acquisition import Strike
from harness.sim.modal.modes import dampings

RANGE = SizeRange(0.05, 0.4)
NOMINAL = 0.14
BAND = (150.0, 9000.0)
DECAY = 20.0


def model(material: str = "ceramic") -> RingingModel:
    random = np.random.default_rng(3)
    frequencies = np.sort(random.uniform(900.0, 18000.0, 30))
    ceramic = RingingModel(frequencies, np.full(30, 0.05), MATERIALS["ceramic"])
    return ceramic.made_of(MATERIALS[material])


def peaks_at(scale: float, every: int = 2, noise: float = 0.0, material: str = "ceramic") -> Peaks:
    known, random = model(material), np.random.default_rng(1)
    heard = known.frequencies / scale * np.exp(noise * random.standard_normal(30))
    levels = known.levels(np.array([np.log(scale)]), DECAY)[0]
    chosen = np.flatnonzero((heard > BAND[0]) & (heard < BAND[1]))[::every]
    return of(heard[chosen], levels[chosen], material)


def of(frequencies: FloatArray, levels: FloatArray, material: str = "ceramic") -> Peaks:
    return Peaks(frequencies, levels, BAND, DECAY, dampings(frequencies, MATERIALS[material]))


def heard_size(peaks: Peaks, sigma: float = 0.03, *others: str) -> Hearing:
    guesses = [MaterialGuess(model(), sigma)]
    guesses += [MaterialGuess(model(name), KNOWN[name].uncertainty.speed) for name in others]
    return by_sound(peaks, guesses, NOMINAL, RANGE)


@pytest.mark.parametrize("scale", [0.5, 0.8, 1.0, 1.3, 2.0])
def test_a_model_s_own_peaks_give_its_size(scale: float) -> None:
    peaks, sigma = peaks_at(scale, noise=0.005), float(np.hypot(0.03, SHAPE_SIGMA))
    found = heard_size(peaks)
    assert found.belief.size == pytest.approx(scale * NOMINAL, rel=0.01)
    low, high = found.belief.interval
    assert low < scale * NOMINAL < high
    assert found.belief.spread > 0.95 * sigma  # never surer than the material is known
    if len(peaks.frequencies) >= 8:
        assert found.belief.spread == pytest.approx(sigma, rel=0.15)


def test_the_material_is_what_sound_knows_once_the_size_is_known() -> None:
    faster = peaks_at(1.0 / 1.1)  # frequencies of a stiffer object of nominal size
    exact = heard_size(peaks_at(1.0)).match
    speed = heard_size(faster, 0.1).speed(5000.0, exact)
    assert speed["value_m_per_s"] == pytest.approx(5500.0, rel=0.02)
    assert speed["low90_m_per_s"] < 5500.0 < speed["high90_m_per_s"]


def test_a_material_known_by_name_alone_widens_the_answer_as_its_own_uncertainty_says() -> None:
    named = KNOWN["ceramic"].uncertainty.speed
    found = heard_size(peaks_at(1.2, every=1), named)
    assert found.belief.spread == pytest.approx(np.hypot(named, SHAPE_SIGMA), rel=0.1)


@pytest.mark.parametrize("material", ["ceramic", "glass", "iron", "steel"])
def test_hard_materials_sound_alike_and_need_not_be_told_apart(material: str) -> None:
    every = ("glass", "wood", "plastic", "iron", "polycarbonate", "steel")
    found = heard_size(peaks_at(1.2, every=1, material=material), KNOWN["ceramic"].uncertainty.speed, *every)
    low, high = found.belief.interval
    assert low < 1.2 * NOMINAL < high
    assert found.belief.size == pytest.approx(1.2 * NOMINAL, rel=0.15)


def test_plastic_is_not_taken_for_a_large_piece_of_ceramic() -> None:
    """It sounds four times as low; how long it rings tells it apart."""
    peaks = peaks_at(0.6, every=1, material="plastic")
    both = heard_size(peaks, KNOWN["ceramic"].uncertainty.speed, "plastic")
    low, high = both.belief.interval
    assert low < 0.6 * NOMINAL < high


def test_a_size_beyond_the_range_is_named_as_such() -> None:
    assert heard_size(peaks_at(3.5, every=1)).belief.outside > 0.5
    assert heard_size(peaks_at(1.5, every=1)).belief.outside < 0.05


def test_two_peaks_and_chance_are_refused() -> None:
    two = peaks_at(1.0)
    with pytest.raises(FitRefused, match="2 peaks"):
        heard_size(of(two.frequencies[:2], two.levels[:2]))
    random = np.random.default_rng(0)
    refused = 0
    for _ in range(20):
        try:
            heard_size(of(np.sort(random.uniform(500.0, 9000.0, 12)), np.full(12, -40.0)))
        except FitRefused:
            refused += 1
    assert refused >= 18


def test_a_silent_strike_is_no_reading() -> None:
    nothing = np.zeros(25_000)
    silent = Strike(50e3, nothing, nothing, 0, 0.0, overload=False, double_hit=False, silent=True)
    assert peaks_of([]) is None
    assert peaks_of([silent]) is None
