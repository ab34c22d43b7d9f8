"""Struck modes: against an ordinary differential equation, many digits, and the laws of sums."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.sim.modal.modal import solve_modes
from harness.sim.sound.modal_sound import (
    AIR_DENSITY,
    SPEED_OF_SOUND,
    audible,
    impulse_response,
    radiation,
    ring,
)
from harness.sim.sound.room import MicrophoneResponse, as_heard, reverberated, room_response
from tests.oracles.volume_meshes import ball
from tests.samples.blows import half_sine

RATE = 48e3


def one(value: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([value])


def blow(samples: int, at: int = 0) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    force = np.zeros((1, samples))
    force[0, at] = RATE
    return force


@pytest.mark.parametrize("damping", [30.0, 3000.0, 6283.0, 6283.2, 9000.0, 2e5])
def test_a_mode_answers_as_its_equation_of_motion_says(damping: float) -> None:
    """``q'' + 2 d q' + w^2 q = F``, whose answer times ``w`` is the mode's; force a half sine."""
    omega, duration = 2.0 * np.pi * 1000.0, 1e-3
    rate = 768e3
    times = np.arange(4000) / rate

    def rhs(t: float, q: FloatArray) -> list[float]:
        pushed = np.sin(np.pi * t / duration) if t < duration else 0.0
        return [q[1], pushed - 2.0 * damping * q[1] - omega**2 * q[0]]

    solved = solve_ivp(
        rhs, (0.0, float(times[-1])), np.zeros(2), "LSODA", times, rtol=1e-10, atol=1e-16, max_step=2e-5
    )
    force = np.zeros((1, len(times)))
    pulse = half_sine(rate, duration, 1.0)
    force[0, : len(pulse)] = pulse
    rung = ring(one(1000.0), one(damping), np.ones((1, 1)), force, rate)[0]
    expected = omega * solved.y[0]
    # The force's samples are impulses: the trapezoid rule, whose error is of second order.
    assert np.abs(rung - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("frequency", [55.0, 5000.0, 19999.0])
def test_the_phase_is_exact_after_a_minute(frequency: float) -> None:
    samples = int(60 * RATE)
    rung = ring(one(frequency), one(0.01), np.ones((1, 1)), blow(samples), RATE)[0]
    mpmath.mp.dps = 40
    for at in (1, 1000, samples // 2, samples - 1):
        t, omega = mpmath.mpf(at) / mpmath.mpf(RATE), 2 * mpmath.pi * mpmath.mpf(frequency)
        split = mpmath.sqrt(omega**2 - mpmath.mpf(0.01) ** 2)
        exact = omega / split * mpmath.exp(-mpmath.mpf(0.01) * t) * mpmath.sin(split * t)
        assert rung[at] == pytest.approx(float(exact), abs=2e-8)


def test_single_precision_would_lose_the_phase() -> None:
    """Why the sums are in double precision: the same sine in single is wrong in the second digit."""
    samples = int(60 * RATE)
    rung = ring(one(15e3), one(0.01), np.ones((1, 1)), blow(samples), RATE)[0]
    times = (np.arange(samples) / RATE).astype(np.float32)
    single = np.exp(np.float32(-0.01) * times) * np.sin(np.float32(2.0 * np.pi * 15e3) * times)
    assert np.abs(single - rung)[-4800:].max() > 0.01


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 900), st.integers(1, 12))
def test_blocks_change_nothing(seed: int, samples: int, modes: int) -> None:
    """Against the plain convolution with the sum of the modes' answers, for any force and phase."""
    random = np.random.default_rng(seed)
    frequencies = 10.0 ** random.uniform(1.5, 4.3, modes)
    dampings = 2.0 * np.pi * frequencies * 10.0 ** random.uniform(-5.0, 0.5, modes)
    amplitudes = random.standard_normal((2, modes)) + 1j * random.standard_normal((2, modes))
    force = random.standard_normal((2, samples))
    times = np.arange(samples) / RATE
    kernels = amplitudes.real @ impulse_response(times, frequencies, dampings)
    kernels += amplitudes.imag @ impulse_response(times, frequencies, dampings, quadrature=True)
    expected = np.array([np.convolve(f, k)[:samples] for f, k in zip(force, kernels, strict=True)]) / RATE
    rung = ring(frequencies, dampings, amplitudes, force, RATE)
    assert np.abs(rung - expected).max() <= 1e-12 * max(np.abs(kernels).max() * samples, 1.0)


def test_the_answer_is_continuous_through_critical_damping() -> None:
    omega = 2.0 * np.pi * 500.0
    times = np.linspace(0.0, 0.01, 200)
    near = [impulse_response(times, one(500.0), one(omega * ratio))[0] for ratio in (1 - 1e-9, 1.0, 1 + 1e-9)]
    assert near[0] == pytest.approx(near[1], abs=1e-7)
    assert near[2] == pytest.approx(near[1], abs=1e-7)
    assert near[1] == pytest.approx(omega * times * np.exp(-omega * times), abs=1e-12)


def test_a_mode_at_or_above_half_the_rate_is_left_out() -> None:
    frequencies = np.array([1000.0, 24e3, 30e3])
    assert audible(frequencies, RATE).tolist() == [True, False, False]
    all_three = ring(frequencies, np.full(3, 5.0), np.ones((1, 3)), blow(500), RATE)
    only_first = ring(frequencies[:1], np.full(1, 5.0), np.ones((1, 1)), blow(500), RATE)
    assert (all_three == only_first).all()
    assert not ring(one(30e3), one(5.0), np.ones((1, 1)), blow(500), RATE).any()


