"""Size by sound: peaks of a model itself, larger or smaller, are read back."""

import numpy as np
import pytest

from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.sound.hearing import by_sound
from experiments.scale_estimation.sound.model import RingingModel
from experiments.scale_estimation.sound.peaks import Peaks
from harness.basics.errors import FitRefused
from harness.basics.materials import MATERIALS

RANGE = SizeRange(0.05, 0.4)
NOMINAL = 0.14
BAND = (150.0, 9000.0)
DECAY = 20.0


def model() -> RingingModel:
    random = np.random.default_rng(3)
    frequencies = np.sort(random.uniform(900.0, 18000.0, 30))
    return RingingModel(frequencies, np.full(30, 0.05), MATERIALS["ceramic"])


def peaks_at(scale: float, every: int = 2, noise: float = 0.0) -> Peaks:
    known, random = model(), np.random.default_rng(1)
    heard = known.frequencies / scale * np.exp(noise * random.standard_normal(30))
    levels = known.levels(np.array([np.log(scale)]), DECAY)[0]
    chosen = np.flatnonzero((heard > BAND[0]) & (heard < BAND[1]))[::every]
    return Peaks(heard[chosen], levels[chosen], BAND, DECAY)


@pytest.mark.parametrize("scale", [0.5, 0.8, 1.0, 1.3, 2.0])
def test_a_model_s_own_peaks_give_its_size(scale: float) -> None:
    peaks = peaks_at(scale, noise=0.005)
    found = by_sound(peaks, model(), NOMINAL, RANGE, 0.04)
    assert found.belief.size == pytest.approx(scale * NOMINAL, rel=0.01)
    low, high = found.belief.interval
    assert low < scale * NOMINAL < high
    assert found.belief.spread > 0.95 * 0.04  # never surer than the material is known
    if len(peaks.frequencies) >= 8:
        assert found.belief.spread == pytest.approx(0.04, rel=0.15)


def test_the_material_is_what_sound_knows_once_the_size_is_known() -> None:
    faster = peaks_at(1.0 / 1.1)  # frequencies of a stiffer object of nominal size
    found = by_sound(faster, model(), NOMINAL, RANGE, 0.1)
    exact = by_sound(peaks_at(1.0), model(), NOMINAL, RANGE, 0.04).match
    speed = found.speed(5000.0, exact)
    assert speed["value_m_per_s"] == pytest.approx(5500.0, rel=0.02)
    assert speed["low90_m_per_s"] < 5500.0 < speed["high90_m_per_s"]


def test_a_size_beyond_the_range_is_named_as_such() -> None:
    found = by_sound(peaks_at(3.5, every=1), model(), NOMINAL, RANGE, 0.04)
    assert found.belief.outside > 0.9


def test_two_peaks_and_chance_are_refused() -> None:
    two = peaks_at(1.0)
    with pytest.raises(FitRefused, match="2 peaks"):
        by_sound(Peaks(two.frequencies[:2], two.levels[:2], BAND, DECAY), model(), NOMINAL, RANGE, 0.04)
    random = np.random.default_rng(0)
    refused = 0
    for _ in range(20):
        chance = Peaks(np.sort(random.uniform(500.0, 9000.0, 12)), np.full(12, -40.0), BAND, DECAY)
        try:
            by_sound(chance, model(), NOMINAL, RANGE, 0.04)
        except FitRefused:
            refused += 1
    assert refused >= 18
