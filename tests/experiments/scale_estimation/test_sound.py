"""Size by sound: peaks of a model itself, larger or smaller, are read back."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.scale_estimation.answer import peaks_of
from experiments.scale_estimation.size import ENDS, STEP, Belief, SizeRange
from experiments.scale_estimation.sound import hearing
from experiments.scale_estimation.sound.hearing import SHAPE_SIGMA, Hearing, MaterialGuess, by_sound
from experiments.scale_estimation.sound.peaks import (
    CLUTTER_FALL,
    Peaks,
    RingingModel,
    UnsolvedModes,
    log_likelihood,
    modes_a_peak,
)
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


def twice(peaks: Peaks, hertz: float) -> Peaks:
    """Each peak again, fainter and so far above itself."""
    return Peaks(
        np.concatenate([peaks.frequencies, peaks.frequencies + hertz]),
        np.concatenate([peaks.levels, peaks.levels - 3.0]),
        peaks.band,
        peaks.window_decay,
        np.tile(peaks.decays, 2),
    )


def test_a_resonance_that_is_listed_twice_says_no_more_than_once() -> None:
    peaks = peaks_at(1.3, noise=0.005)
    once, again = heard_size(peaks), heard_size(twice(peaks, 1.0))
    np.testing.assert_array_equal(again.belief.log_density, once.belief.log_density)
    assert again.matched == once.matched
    few = replace(peaks, frequencies=peaks.frequencies[:2], levels=peaks.levels[:2], decays=peaks.decays[:2])
    with pytest.raises(FitRefused, match=r"2 peaks.*3 "):
        heard_size(twice(few, 1.0))


def test_two_resonances_farther_apart_than_half_a_width_are_two() -> None:
    peaks = peaks_at(1.3, noise=0.005)
    half = (peaks.decays.max() + DECAY) / (2.0 * np.pi)
    assert len(twice(peaks, 1.1 * half).apart().frequencies) == 2 * len(peaks.frequencies)
    assert len(peaks.apart().frequencies) == len(peaks.frequencies)


def test_a_drawing_twice_as_large_of_the_same_object_gives_the_same_size() -> None:
    """Half the frequencies and a quarter of the amplitudes at twice the size are one and the same body."""
    peaks, drawn = peaks_at(1.3, noise=0.005), model()
    larger = RingingModel(drawn.frequencies / 2.0, drawn.amplitudes / 4.0, drawn.material)
    found = by_sound(peaks, [MaterialGuess(larger, 0.03)], 2.0 * NOMINAL, RANGE)
    assert found.belief.size == pytest.approx(heard_size(peaks).belief.size, rel=1e-3)


@pytest.mark.parametrize(("share", "answered"), [(0.75, False), (0.82, True)])
def test_beside_another_likely_size_the_interval_reaches_over_both_or_there_is_no_answer(
    monkeypatch: pytest.MonkeyPatch, share: float, answered: bool
) -> None:
    other = 1.6

    def two(_peaks: Peaks, _model: RingingModel, log_sizes: FloatArray) -> FloatArray:
        away = np.stack([log_sizes, log_sizes - np.log(other)]) / 0.01
        both = np.logaddexp(*(np.log([[share], [1.0 - share]]) - 0.5 * away**2))
        return np.asarray(50.0 + both / hearing.TEMPER)

    monkeypatch.setattr(hearing, "log_likelihood", two)
    if not answered:
        with pytest.raises(FitRefused, match=r"14\.0 cm.*75 %.*80 %"):
            heard_size(peaks_at(1.0))
        return
    low, high = heard_size(peaks_at(1.0)).belief.interval
    assert low < NOMINAL < other * NOMINAL < high


def test_modes_an_octave_apart_are_no_answer() -> None:
    """They lie on each other at half and twice the size."""
    octaves = RingingModel(400.0 * 2.0 ** np.arange(7.0), np.full(7, 0.05), MATERIALS["ceramic"])
    heard = octaves.frequencies[2:5]
    levels = octaves.levels(np.zeros(1), DECAY)[0][2:5]
    with pytest.raises(FitRefused, match=r"14\.0 cm.*50 %.*80 %"):
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
    with pytest.raises(FitRefused, match=r"2 peaks.*3 "):
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


def test_a_loud_peak_speaks_less_against_a_size_whose_modes_there_were_not_solved() -> None:
    """Else the smaller of two sizes wins, whose solved modes reach higher: soft things were called small."""
    solved = RingingModel(np.linspace(1000.0, 3000.0, 11), np.full(11, 0.05), MATERIALS["polycarbonate"])
    loud = float(solved.levels(np.zeros(1), DECAY)[0].max())

    def likely(hertz: float) -> float:
        peaks = of(np.array([1400.0, hertz]), np.array([loud - 20.0, loud]), "polycarbonate")
        return float(log_likelihood(peaks, solved, np.array([-1e-3, 0.0, 1e-3]))[1])

    amid, above = likely(700.0), likely(6000.0)
    assert above > amid + 1.0
    assert above < likely(2000.0)  # where a mode was solved, it is its peak


@pytest.mark.parametrize("shift", [0.0, -0.4])
def test_a_peak_above_the_solved_modes_counts_alike_wherever_it_lies(shift: float) -> None:
    low, high = (
        UnsolvedModes.of(model()).intensity(np.array([shift]), of(at, np.zeros(1)), -20.0)
        for at in (np.array([5.0e4]), np.array([5.2e4]))
    )
    assert low.item() > 0.0
    assert low.item() == pytest.approx(high.item(), rel=0.2)
    solved = of(np.array([model().frequencies[-2] * np.exp(-shift)]), np.zeros(1))
    assert UnsolvedModes.of(model()).intensity(np.array([shift]), solved, -20.0).item() == 0.0


def test_modes_that_are_heard_as_one_are_louder_than_each() -> None:
    """Four modes within each other's width: a peak of four times the energy is likelier than one of one."""
    at = 3000.0 + np.arange(4)
    four = RingingModel(np.asarray(at, dtype=np.float64), np.full(4, 0.05), MATERIALS["polycarbonate"])
    alone = float(four.levels(np.zeros(1), DECAY)[0].max())

    def likely(louder: float) -> float:
        peaks = of(np.array([2000.0, 3001.5]), np.array([alone - 30.0, alone + louder]), "polycarbonate")
        return float(log_likelihood(peaks, four, np.array([-1e-3, 0.0, 1e-3]))[1])

    chance = 1.0 / CLUTTER_FALL  # nats a dB by which louder chance peaks are rarer
    by_level = [likely(louder) - chance * louder for louder in (0.0, 6.0, 12.0)]
    assert by_level[1] > by_level[0]
    assert by_level[1] > by_level[2]