def test_silence_stays_silence_and_nothing_is_left_to_slow_the_sum() -> None:
    quiet = ring(one(1000.0), one(1e4), np.ones((1, 1)), np.zeros((1, 3000)), RATE)
    assert not quiet.any()
    faded = ring(one(5000.0), one(3000.0), np.ones((1, 1)), blow(200_000), RATE)
    small = np.abs(faded[faded != 0.0])
    assert small.min() > np.finfo(np.float64).tiny


def test_a_strike_later_sounds_later_and_twice_as_hard_twice_as_loud() -> None:
    frequencies, dampings = np.array([440.0, 7000.0]), np.array([4.0, 40.0])
    first = ring(frequencies, dampings, np.ones((1, 2)), blow(3000), RATE)
    late = ring(frequencies, dampings, 2.0 * np.ones((1, 2)), blow(3000, 777), RATE)
    assert late[0, 777:] == pytest.approx(2.0 * first[0, :-777], abs=1e-10)
    assert not late[0, :777].any()


def test_what_does_not_belong_together_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"\(2,\)"):
        ring(one(100.0), np.ones(2), np.ones((1, 1)), blow(5), RATE)
    with pytest.raises(WrongUse, match="finite"):
        ring(one(100.0), one(np.nan), np.ones((1, 1)), blow(5), RATE)
    with pytest.raises(WrongUse, match="rigid"):
        ring(one(0.0), one(1.0), np.ones((1, 1)), blow(5), RATE)


def test_a_ball_is_as_loud_as_a_breathing_or_a_wobbling_sphere() -> None:
    """A sphere's own modes radiate as spherical harmonics do (Morse and Ingard, chapter 7).

    The sources in free air leave out the shadow of the ball on itself, worth less than a factor
    of two and a half where it is about as large as the wave.
    """
    steel = MATERIALS["steel"]
    modes = solve_modes(ball(0.03, 4), steel, 62e3, ball(0.03, 10).surface)
    loud = radiation(modes, 0.5)
    quadrupole = np.flatnonzero(np.einsum("nmd,nd->nm", modes.shapes, modes.normals).std(axis=0) > 0.5)[:1]
    outward = np.einsum("nd,nd->n", modes.shapes[:, quadrupole[0]], modes.normals)
    omega = 2.0 * np.pi * modes.frequencies[quadrupole[0]]
    k_radius = omega / SPEED_OF_SOUND * 0.03
    h2 = np.exp(1j * k_radius) * (1j * k_radius**2 - 3.0 * k_radius - 3.0j) / k_radius**3 * -1.0
    step = 1e-6 * k_radius
    x = k_radius + step
    slope = (np.exp(1j * x) * (1j * x**2 - 3.0 * x - 3.0j) / x**3 * -1.0 - h2) / step
    exact = AIR_DENSITY * SPEED_OF_SOUND * omega * np.sqrt(np.mean(outward**2)) / omega
    exact *= 1.0 / (np.abs(slope) * (omega / SPEED_OF_SOUND) * 0.5)
    assert 0.4 < loud[quadrupole[0]] / exact < 2.5
    assert radiation(modes, 1.0) == pytest.approx(0.5 * loud)
    with pytest.raises(WrongUse, match=r"\b0(\.0)? m"):
        radiation(modes, 0.0)


def test_a_room_dies_away_as_it_is_told() -> None:
    response = room_response(RATE, 0.4, 3.0, 7, 0.8)
    tail = response[1:]
    assert response[0] == 1.0
    assert tail @ tail == pytest.approx(10.0**-0.3)
    energy = np.cumsum((tail**2)[::-1])[::-1]  # Schroeder's backward integral
    level = 10.0 * np.log10(energy[: int(0.4 * RATE)])
    slope = np.polyfit(np.arange(len(level)) / RATE, level, 1)[0]
    assert -60.0 / slope == pytest.approx(0.4, rel=0.05)
    assert (response == room_response(RATE, 0.4, 3.0, 7, 0.8)).all()
    assert (room_response(RATE, 0.0, 3.0, 7, 0.1)[1:] == 0.0).all()
    with pytest.raises(WrongUse, match="reverberation"):
        room_response(RATE, -1.0, 3.0, 7, 0.1)


def test_a_room_adds_and_never_answers_before_the_sound() -> None:
    dry = np.zeros((2, 2000))
    dry[0, 500], dry[1, 900] = 1.0, -2.0
    wet = reverberated(dry, room_response(RATE, 0.1, 0.0, 1, 0.02))
    assert np.abs(wet[0, :500]).max() < 1e-12
    assert wet[1, 900:1500] == pytest.approx(-2.0 * wet[0, 500:1100], abs=1e-12)


def test_a_microphone_is_flat_between_its_ends() -> None:
    capsule = MicrophoneResponse()
    shown = np.abs(capsule.at(np.array([3.0, 100.0, 1000.0, 10e3, 28e3])))
    assert 20.0 * np.log10(shown[0]) == pytest.approx(-3.0, abs=0.05)
    assert shown[1:3] == pytest.approx(1.0, abs=2e-3)
    assert shown[3] == pytest.approx(1.0, abs=0.02)
    assert shown[4] == pytest.approx(0.7, abs=0.01)
    times = np.arange(48_000) / RATE
    tone = np.sin(2.0 * np.pi * 1000.0 * times)[None]
    heard = as_heard(tone, RATE, capsule)[0, 4800:]
    assert np.sqrt(np.mean(heard**2)) == pytest.approx(np.sqrt(0.5), rel=5e-3)
    with pytest.raises(WrongUse, match=r"vent|above 0"):
        MicrophoneResponse(vent=0.0)
