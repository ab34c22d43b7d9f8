"""Strikes on clocks that wander: found together by their sounds, whatever the signs and the latency."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.bench.acquisition import Strike
from harness.recording.observation import REACH, synchronised
from tests.support.heard_strikes import delay

RATE, ONSET = 50e3, 1000
FREQUENCIES = np.array([1130.0, 1820.0, 2530.0, 3170.0, 4410.0, 5230.0, 6070.0, 7310.0])
PULSE = np.sin(np.pi * np.arange(12) / 12)
OPENED = 7.0


def strike(gains: FloatArray, late: float, seed: int, noise: float = 1e-3, latency: float = 1e-3) -> Strike:
    """A blow on modes of these gains, heard ``latency + late`` s later by a room with phases of its own."""
    rng = np.random.default_rng(seed)
    times = np.arange(20000) / RATE
    after = times - ONSET / RATE - latency - late
    phases = 0.7 * np.arange(len(FREQUENCIES))
    modes = np.exp(-np.maximum(after, 0.0)[:, None] * (15.0 + 0.004 * FREQUENCIES))
    waves = np.sin(2 * np.pi * np.outer(after, FREQUENCIES) + phases)
    # The blow of a dozen samples hardly filters what rings below 8 kHz; it begins at rest.
    begins = np.clip(after * RATE / 12, 0.0, 1.0)
    pressure = (modes * waves) @ gains * begins + noise * rng.standard_normal(len(times))
    force = np.zeros(len(times))
    force[ONSET : ONSET + 12] = 50.0 * PULSE
    return Strike(RATE, force, pressure, ONSET, 0.0, False, False, False, "", 1e-6, OPENED)


def gains_of(seed: int, count: int) -> FloatArray:
    drawn = np.random.default_rng(seed).standard_normal((count, len(FREQUENCIES)))
    return np.asarray(np.sign(drawn) * np.clip(np.abs(drawn), 0.3, None))


def struck(count: int, seed: int, spread: float, noise: float = 1e-3) -> tuple[list[Strike], FloatArray]:
    late = np.clip(np.random.default_rng(seed + 1).normal(0.0, spread, count), -0.4 * REACH, 0.4 * REACH)
    gains = gains_of(seed, count)
    return [strike(g, t, seed + k, noise) for k, (g, t) in enumerate(zip(gains, late, strict=True))], late


def shift(before: Strike, after: Strike) -> float:
    return delay(before, after)[0]


def left_over(strikes: list[Strike], late: FloatArray) -> FloatArray:
    """Seconds by which those that are not refused still differ from the middle one of them."""
    pairs = list(zip(strikes, synchronised(strikes), late, strict=True))
    left = [t + shift(before, after) for before, after, t in pairs if after is not None and not after.fault]
    return np.array(left) - np.median(left) if left else np.zeros(0)


@pytest.mark.slow  # many drawn cases of a statistic
@settings(deadline=None, max_examples=8)
@given(st.integers(2, 6), st.integers(0, 10_000))
def test_what_is_not_refused_is_brought_together(count: int, seed: int) -> None:
    assert np.abs(left_over(*struck(count, seed, 60e-6))).max(initial=0.0) < 5e-6


@pytest.mark.slow  # many drawn cases of a statistic
def test_few_are_refused_where_resonances_are_apart() -> None:
    known = [len(left_over(*struck(5, seed, 60e-6))) for seed in range(4)]
    assert sum(known) >= 18


@settings(deadline=None, max_examples=3)
@given(st.integers(0, 10_000))
def test_what_is_in_time_stays_where_it_is(seed: int) -> None:
    strikes, late = struck(4, seed, 0.0)
    assert np.abs(left_over(strikes, late)).max(initial=0.0) < 3e-6


def test_signs_are_left_alone() -> None:
    first, second = (strike(sign * np.ones(len(FREQUENCIES)), 0.0, 1) for sign in (1.0, -1.0))
    moved = synchronised([first, second])
    assert moved[0] is not None
    assert moved[1] is not None
    together = float(moved[0].pressure @ moved[1].pressure)
    assert together < -0.99 * np.linalg.norm(moved[0].pressure) * np.linalg.norm(moved[1].pressure)


def test_strikes_of_one_clock_and_missing_ones_are_as_they_were() -> None:
    strikes, _ = struck(3, 5, 50e-6)
    on_box = [replace(one, opened=None, jitter=0.0) for one in strikes]
    given_back = synchronised([*on_box, None])
    assert all(a is b for a, b in zip(given_back, [*on_box, None], strict=True))
    alone = [strikes[0], None, replace(strikes[1], silent=True)]
    assert all(a is b for a, b in zip(synchronised(alone), alone, strict=True))
    assert synchronised([]) == ()


def test_one_that_sounds_like_nothing_is_marked_and_the_others_are_used() -> None:
    strikes, _ = struck(4, 9, 40e-6)
    noise = np.random.default_rng(3).standard_normal(len(strikes[0].pressure))
    found = synchronised([*strikes, replace(strikes[0], pressure=noise)])
    faults = [one.fault for one in found if one is not None]
    assert [bool(fault) for fault in faults] == [False] * 4 + [True]


@pytest.mark.parametrize("count", [2, 5])
def test_silence_is_brought_together_with_nothing(count: int) -> None:
    strikes, _ = struck(count, 2, 40e-6)
    quiet = [replace(one, pressure=np.zeros(len(one.pressure))) for one in strikes]
    for one in synchronised(quiet):
        assert one is not None
        assert "time" in one.fault
        assert np.all(np.isfinite(one.pressure))
