"""A hammer's blow from its samples: laws on pulses known in closed form, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.strikes.frequency_response import measure_blow

RATE = 25600.0
SAMPLES = 2000


def bell(peak: float, centre: float, deviation: float) -> FloatArray:
    """A bell of ``deviation`` samples: at 1.5 and more, all but 1e-5 of it is below half the rate."""
    return np.asarray(peak * np.exp(-0.5 * ((np.arange(SAMPLES) - centre) / deviation) ** 2))


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 200.0), st.floats(100.0, 101.0), st.floats(1.5, 8.0), st.floats(-3.0, 3.0))
def test_a_bell_is_measured_wherever_it_lies_between_the_samples(
    peak: float, centre: float, deviation: float, rest: float
) -> None:
    blow = measure_blow(bell(peak, centre, deviation) + rest, RATE)
    half, tenth = (2.0 * deviation * np.sqrt(2.0 * np.log(1.0 / level)) / RATE for level in (0.5, 0.1))
    assert blow.peak == pytest.approx(peak, rel=1e-3)
    assert blow.impulse == pytest.approx(peak * deviation * np.sqrt(2.0 * np.pi) / RATE, rel=1e-4)
    assert blow.width == pytest.approx(half, rel=2e-3)
    assert blow.duration == pytest.approx(tenth, rel=2e-3)
    assert blow.start == pytest.approx(centre / RATE - 0.5 * tenth, abs=2e-3 * tenth)
    assert blow.rest == pytest.approx(rest, abs=1e-12)
    assert blow.touches == 1


def test_sigmas_are_those_of_the_noise() -> None:
    """Two hundred noisy blows: scatter over what is stated is one, to 10 %."""
    random = np.random.default_rng(0)
    blows = [
        measure_blow(bell(50.0, 100.4, 2.0) + 0.1 * random.normal(size=SAMPLES), RATE) for _ in range(200)
    ]
    for name in ("impulse", "duration"):
        values = [vars(blow)[name] for blow in blows]
        stated = np.mean([vars(blow)[f"{name}_sigma"] for blow in blows])
        assert np.std(values) / stated == pytest.approx(1.0, abs=0.15), name
    assert np.std([blow.peak for blow in blows]) < 1.1 * blows[0].peak_sigma
    assert blows[0].noise == pytest.approx(0.1, rel=0.1)


def test_twice_the_force_is_twice_the_blow() -> None:
    random = np.random.default_rng(1)
    force = bell(50.0, 100.4, 2.0) + 0.1 * random.normal(size=SAMPLES)
    once, twice = measure_blow(force, RATE), measure_blow(2.0 * force, RATE)
    assert (twice.peak, twice.impulse) == pytest.approx((2.0 * once.peak, 2.0 * once.impulse), rel=1e-12)
    assert (twice.duration, twice.width) == pytest.approx((once.duration, once.width), rel=1e-9)


def test_half_the_digits_give_the_same_blow() -> None:
    force = bell(50.0, 100.4, 2.0)
    exact, coarse = measure_blow(force, RATE), measure_blow(force.astype(np.float32), RATE)
    assert coarse.peak == pytest.approx(exact.peak, rel=1e-6)
    assert coarse.duration == pytest.approx(exact.duration, rel=1e-5)


@pytest.mark.parametrize(("share", "touches"), [(0.5, 2), (0.06, 2), (0.03, 1)])
def test_a_second_hit_counts_from_a_twentieth_of_the_first(share: float, touches: int) -> None:
    force = bell(60.0, 100.0, 2.0) + bell(60.0 * share, 400.0, 2.0)
    blow = measure_blow(force, RATE)
    assert blow.touches == touches
    assert blow.double_hit == (touches > 1)


def test_a_blow_beyond_the_range_is_flagged() -> None:
    random = np.random.default_rng(3)
    force = bell(50.0, 100.4, 3.0) + 0.1 * random.normal(size=SAMPLES)
    assert not measure_blow(force, RATE).clipped
    assert not measure_blow(np.round(force / 0.014) * 0.014, RATE).clipped
    assert measure_blow(np.minimum(force, 40.0), RATE).clipped


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (np.zeros(SAMPLES), "no blow"),
        (np.random.default_rng(2).normal(size=SAMPLES), "no blow"),
        (bell(50.0, 1.0, 2.0), "cut off"),
        (bell(50.0, SAMPLES - 2.0, 2.0), "cut off"),
        (np.where(np.arange(SAMPLES) == 500, np.nan, bell(50.0, 100.0, 2.0)), "finite"),
        (bell(50.0, 20.0, 2.0)[:40], "at rest"),
        (np.ones((2, SAMPLES)), "shape"),
    ],
)
def test_what_is_no_blow_is_refused(force: FloatArray, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        measure_blow(force, RATE)


def test_a_level_or_a_rate_that_cannot_be_is_refused() -> None:
    with pytest.raises(WrongUse):
        measure_blow(bell(50.0, 100.0, 2.0), RATE, level=0.6)
    with pytest.raises(WrongUse):
        measure_blow(bell(50.0, 100.0, 2.0), 0.0)
