"""Band-limited values between samples: against sines, whose values are known everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.resampling import HALF_WIDTH, resample

RATE = 50e3


@settings(deadline=None)
@given(st.floats(0.0, 0.44), st.floats(0.0, 1.0), st.floats(0.0, 6.3))
def test_a_sine_is_known_between_its_samples(frequency: float, fraction: float, phase: float) -> None:
    n = np.arange(400)
    at: FloatArray = np.arange(HALF_WIDTH, 400 - HALF_WIDTH - 1, dtype=np.float64) + fraction
    values = resample(np.sin(2 * np.pi * frequency * n + phase), 5.0, RATE, 5.0 + at / RATE, RATE)
    # 100 dB of the window, and 120 dB of interpolating between 1024 tabulated fractions.
    assert np.abs(values - np.sin(2 * np.pi * frequency * at + phase)).max() < 2e-5


def test_at_its_own_times_a_signal_is_itself() -> None:
    x = np.random.default_rng(0).normal(size=300)
    assert np.abs(resample(x, 0.0, RATE, np.arange(300) / RATE, RATE) - x).max() < 1e-5


def test_what_a_lower_rate_cannot_hold_is_filtered_out() -> None:
    n = np.arange(4000)
    at: FloatArray = np.arange(100, 1900, dtype=np.float64) * 2.0
    low, high = np.sin(0.1 * 2 * np.pi * n), np.sin(0.35 * 2 * np.pi * n)
    values = resample(low + high, 0.0, RATE, at / RATE, RATE / 2)
    assert np.abs(values - np.sin(0.1 * 2 * np.pi * at)).max() < 1e-4


def test_a_constant_stays_one_to_the_ends() -> None:
    values = resample(np.full(100, 3.0), 0.0, RATE, np.linspace(0.0, 99.0, 777) / RATE, RATE)
    assert np.abs(values - 3.0).max() < 1e-12


@pytest.mark.parametrize("at", [-0.5, 99.5])
def test_times_without_samples_are_refused(at: float) -> None:
    with pytest.raises(ValueError, match="100 samples"):
        resample(np.zeros(100), 0.0, RATE, np.array([at / RATE]), RATE)
