"""Size by sound: peaks of a model itself, larger or smaller, are read back."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.scale_estimation.readings import peaks_of
from experiments.scale_estimation.size import ENDS, STEP, Belief, SizeRange
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
    # Of an object so small only the lowest modes are in the band: all are needed to tell them apart.
    peaks, sigma = peaks_at(scale, 1 if scale < 0.6 else 2, noise=0.005), float(np.hypot(0.03, SHAPE_SIGMA))
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


def test_a_material_is_recognised_once_the_size_is_known() -> None:
    """A plastic thing that may be ceramic: sound alone leaves both, and its size tells which."""
    peaks, size = (
        peaks_at(0.6, every=1, material="plastic"),
        Belief.of(RANGE, -0.5 * ((RANGE.logs - np.log(0.6 * NOMINAL)) / 0.01) ** 2),
    )
    speed = heard_size(peaks, KNOWN["ceramic"].uncertainty.speed, "plastic").speed(5000.0, size)
    assert speed["value_m_per_s"] == pytest.approx(
        5000.0 * MATERIALS["plastic"].speed / MATERIALS["ceramic"].speed, rel=0.02
    )
    assert speed["stated_m_per_s"] == 5000.0


def test_the_order_of_the_peaks_is_nothing() -> None:
    peaks = peaks_at(1.3, noise=0.005)
    back = replace(
        peaks, frequencies=peaks.frequencies[::-1], levels=peaks.levels[::-1], decays=peaks.decays[::-1]
    )
    one, other = heard_size(peaks).belief, heard_size(back).belief
    assert other.log_density == pytest.approx(one.log_density, abs=1e-9)


def test_a_drawing_twice_as_large_of_the_same_object_gives_the_same_size() -> None:
    """Half the frequencies and a quarter of the amplitudes at twice the size are one and the same body."""
    peaks, drawn = peaks_at(1.3, noise=0.005), model()
    larger = RingingModel(drawn.frequencies / 2.0, drawn.amplitudes / 4.0, drawn.material)
    found = by_sound(peaks, [MaterialGuess(larger, 0.03)], 2.0 * NOMINAL, RANGE)
    assert found.belief.size == pytest.approx(heard_size(peaks).belief.size, rel=1e-3)


def test_modes_an_octave_apart_are_no_answer() -> None:
    """They lie on each other at half and twice the size."""
    octaves = RingingModel(400.0 * 2.0 ** np.arange(7.0), np.full(7, 0.05), MATERIALS["ceramic"])
    heard = octaves.frequencies[2:5]
    levels = octaves.levels(np.zeros(1), DECAY)[0][2:5]
    with pytest.raises(FitRefused, match="several sizes"):
        by_sound(of(heard, levels), [MaterialGuess(octaves, 0.03)], NOMINAL, RANGE)


@pytest.mark.parametrize("seed", range(12))
def test_whatever_is_heard_is_answered_within_the_range_or_refused(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 40))
    peaks = of(random.uniform(*BAND, count), random.uniform(-120.0, 40.0, count))
    try:
        found = heard_size(peaks, 0.11, "glass", "plastic")
    except FitRefused:
        return
    low, high = found.belief.interval
    assert np.isfinite(found.belief.log_density[RANGE.inside]).all()
    beyond = np.exp(ENDS + STEP)
    assert RANGE.low / beyond < low < found.belief.size < high < RANGE.high * beyond


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
