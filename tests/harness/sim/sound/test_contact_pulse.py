"""A hammer's blow: against the equation of impact, closed forms, and finely sampled forces."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.special import betainc

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.sim.modal.modes import dampings
from harness.sim.sound.contact_pulse import DURATION, Hammer, HertzPulse, hertz_pulse, struck
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.synthesis import SynthesisLevel

RATE = 44.1e3
STEEL = Hammer(radius=5e-3, young=2.0e11, poisson=0.29, mass=0.01)
NYLON = Hammer(radius=8e-3, young=2.5e9, poisson=0.4, mass=0.05)
"""Of soft tip: about half a millisecond."""


def blow(hammer: Hammer = STEEL, speed: float = 0.5) -> HertzPulse:
    return hertz_pulse(hammer, speed, MATERIALS["ceramic"])


@pytest.mark.parametrize(("hammer", "speed"), [(STEEL, 0.5), (NYLON, 1.5)])
def test_the_force_solves_the_equation_of_impact(hammer: Hammer, speed: float) -> None:
    """``m x'' = -K x^(3/2)`` from touch to parting, the stiffness written out anew."""
    ceramic = MATERIALS["ceramic"]
    compliance = (1.0 - hammer.poisson**2) / hammer.young + (1.0 - ceramic.poisson**2) / ceramic.young
    stiffness = 4.0 / 3.0 / compliance * math.sqrt(hammer.radius)
    pulse = blow(hammer, speed)

    def rhs(_t: float, state: FloatArray) -> list[float]:
        return [state[1], -stiffness * max(state[0], 0.0) ** 1.5 / hammer.mass]

    times = np.linspace(0.0, pulse.duration, 400)
    solved = solve_ivp(
        rhs,
        (0.0, pulse.duration),
        [0.0, speed],
        "DOP853",
        times,
        rtol=1e-11,
        atol=1e-16,
        max_step=pulse.duration / 200.0,
    )
    force = stiffness * np.maximum(solved.y[0], 0.0) ** 1.5
    assert np.abs(pulse.force(times) - force).max() < 1e-6 * pulse.peak
    assert np.abs(pulse.delivered(times) - hammer.mass * (speed - solved.y[1])).max() < 1e-6 * pulse.impulse
    assert solved.y[0].max() == pytest.approx(pulse.approach, rel=1e-4)
    assert solved.y[1][-1] == pytest.approx(-speed, rel=1e-6)


@given(st.floats(1e-3, 0.05), st.floats(1e7, 4e11), st.floats(1e-3, 1.0), st.floats(0.01, 5.0))
def test_duration_peak_and_impulse_obey_their_closed_forms(
    radius: float, young: float, mass: float, speed: float
) -> None:
    """Johnson, Contact Mechanics, equation 11.24: ``2.87 (m^2 / (R E*^2 V))^(1/5)``; energy and impulse."""
    hammer, glass = Hammer(radius, young, 0.3, mass), MATERIALS["glass"]
    pulse = hertz_pulse(hammer, speed, glass)
    modulus = 1.0 / ((1.0 - 0.3**2) / young + (1.0 - glass.poisson**2) / glass.young)
    assert pulse.duration == pytest.approx(2.87 * (mass**2 / (radius * modulus**2 * speed)) ** 0.2, rel=1e-3)
    assert pulse.impulse == pytest.approx(2.0 * mass * speed)
    assert 0.4 * pulse.peak * pulse.approach == pytest.approx(0.5 * mass * speed**2)
    harder = hertz_pulse(hammer, 2.0 * speed, glass)
    assert harder.duration / pulse.duration == pytest.approx(2.0**-0.2)
    assert harder.peak / pulse.peak == pytest.approx(2.0**1.2)


def test_curvature_and_a_free_object_enter_as_in_series() -> None:
    ceramic = MATERIALS["ceramic"]
    ball = hertz_pulse(STEEL, 0.5, ceramic, curvature=1.0 / STEEL.radius)
    assert ball == hertz_pulse(Hammer(2.5e-3, 2.0e11, 0.29, 0.01), 0.5, ceramic)
    light = hertz_pulse(STEEL, 0.5, ceramic, mass=0.01)
    halved = hertz_pulse(Hammer(5e-3, 2.0e11, 0.29, 0.005), 0.5, ceramic)
    assert light.impulse == pytest.approx(halved.impulse)
    assert light.duration == pytest.approx(halved.duration)


@given(st.floats(1e3, 1e6), st.sampled_from([STEEL, NYLON]))
def test_samples_hold_the_whole_impulse_and_its_time(rate: float, hammer: Hammer) -> None:
    pulse = blow(hammer)
    samples = pulse.sampled(rate)
    assert samples.sum() / rate == pytest.approx(pulse.impulse, rel=1e-12)
    assert (samples >= 0.0).all()
    middle = samples @ np.arange(len(samples)) / samples.sum() / rate
    assert abs(middle - 0.5 * pulse.duration) <= 0.5 / rate
    assert (pulse.force(np.array([-1e-6, pulse.duration + 1e-6])) == 0.0).all()


@pytest.mark.parametrize(
    ("hammer", "level"), [(STEEL, "fast"), (STEEL, "double"), (NYLON, "fast"), (NYLON, "double")]
)
def test_a_struck_sound_is_that_of_the_force_finely_sampled(hammer: Hammer, level: SynthesisLevel) -> None:
    """Every mode, some near and beyond critical damping, against ``ring`` at 64 times the rate."""
    random = np.random.default_rng(1)
    frequencies = np.sort(random.uniform(100.0, 22e3, 40))
    decays = dampings(frequencies, MATERIALS["plastic"])
    decays[[5, 20, 30]] = 2.0 * np.pi * frequencies[[5, 20, 30]] * np.array([0.7, 1.0, 3.0])
    amplitudes = random.standard_normal((2, 40))
    pulse = blow(hammer)
    found = struck(frequencies, decays, amplitudes, pulse, 0.05, RATE, level)
    finer = 64
    force = np.zeros((2, finer * found.sound.shape[1]))
    samples = pulse.sampled(finer * RATE)
    force[:, : len(samples)] = samples
    expected = ring(frequencies, decays, amplitudes, force, finer * RATE)[:, ::finer]
    # Means over a sample soften the highest mode by its angle in half a sample, squared, over six: 1e-4.
    assert np.abs(found.sound - expected).max() < 2e-4 * np.abs(expected).max()
    assert found.error < -100.0
    assert (found.sound[:, 0] == 0.0).all()


def test_a_struck_sound_goes_over_into_an_impulse_as_the_contact_shortens() -> None:
    frequencies, decays = np.array([300.0, 2000.0]), np.array([5.0, 20.0])
    amplitudes = np.ones((1, 2))
    short = HertzPulse(duration=1e-9, peak=0.625 * DURATION / 1e-9, impulse=1.0, approach=1e-9)
    found = struck(frequencies, decays, amplitudes, short, 0.1, RATE, "double").sound
    force = np.zeros((1, found.shape[1]))
    force[0, 0] = RATE
    expected = ring(frequencies, decays, amplitudes, force, RATE)
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()


def test_modes_above_half_the_rate_and_impossible_blows_are_refused_or_named() -> None:
    frequencies, decays = np.array([300.0, 30e3]), np.array([5.0, 20.0])
    found = struck(frequencies, decays, np.ones((1, 2)), blow(), 0.1, RATE)
    assert found.left_out.tolist() == [False, True]
    assert found.sound.shape == (1, 4410)
    with pytest.raises(WrongUse, match=r" s .*contact .* s"):
        struck(frequencies, decays, np.ones((1, 2)), blow(NYLON), 1e-4, RATE)
    with pytest.raises(WrongUse, match="amplitudes"):
        struck(frequencies, decays, np.ones((1, 2)) * 1j, blow(), 0.1, RATE)
    with pytest.raises(WrongUse, match=r"radius .* m .* m"):
        hertz_pulse(STEEL, 0.5, MATERIALS["steel"], curvature=-250.0)
    with pytest.raises(WrongUse, match=r"speed .*0 m/s"):
        hertz_pulse(STEEL, 0.0, MATERIALS["steel"])
    with pytest.raises(WrongUse, match=r"radius .*nan m"):
        hertz_pulse(Hammer(math.nan, 1e9, 0.3, 0.1), 1.0, MATERIALS["steel"])


@pytest.mark.parametrize("hit", [1, 2, 3])
def test_a_real_hit_has_the_height_and_spectrum_of_hertz_pulse(shared_data: Path, hit: int) -> None:
    """An instrumented hammer: its impulse and width at half height give Hertz's peak and spectrum.

    The real pulse falls more slowly than it rises, its tip gives heat; its peak is within 5 %
    and its spectrum within 1 dB up to 3 kHz.
    """
    times, force, _ = np.load(shared_data / "vibration" / "pyfrf_hammer" / f"measurement_{hit}.npy")
    rate = 1.0 / float(np.median(np.diff(times)))
    first, last = np.flatnonzero(force > 0.02 * force.max())[[0, -1]]
    blow = force[first - 1 : last + 2]
    above = np.interp(np.arange(0.0, len(blow) - 1, 1e-3), np.arange(len(blow)), blow) > 0.5 * blow.max()
    width = np.count_nonzero(above) * 1e-3 / rate
    impulse = float(blow.sum() / rate)
    duration = width / (1.0 - betainc(0.4, 0.5, 0.5 ** (1.0 / 0.6)))
    pulse = HertzPulse(duration, 0.625 * DURATION * impulse / duration, impulse, math.nan)
    assert pulse.peak == pytest.approx(blow.max(), rel=0.06)
    tones = np.arange(0.0, 3000.0, 50.0)
    real = np.abs(np.exp(-2j * np.pi * np.outer(tones, np.arange(len(blow)) / rate)) @ blow)
    samples = pulse.sampled(rate)
    hertz = np.abs(np.exp(-2j * np.pi * np.outer(tones, np.arange(len(samples)) / rate)) @ samples)
    assert np.abs(20.0 * np.log10(hertz / real)).max() < 1.0
