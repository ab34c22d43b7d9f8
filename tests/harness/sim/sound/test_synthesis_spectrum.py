"""Sums by their spectrum: beside the sum of sines, for any slow decay, and no worse than they say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import AnyArray, FloatArray
from harness.sim.sound import synthesis_tables
from harness.sim.sound.synthesis import synthesize
from harness.sim.sound.synthesis_tables import MOST_DECAY, STRETCH, add_modes, may_be_added

RATE = 44.1e3


def summed(
    dampings: FloatArray, turns: FloatArray, weights: AnyArray, begin: int, end: int, rate: float = RATE
) -> FloatArray:
    """Samples from one to another, every sine by itself."""
    at = np.arange(begin, end)
    sound = np.zeros(len(at))
    for damping, turn, weight in zip(dampings, turns, weights, strict=True):
        angle = turn * at
        sound += np.imag(weight * np.exp(-damping * at / rate + 2j * np.pi * (angle - np.rint(angle))))
    return sound


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.integers(4096, 5 * STRETCH))
def test_it_is_the_sum_of_the_sines_to_what_it_says(seed: int, modes: int, samples: int) -> None:
    """Of any frequency, the lowest and the highest among them, and any decay that it takes."""
    random = np.random.default_rng(seed)
    turns = np.where(random.random(modes) < 0.8, random.random(modes), random.choice([1e-6, 1.0], modes))
    turns *= 0.5 * (1.0 - 1e-9)
    dampings = random.choice([0.0, 1.0], modes) * random.uniform(0.0, 0.95, modes)
    dampings *= MOST_DECAY * RATE / min(samples, 1.5 * STRETCH)
    assert may_be_added(dampings, samples, RATE).all()
    weights = random.standard_normal(modes) + 1j * random.standard_normal(modes)
    before = random.standard_normal(samples)
    sound = before.copy()
    stated = add_modes(dampings, turns, weights, RATE, sound)
    error = np.abs(sound - before - summed(dampings, turns, weights, 0, samples)).max()
    assert error <= stated < 1e-8 * np.abs(weights).sum()


def test_a_minute_later_phases_are_as_good() -> None:
    random = np.random.default_rng(4)
    turns, weights = random.uniform(0.0, 0.5, 20), random.standard_normal(20) + 0j
    dampings = np.full(20, 0.05)
    sound = np.zeros(60 * 44_100)
    stated = add_modes(dampings, turns, weights, RATE, sound)
    last = summed(dampings, turns, weights, len(sound) - 3000, len(sound))
    assert np.abs(sound[-3000:] - last).max() <= stated


def test_only_what_dies_slowly_may_be_added() -> None:
    fastest = MOST_DECAY * RATE / STRETCH
    assert may_be_added(np.array([0.0, 0.9, 1.1]) * fastest, 8 * STRETCH, RATE).tolist() == [
        True,
        True,
        False,
    ]


@pytest.mark.parametrize("modes", [300, 700])
def test_many_modes_that_last_are_summed_so_beside_those_that_do_not(
    modes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(modes)
    frequencies = np.sort(random.uniform(200.0, 20e3, modes))
    dampings = np.where(np.arange(modes) % 3 == 0, random.uniform(30.0, 900.0, modes), 0.5)
    amplitudes = random.standard_normal((2, modes))
    added: list[int] = []

    def counted(
        lasting: FloatArray, turns: FloatArray, weights: AnyArray, rate: float, sound: FloatArray
    ) -> float:
        added.append(len(lasting))
        return add_modes(lasting, turns, weights, rate, sound)

    monkeypatch.setattr(synthesis_tables, "add_modes", counted)
    found, exact = (
        synthesize(frequencies, dampings, amplitudes, 0.6, RATE, way) for way in ("fast", "exact")
    )
    assert added == [modes - -(-modes // 3)] * 2, "once for each of both sounds"
    error = np.abs(found.sound - exact.sound).max(axis=1) / np.abs(exact.sound).max(axis=1)
    assert 20.0 * np.log10(error.max()) < found.error < -115.0


def test_few_modes_short_sounds_and_double_precision_stay_with_tables(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(*_: object) -> float:
        raise AssertionError("summed by its spectrum")

    monkeypatch.setattr(synthesis_tables, "add_modes", never)
    random = np.random.default_rng(1)
    frequencies, ones = np.sort(random.uniform(200.0, 20e3, 400)), np.ones((1, 400))
    slow = np.full(400, 0.5)
    synthesize(frequencies[:100], slow[:100], ones[:, :100], 0.5, RATE)
    synthesize(frequencies, slow, ones, 0.05, RATE)
    synthesize(frequencies, slow, ones, 0.2, RATE, "double")
    with pytest.raises(AssertionError, match="spectrum"):
        synthesize(frequencies, slow, ones, 0.2, RATE)
