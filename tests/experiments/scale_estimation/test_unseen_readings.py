"""What networks of objects never drawn are given: the laws that sizes, turns and orders obey."""

import numpy as np
import pytest

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.unseen.answer import (
    NOVEL_SIGMA,
    WIDER,
    strikes_alone,
    together_without_shape,
    ways_alone,
)
from experiments.scale_estimation.unseen.contact_set import MOST, GelWay
from experiments.scale_estimation.unseen.contact_set import features as features_of_ways
from experiments.scale_estimation.unseen.network import TURNS, by_ways, shipped
from experiments.scale_estimation.unseen.spectrogram import BANDS, features
from experiments.scale_estimation.unseen.training.contact_samples import TouchableShape, contact_sample
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.materials import MATERIALS
from harness.sim.solid.household.families import draw
from harness.sim.sound.synthesis import synthesize

RANGE = SizeRange(0.05, 0.6)
RATE = 48e3
BAND = 150.0, 12e3
CERAMIC = MATERIALS["ceramic"]
OCTAVE = np.log(2.0) / (np.log(14.0 / 0.025) / BANDS)
"""Bands."""


def normal(size: float, sigma: float) -> Belief:
    return Belief.of(RANGE, -0.5 * ((RANGE.logs - np.log(size)) / sigma) ** 2)


def test_senses_of_an_unknown_shape_weigh_by_how_far_their_errors_are_of_the_shape() -> None:
    sigma, sizes = 0.08, {"vision": 0.20, "audio": 0.26, "touch": 0.22}
    beliefs = {sense: normal(size, sigma) for sense, size in sizes.items()}
    found = together_without_shape(beliefs)
    weights = {sense: 1.0 / (WIDER[sense] * sigma) ** 2 for sense in sizes}
    total = sum(weights.values())
    wanted = np.exp(sum(weights[sense] * np.log(size) for sense, size in sizes.items()) / total)
    assert found.size == pytest.approx(wanted, rel=5e-3)
    assert found.spread == pytest.approx(total**-0.5, rel=0.05)
    turned = dict(reversed(beliefs.items()))
    assert together_without_shape(turned).size == pytest.approx(found.size)


@pytest.mark.parametrize("sense", list(WIDER))
def test_one_sense_alone_is_believed_as_it_is(sense: str) -> None:
    belief = normal(0.2, 0.1)
    assert together_without_shape({sense: belief}) is belief


def rung(size: float, material: str = "ceramic") -> FloatArray:
    """Three modes of a body of that size in m: ``(1, t)`` Pa/(N s)."""
    frequencies = np.array([0.05, 0.09, 0.14]) * MATERIALS[material].speed / size
    amplitudes = np.array([[1.0, 0.8, 0.5]])
    return np.asarray(synthesize(frequencies, np.full(3, 60.0), amplitudes, 0.3, RATE).sound)


def peaks(bands: FloatArray) -> FloatArray:
    """The three loudest bands of the first frame, apart from each other."""
    early, found = bands[0].copy(), []
    for _ in range(3):
        top = int(early.argmax())
        found.append(top)
        early[max(0, top - 8) : top + 9] = 0.0
    return np.sort(np.array(found, dtype=np.float64))


def test_twice_as_large_is_an_octave_of_bands_lower() -> None:
    small, large = (peaks(features(rung(size), RATE, BAND, CERAMIC)[0]) for size in (0.1, 0.2))
    assert small - large == pytest.approx(np.full(3, OCTAVE), abs=1.01)


@pytest.mark.parametrize("other", ["steel", "plastic", "wood"])
def test_the_bands_of_a_size_do_not_depend_on_the_material(other: str) -> None:
    ours = peaks(features(rung(0.2), RATE, BAND, CERAMIC)[0])
    theirs = peaks(features(rung(0.2, other), RATE, BAND, MATERIALS[other])[0])
    assert ours == pytest.approx(theirs, abs=1.01)


def test_the_same_sound_at_another_rate_has_the_same_bands() -> None:
    frequencies, decays = np.array([0.05, 0.09]) * CERAMIC.speed / 0.2, np.full(2, 60.0)
    found = [
        features(
            np.asarray(synthesize(frequencies, decays, np.ones((1, 2)), 0.3, rate).sound), rate, BAND, CERAMIC
        )[0]
        for rate in (32e3, 50e3)
    ]
    assert found[0][0] == pytest.approx(found[1][0], abs=0.02)


def test_silence_is_finite_and_no_strike_is_no_answer() -> None:
    bands, extras = features(np.zeros((1, 4800)), RATE, BAND, CERAMIC)
    assert np.isfinite(bands).all()
    assert np.isfinite(extras).all()
    belief, _ = shipped("sound").belief([{"bands": bands, "extras": extras}], RANGE)
    assert np.isfinite(belief.log_density).all()
    with pytest.raises(FitRefused, match="strike"):
        strikes_alone([], CERAMIC, RANGE)


