"""Sounds on which a plain sum of sines fails: too damped, too high, too long, too quiet."""

import mpmath
import numpy as np
import pytest

from harness.basics.materials import Material
from harness.sim.modal.modes import dampings
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.synthesis import SynthesisLevel, synthesize

RATE = 44.1e3
LEVELS: tuple[SynthesisLevel, ...] = ("fast", "double", "exact")


@pytest.mark.parametrize("level", LEVELS)
def test_sounds_are_continuous_through_critical_damping(level: SynthesisLevel) -> None:
    omega = 2.0 * np.pi * 500.0
    ratios = np.array([1 - 1e-6, 1 - 1e-9, 1.0, 1 + 1e-9, 1 + 1e-6])
    found = [
        synthesize(np.array([500.0]), np.array([omega * ratio]), np.ones((1, 1)), 0.05, RATE, level).sound[0]
        for ratio in ratios
    ]
    times = np.arange(len(found[0])) / RATE
    assert np.abs(found[2] - omega * times * np.exp(-omega * times)).max() < 1e-12
    for ratio, each in zip(ratios, found, strict=True):
        assert np.abs(each - found[2]).max() <= 2.0 * abs(ratio - 1.0) + 1e-12


@pytest.mark.parametrize("level", LEVELS)
def test_sounds_are_continuous_from_one_kernel_to_the_other(level: SynthesisLevel) -> None:
    """Modes damped by more than half of critical are summed one by one."""
    omega = 2.0 * np.pi * 2000.0
    below, above = (
        synthesize(np.array([2000.0]), np.array([omega * ratio]), np.ones((1, 1)), 0.02, RATE, level).sound
        for ratio in (0.5 - 1e-9, 0.5 + 1e-9)
    )
    assert np.abs(below - above).max() < (1e-6 if level == "fast" else 1e-8)


@pytest.mark.parametrize("level", LEVELS)
def test_a_rubber_creeps_back_and_poisons_no_other_mode(level: SynthesisLevel) -> None:
    """Above 3.2 kHz its modes are damped beyond critical; the root of a negative number is not a number."""
    rubber = Material("rubber", 1100.0, 1e7, 0.49, 10.0, 1e-4)
    frequencies = np.array([200.0, 3183.0, 3200.0, 9000.0, 20e3])
    decays = dampings(frequencies, rubber)
    assert (decays[2:] > 2.0 * np.pi * frequencies[2:]).all()
    amplitudes = np.ones((1, 5))
    found = synthesize(frequencies, decays, amplitudes, 1.0, RATE, level).sound
    assert np.isfinite(found).all()
    force = np.zeros((1, 44_100))
    force[0, 0] = RATE
    assert np.abs(found - ring(frequencies, decays, amplitudes, force, RATE)).max() < 1e-5
    with mpmath.workdps(50):
        w, d = 2 * mpmath.pi * 20000, mpmath.mpf(float(decays[4]))
        split = mpmath.sqrt(d**2 - w**2)
        for sample in (1, 10, 3000):
            t = mpmath.mpf(sample) / 44100
            expected = w / split * mpmath.exp(-d * t) * mpmath.sinh(split * t)
            alone = synthesize(frequencies[4:], decays[4:], np.ones((1, 1)), 0.1, RATE, level).sound[
                0, sample
            ]
            assert alone == pytest.approx(float(expected), rel=1e-9, abs=1e-30)


@pytest.mark.parametrize("level", LEVELS)
def test_modes_at_and_above_half_the_rate_are_left_out_and_said_so(level: SynthesisLevel) -> None:
    frequencies = np.array([1000.0, 22_049.0, 22_050.0, 30e3])
    found = synthesize(frequencies, np.full(4, 5.0), np.ones((1, 4)), 0.2, RATE, level)
    assert found.left_out.tolist() == [False, False, True, True]
    only = synthesize(frequencies[:2], np.full(2, 5.0), np.ones((1, 2)), 0.2, RATE, level)
    assert (found.sound == only.sound).all()
    none = synthesize(frequencies[2:], np.full(2, 5.0), np.ones((1, 2)), 0.2, RATE, level)
    assert none.left_out.all()
    assert not none.sound.any()


@pytest.mark.parametrize("level", LEVELS)
def test_no_force_is_exact_silence_beside_a_sound(level: SynthesisLevel) -> None:
    frequencies, decays = np.array([300.0, 5000.0]), np.array([5.0, 50.0])
    found = synthesize(frequencies, decays, np.array([[0.0, 0.0], [1.0, 0.0]]), 0.5, RATE, level)
    assert (found.sound[0] == 0.0).all()
    assert found.sound[1].any()
    silent = synthesize(frequencies, decays, np.zeros((1, 2)), 0.5, RATE, level)
    assert (silent.sound == 0.0).all()
    assert silent.error == float("-inf")
    empty = synthesize(np.zeros(0), np.zeros(0), np.zeros((1, 0)), 0.5, RATE, level)
    assert empty.sound.shape == (1, 22_050)
    assert (empty.sound == 0.0).all()


@pytest.mark.parametrize("level", ["fast", "double"])
def test_the_phase_is_right_after_a_minute(level: SynthesisLevel) -> None:
    frequency, decay, samples = 19_999.3, 0.01, int(60 * RATE)
    found = synthesize(np.array([frequency]), np.array([decay]), np.ones((1, 1)), 60.0, RATE, level).sound[0]
    at = np.arange(samples - 200, samples)
    with mpmath.workdps(40):
        w, d = 2 * mpmath.pi * mpmath.mpf(frequency), mpmath.mpf(decay)
        split = mpmath.sqrt(w**2 - d**2)
        ends = [mpmath.mpf(int(k)) / 44100 for k in at]
        exact = np.array([float(w / split * mpmath.exp(-d * t) * mpmath.sin(split * t)) for t in ends])
    assert np.abs(found[at] - exact).max() < (3e-7 if level == "fast" else 1e-8)
    times = (at / RATE).astype(np.float32)
    single = np.exp(np.float32(-decay) * times) * np.sin(np.float32(2.0 * np.pi * frequency) * times)
    assert np.abs(single - exact).max() > 0.1


@pytest.mark.parametrize(("level", "kind"), [("fast", np.float32), ("double", np.float64)])
@pytest.mark.parametrize("loudness", [1e-100, 1e-40, 1.0, 1e40])
def test_no_sample_is_subnormal(level: SynthesisLevel, kind: type, loudness: float) -> None:
    """Numbers too small for their full digits are ten times as slow; dead modes are made of them."""
    random = np.random.default_rng(4)
    frequencies = random.uniform(100.0, 20e3, 100)
    decays = 10.0 ** random.uniform(0.0, 4.5, 100)
    amplitudes = loudness * 10.0 ** random.uniform(-14.0, 0.0, (1, 100))
    found = synthesize(frequencies, decays, amplitudes, 1.0, RATE, level).sound
    sounding = np.abs(found[found != 0.0])
    assert sounding.size > 1000
    assert sounding.min() >= np.finfo(np.float64).tiny
    assert (sounding / loudness).min() >= np.finfo(kind).tiny