def test_modes_too_dense_to_be_told_apart_are_no_answer() -> None:
    """Each peak is five modes': a list of such peaks fits many sizes, however well it fits one."""
    middles = np.random.default_rng(5).uniform(900.0, 8000.0, 12)
    dense = np.sort((middles[:, None] * (1.0 + 1e-4 * np.arange(5))).ravel())
    for each, refused in ((5, True), (1, False)):
        at = dense[:: 5 // each]
        ringing = RingingModel(at, np.full(len(at), 0.05), MATERIALS["ceramic"])
        peaks = of(dense[::5], ringing.levels(np.zeros(1), DECAY)[0][::each])
        assert (modes_a_peak(peaks, ringing, 0.0) > 4.0) is refused
        if refused:
            with pytest.raises(FitRefused, match=r"5\.8 modes.*3\.2"):
                by_sound(peaks, [MaterialGuess(ringing, 0.03)], NOMINAL, RANGE)
        else:
            assert by_sound(peaks, [MaterialGuess(ringing, 0.03)], NOMINAL, RANGE).belief.size > 0.0


def test_no_mode_in_the_band_is_no_crowd() -> None:
    peaks = of(np.array([1000.0, 2000.0]), np.zeros(2))
    assert modes_a_peak(peaks, model(), np.log(1e-3)) == 1.0