def ways(size: float = 0.15, family: str = "cup", seed: int = 3) -> list[GelWay]:
    random = np.random.default_rng(seed)
    found: list[GelWay] = []
    while sum(way.normal is not None for way in found) < 6:
        found = contact_sample(TouchableShape.of(draw(family, random)), size, random)
    return found


def test_no_bearing_is_special() -> None:
    made = ways()
    belief, distance = by_ways(made, RANGE)
    turned, far = by_ways([way.turned(4.0 * np.pi / TURNS) for way in made], RANGE)
    assert turned.log_density == pytest.approx(belief.log_density, abs=1e-3)
    assert far == pytest.approx(distance, rel=1e-3)
    between, _ = by_ways([way.turned(0.37) for way in made], RANGE)
    assert between.size == pytest.approx(belief.size, rel=0.03)


def test_more_turns_bring_the_answer_nearer_to_that_of_all_turns() -> None:
    made = [ways(seed=seed) for seed in range(3, 7)]
    exact = [by_ways(one, RANGE, 48)[0] for one in made]

    def off(turns: int) -> float:
        found = [by_ways(one, RANGE, turns)[0] for one in made]
        pairs = zip(found, exact, strict=True)
        return float(sum(np.abs(np.exp(a.log_density) - np.exp(b.log_density)).sum() for a, b in pairs))

    assert off(TURNS) < 0.5 * off(1)
    assert off(24) < off(TURNS)


def test_the_order_of_contacts_does_not_matter() -> None:
    made = ways()
    first, _ = by_ways(made, RANGE)
    second, _ = by_ways(made[::-1], RANGE)
    assert first.log_density == pytest.approx(second.log_density, abs=1e-4)


def test_the_same_path_ten_times_gives_the_answer_of_one() -> None:
    made = ways()
    once, copied = ways_alone(made, RANGE), ways_alone([made[0]] * 9 + made, RANGE)
    assert copied.belief.log_density == pytest.approx(once.belief.log_density, abs=1e-4)
    assert copied.distance == pytest.approx(once.distance)


def test_no_more_ways_are_looked_at_than_there_is_room_for() -> None:
    many = (ways() * 5)[: 2 * MOST]
    rows, kinds, whole = features_of_ways(many)
    assert rows.shape[0] == kinds.shape[0] == MOST
    assert np.isfinite(whole).all()


def test_a_gel_that_met_nothing_is_no_answer() -> None:
    passed = GelWay(np.array([0.0, 0.0, 0.02]), np.array([0.0, 0.0, -1.0]), None)
    with pytest.raises(FitRefused, match="gel"):
        ways_alone([passed], RANGE)


def test_a_bar_never_touched_at_its_ends_is_not_called_short() -> None:
    """Contacts within 20 mm of the middle: the interval leaves room for what lies beyond."""
    random = np.random.default_rng(0)
    made = [
        GelWay(np.array([x, y, 0.012]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]))
        for x, y in zip(random.uniform(-0.02, 0.02, 6), random.uniform(-0.004, 0.004, 6), strict=True)
    ]
    low, high = by_ways(made, RANGE)[0].interval
    assert low < 0.15 < high
    assert high > 2.0 * low


def test_readings_unlike_all_that_was_learnt_are_noticed_and_widen_the_answer() -> None:
    usual, near = by_ways(ways(), RANGE)
    strange = [
        GelWay(np.array([np.cos(a), np.sin(a), 2.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]))
        for a in np.arange(8) * np.pi / 4.0
    ]
    belief, far = by_ways(strange, RANGE)
    assert near < 1.0 < far
    assert belief.spread > usual.spread


def test_touch_is_as_wide_as_its_ways_are_unlike_those_learnt() -> None:
    wide = SizeRange(0.02, 1.5)  # cuts off neither density
    made = ways()
    stated, distance = by_ways(made, wide)
    answer = ways_alone(made, wide)
    assert answer.distance == distance
    expected = float(np.hypot(stated.spread, NOVEL_SIGMA * distance))
    assert answer.belief.spread == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("sense", ["sound", "touch"])
def test_the_card_says_what_was_held_out_and_the_network_is_better_than_a_constant(sense: str) -> None:
    card = shipped(sense).card
    held = card["held_out"]
    assert isinstance(held, dict)
    assert held["samples"] > 1000
    assert held["mean_error_cm"] < 0.6 * held["constant_mean_error_cm"]
    assert 0.85 <= held["held_90"] <= 0.95


def test_touch_of_new_shapes_is_as_good_as_its_card_says() -> None:
    random = np.random.default_rng(4711)
    errors, within = [], []
    for family in ("cup", "bowl", "tray", "bar", "block", "pot", "jug", "pan"):
        shape = TouchableShape.of(draw(family, random))
        for size in (0.08, 0.16, 0.3):
            made: list[GelWay] = []
            while sum(way.normal is not None for way in made) < 6:
                made = contact_sample(shape, size, random)
            belief, _ = by_ways(made, RANGE)
            low, high = belief.interval
            errors.append(abs(belief.size - size))
            within.append(low <= size <= high)
    assert float(np.mean(errors)) < 0.035
    assert sum(within) >= 18
