"""A clock from arrivals that are late by chance, and never early."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.bench.clock_fit import ArrivalClock

NOMINAL = 50e3


def arrivals(ppm: float, seconds: float, seed: int) -> ArrivalClock:
    rng = np.random.default_rng(seed)
    clock = ArrivalClock(NOMINAL)
    rate = NOMINAL * (1.0 + ppm * 1e-6)
    samples = np.arange(128, seconds * rate, 128).astype(np.int64)
    times = (
        1000.0
        + samples / rate
        + rng.exponential(0.5e-3, len(samples))
        + 0.2 * (rng.random(len(samples)) < 1e-3)
    )
    for sample, time in zip(samples, np.maximum.accumulate(times), strict=True):
        clock.arrived(int(sample), float(time))
    return clock


@settings(deadline=None, max_examples=20)
@given(st.floats(-100.0, 100.0), st.integers(0, 2**31))
def test_the_crystals_drift_is_found(ppm: float, seed: int) -> None:
    fit = arrivals(ppm, 20.0, seed).fit()
    # The quickest of 40 arrivals in a bucket is 12 us late in the mean; 0.2 ms over 20 s are 10 ppm.
    assert fit.rate / NOMINAL - 1.0 == pytest.approx(ppm * 1e-6, abs=10e-6)
    assert abs(fit.time(0.0) - 1000.0) < 1e-4
    assert fit.residual < 1e-4


def test_the_clock_never_runs_ahead_of_an_arrival_it_was_fitted_to() -> None:
    fit = arrivals(30.0, 10.0, 1).fit()
    assert np.all(fit.arrivals >= fit.start + fit.samples / fit.rate - 1e-12)


def test_hours_keep_only_the_newest_minutes() -> None:
    clock = ArrivalClock(NOMINAL)
    for second in range(7200):
        clock.arrived(second * 50_000, 5.0 + second)
    assert len(clock.fit().samples) == 600
    assert clock.fit().time(7199 * 50_000) == pytest.approx(5.0 + 7199, abs=1e-6)


def test_a_moment_makes_no_clock() -> None:
    clock = ArrivalClock(NOMINAL)
    clock.arrived(100, 1.0)
    with pytest.raises(ValueError, match="arrivals"):
        clock.fit()
