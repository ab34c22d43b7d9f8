"""Modes found in decays that are known: exactly without noise, within what is stated with it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused, WrongUse
from harness.sim.sound.modal_sound import impulse_response
from harness.strikes.modal_identification import Identified, modes_of_decay, modes_of_response
from harness.strikes.pole_fit import ComplexArray, PoleSearch, SpectralLines, fit_poles
from tests.oracles.measured_beams import beam_roots, free_shape

RATE = 4000.0
SAMPLES = 2000
FREQUENCIES = np.array([100.0, 310.0, 317.0, 900.0])
DAMPINGS = np.array([6.0, 10.0, 15.0, 30.0])
WHITE = 0.03


def decay(
    frequencies: FloatArray, dampings: FloatArray, random: np.random.Generator, samples: int = SAMPLES
) -> FloatArray:
    """Each mode with a size and a phase of its own."""
    times = np.arange(samples) / RATE
    sine = impulse_response(times, frequencies, dampings)
    cosine = impulse_response(times, frequencies, dampings, quadrature=True)
    size, phase = (
        random.uniform(0.4, 1.0, len(frequencies)),
        random.uniform(0.0, 2.0 * np.pi, len(frequencies)),
    )
    return np.asarray((size * np.cos(phase)) @ sine + (size * np.sin(phase)) @ cosine)


def found(identified: Identified) -> tuple[FloatArray, FloatArray]:
    modes = identified.modes
    return np.array([mode.frequency for mode in modes]), np.array([mode.damping for mode in modes])


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=4),
    st.floats(2.0, 40.0),
    st.integers(1, 3),
    st.integers(0, 2**32 - 1),
)
def test_without_noise_every_mode_is_found_to_the_last_digits(
    places: list[float], damping: float, channels: int, seed: int
) -> None:
    """Modes anywhere between 60 and 1860 Hz, 60 Hz apart and more: none missed, none invented."""
    gaps = 60.0 + np.diff(np.sort([0.0, *places])) * (1860.0 - 60.0 * len(places)) / max(1.0, sum(places))
    frequencies = np.cumsum(np.maximum(gaps, 60.0))
    random = np.random.default_rng(seed)
    dampings = random.uniform(0.5, 1.0, len(frequencies)) * damping
    signals = np.array([decay(frequencies, dampings, random) for _ in range(channels)])
    got, lost = found(modes_of_decay(signals, RATE))
    assert got == pytest.approx(frequencies, rel=1e-10)
    assert lost == pytest.approx(dampings, rel=1e-8)


@pytest.mark.slow  # many drawn cases of a statistic
def test_errors_are_as_large_as_stated() -> None:
    """A normal law has 95 % within two deviations; 320 numbers tell that to 1.2 %."""
    errors = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        noisy = decay(FREQUENCIES, DAMPINGS, random) + WHITE * random.normal(size=SAMPLES)
        identified = modes_of_decay(noisy, RATE)
        got, lost = found(identified)
        assert len(got) == len(FREQUENCIES)
        errors += list((got - FREQUENCIES) / [mode.frequency_sigma for mode in identified.modes])
        errors += list((lost - DAMPINGS) / [mode.damping_sigma for mode in identified.modes])
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(1.0, abs=0.15)
    assert np.mean(np.abs(errors) < 2.0) == pytest.approx(0.954, abs=0.035)


def test_channels_that_disagree_widen_what_is_stated() -> None:
    """Ten places measured one after another, of a structure whose mode moved by 0.2 Hz between them."""
    random = np.random.default_rng(4)
    centres = 200.0 + 0.2 * random.normal(size=10)
    signals = np.array([decay(np.array([f]), np.array([8.0]), random) for f in centres])
    mode = modes_of_decay(signals, RATE, PoleSearch(misfit=0.2)).modes[0]
    assert mode.frequency == pytest.approx(200.0, abs=3.0 * mode.frequency_sigma)
    assert 0.5 < mode.frequency_sigma / (0.2 / np.sqrt(10.0)) < 2.0


@pytest.mark.parametrize("widths", [1.0, 0.5])
def test_a_close_pair_is_two_modes(widths: float) -> None:
    """A half and one half-power bandwidth apart, where a spectrum shows one peak."""
    bandwidth = 10.0 / np.pi
    pair = np.array([300.0, 300.0 + widths * bandwidth])
    random = np.random.default_rng(1)
    noisy = decay(pair, np.array([10.0, 10.0]), random) + 1e-3 * random.normal(size=SAMPLES)
    got, lost = found(modes_of_decay(noisy, RATE, PoleSearch(misfit=1e-4)))
    assert got == pytest.approx(pair, abs=0.02)
    assert lost == pytest.approx([10.0, 10.0], rel=0.02)


@pytest.mark.parametrize(("natural", "ratio"), [(300.0, 1.0), (300.0, 0.95), (282.84, 1.0607), (250.0, 1.5)])
def test_damping_may_be_critical_or_beyond(natural: float, ratio: float) -> None:
    """Of ``w`` rad/s: one hump without a period, near critical damping and past it."""
    times = np.arange(SAMPLES) / RATE
    signal = impulse_response(times, np.array([natural / (2.0 * np.pi)]), np.array([ratio * natural]))
    (mode,) = modes_of_decay(signal, RATE).modes
    assert 2.0 * np.pi * mode.frequency == pytest.approx(natural, rel=1e-7)
    assert mode.ratio == pytest.approx(ratio, rel=1e-7)


@pytest.mark.slow  # many drawn cases of a statistic
def test_noise_alone_is_no_mode() -> None:
    """A false alarm in a thousand records at most; two in two hundred would be one chance in sixty."""
    random = np.random.default_rng(0)
    alarms = sum(len(modes_of_decay(random.normal(size=SAMPLES), RATE).modes) > 0 for _ in range(200))
    assert alarms <= 1


def test_a_record_that_ends_early_changes_nothing() -> None:
    """A third of a decay time is enough: no window, no leakage."""
    random = np.random.default_rng(2)
    slow = np.array([3.0, 2.0])
    got, lost = found(modes_of_decay(decay(np.array([150.0, 420.0]), slow, random, 512), RATE))
    assert got == pytest.approx([150.0, 420.0], rel=1e-10)
    assert lost == pytest.approx(slow, rel=1e-8)


def test_modes_out_of_the_band_leave_those_in_it_alone() -> None:
    random = np.random.default_rng(3)
    noisy = decay(FREQUENCIES, DAMPINGS, random) + 1e-3 * random.normal(size=SAMPLES)
    identified = modes_of_decay(noisy, RATE, PoleSearch(low=250.0, high=400.0))
    assert found(identified)[0] == pytest.approx([310.0, 317.0], abs=0.02)


def test_half_the_digits_give_the_same_modes() -> None:
    random = np.random.default_rng(5)
    signal = decay(FREQUENCIES, DAMPINGS, random)
    exact, coarse = (found(modes_of_decay(s, RATE)) for s in (signal, signal.astype(np.float32)))
    assert coarse[0] == pytest.approx(exact[0], rel=1e-8)
    assert coarse[1] == pytest.approx(exact[1], rel=1e-6)


def test_no_more_modes_than_asked_for_and_said() -> None:
    random = np.random.default_rng(6)
    identified = modes_of_decay(decay(FREQUENCIES, DAMPINGS, random), RATE, PoleSearch(most=2))
    assert len(identified.modes) == 2
    assert identified.full


def test_a_clipped_channel_is_flagged_and_a_coarsely_counted_one_is_not() -> None:
    random = np.random.default_rng(7)
    signal = decay(FREQUENCIES, DAMPINGS, random)
    signals = np.array([signal, np.clip(signal, -0.4, 0.4), np.round(64.0 * signal) / 64.0])
    assert modes_of_decay(signals, RATE, PoleSearch(most=4)).clipped.tolist() == [False, True, False]
    slow = np.cos(np.arange(4000) * 1e-3)
    assert not is_clipped(np.round(2048.0 * slow))
    assert is_clipped(np.clip(np.round(2048.0 * slow * np.cos(np.arange(4000.0))), -1000.0, 1000.0))


def accelerance(frequencies: FloatArray) -> ComplexArray:
    """Of three places, with a rigid motion and modes beyond the band."""
    s = 2j * np.pi * frequencies
    omegas = 2.0 * np.pi * np.array([52.0, 142.0, 278.0, 1500.0])
    shapes = np.array([[1.0, 0.7, -0.8, 0.5], [0.4, -0.6, 0.5, 0.3], [-0.7, 0.2, 0.9, -0.6]])
    modes = s**2 / (omegas[:, None] ** 2 + 2.0 * 0.001 * omegas[:, None] * s + s**2)
    return np.asarray(0.3 + (shapes * shapes[0]) @ modes)


def test_poles_of_transfer_functions() -> None:
    """Accelerance on lines wider than the peaks, with the rest of the structure beside them."""
    frequencies = np.arange(401.0)
    random = np.random.default_rng(8)
    noise = random.normal(size=(3, 401)) + 1j * random.normal(size=(3, 401))
    identified = modes_of_response(frequencies, accelerance(frequencies) + 1e-3 * noise, PoleSearch(low=5.0))
    assert found(identified)[0] == pytest.approx([52.0, 142.0, 278.0], abs=2e-3)
    assert [mode.ratio for mode in identified.modes] == pytest.approx([1e-3] * 3, rel=0.05)


def test_an_exponential_windows_damping_is_taken_off() -> None:
    frequencies = np.arange(1.0, 401.0)
    s = 2j * np.pi * frequencies + 12.0
    windowed = np.asarray(s / (s**2 + 2.0 * 5.0 * s + (2.0 * np.pi * 120.0) ** 2), np.complex128)
    (mode,) = modes_of_response(frequencies, windowed, decay=12.0).modes
    assert mode.frequency == pytest.approx(120.0, rel=1e-9)
    assert mode.damping == pytest.approx(5.0, rel=1e-6)


@pytest.mark.parametrize("rate", [RATE, None])
def test_the_slopes_of_a_fit_are_those_of_its_residual(rate: float | None) -> None:
    """Central differences, in the direction in which the linear terms do not move: the gradient."""
    from harness.strikes.pole_fit import _Problem

    random = np.random.default_rng(9)
    frequencies = np.arange(1.0, 400.0)
    values = random.normal(size=(2, 399)) + 1j * random.normal(size=(2, 399))
    problem = _Problem(SpectralLines(frequencies, values, rate), 2.0 * np.pi * np.array([80.0, 200.0]), 3)
    at = np.array([0.01, -0.02, 0.05, 1.3])
    slope = problem.jacobian(at).T @ problem.residual(at)
    for unknown, step in enumerate(1e-6 * np.eye(4)):
        ahead, behind = (0.5 * np.sum(problem.residual(at + way) ** 2) for way in (step, -step))
        assert (ahead - behind) / 2e-6 == pytest.approx(slope[unknown], rel=1e-4, abs=1e-9)


def test_no_poles_leave_all_but_the_skirt() -> None:
    frequencies = np.arange(1.0, 100.0)
    fit = fit_poles(
        SpectralLines(frequencies, np.ones((1, 99), np.complex128), None), np.zeros(0), np.zeros(0), 1
    )
    assert np.abs(fit.residual).max() < 1e-13


@pytest.mark.parametrize(
    ("signal", "said"),
    [
        (np.zeros(500), "silent"),
        (np.full(500, 3.0), "silent"),
        (np.full(500, np.nan), "finite"),
        (np.append(np.ones(500), np.inf), "finite"),
        (np.arange(20.0), "64"),
    ],
)
def test_what_holds_no_decay_is_refused(signal: FloatArray, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        modes_of_decay(signal, RATE)


def test_a_band_without_lines_and_a_rate_of_nothing_are_refused() -> None:
    signal = np.sin(np.arange(500.0))
    with pytest.raises(WrongUse, match="lines"):
        modes_of_decay(signal, RATE, PoleSearch(low=100.0, high=101.0))
    with pytest.raises(WrongUse, match="rate"):
        modes_of_decay(signal, 0.0)
    with pytest.raises(DataRefused, match="evenly"):
        modes_of_response(np.arange(100.0) ** 1.1, np.ones((1, 100)) * np.arange(100.0))
    for frequencies in (np.arange(100.0)[::-1], np.full(100, np.nan), np.arange(99.0)):
        with pytest.raises(DataRefused, match="100 lines"):
            modes_of_response(frequencies, np.ones((1, 100)) * np.arange(100.0))


@pytest.mark.parametrize("step", [0.6103515625, 0.5 + 1.0 / 7.0])
def test_a_spectrum_printed_with_six_decimals_has_the_same_modes(step: float) -> None:
    frequencies = step * np.arange(1.0, 701.0)
    values = accelerance(frequencies)
    exact, printed = (
        found(modes_of_response(lines, values, PoleSearch(low=5.0)))
        for lines in (frequencies, np.asarray(frequencies.round(6)))
    )
    assert exact[0] == pytest.approx([52.0, 142.0, 278.0], abs=2e-3)
    assert printed[0] == pytest.approx(exact[0], rel=1e-8)
    assert printed[1] == pytest.approx(exact[1], rel=1e-4)


ROVING = 974.141
"""Hz, the sixth mode of a free beam that a hammer roves along."""


def roving(moved: float, places: int = 10) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Hz, accelerance with noise at places along a beam, and the factor of each row's frequencies."""
    random = np.random.default_rng(0)
    frequencies, roots = np.arange(0.0, 1200.0, 0.75), beam_roots("free-free", 6)
    factors = 1.0 + moved * random.normal(size=places)
    s, values = 2j * np.pi * frequencies, np.full((places, len(frequencies)), 0.3 + 0j)
    for root in roots:
        omega = 2.0 * np.pi * ROVING * (root / roots[-1]) ** 2 * factors[:, None]
        shape = free_shape(float(root), np.linspace(0.0, 1.0, places))[:, None]
        values += shape * s**2 / (omega**2 + 4e-4 * omega * s + s**2)
    noise = random.normal(size=values.shape) + 1j * random.normal(size=values.shape)
    return frequencies, np.asarray(values + 1e-3 * noise, np.complex128), factors


@pytest.mark.parametrize("moved", [0.0, 1e-3])
def test_a_mode_that_moves_from_row_to_row_is_one_mode_and_that_is_stated(moved: float) -> None:
    frequencies, values, factors = roving(moved)
    identified = modes_of_response(frequencies, values, PoleSearch(low=20.0))
    assert len(identified.modes) == 6
    assert not identified.undamped
    sixth = identified.modes[-1]
    assert sixth.frequency == pytest.approx(ROVING * factors.mean(), abs=3.0 * sixth.frequency_sigma + 1e-3)
    assert sixth.ratio == pytest.approx(2e-4, rel=0.02)
    assert sixth.spread == pytest.approx(ROVING * factors.std(), rel=0.5, abs=0.01)
    assert any("changed between the rows" in note for note in identified.notes) == (moved > 0.0)


PAIR = np.array([1681.2, 1684.2])


def pair_response(amplitudes: list[tuple[float, float]], damping: float) -> tuple[FloatArray, ComplexArray]:
    """Make the accelerance of two modes, a row for each pair of amplitudes, with noise of a thousandth."""
    random = np.random.default_rng(0)
    frequencies = np.arange(1500.0, 1900.0, 0.5)
    s, omegas = 2j * np.pi * frequencies, 2.0 * np.pi * PAIR[:, None]
    values = np.array(amplitudes) @ (s**2 / (omegas**2 + 2.0 * damping * s + s**2))
    noise = random.normal(size=values.shape) + 1j * random.normal(size=values.shape)
    return frequencies, np.asarray(values + 1e-3 * np.abs(values).max() * noise, np.complex128)


def test_a_moved_mode_is_one_mode_and_a_true_pair_is_two() -> None:
    """A hammer roves along a beam whose modes move by one per cent; a pair has nodes in some rows."""
    frequencies, values, factors = roving(1e-2)
    identified = modes_of_response(frequencies, values, PoleSearch(low=20.0))
    assert len(identified.modes) == 6
    sixth = identified.modes[-1]
    shares = free_shape(float(beam_roots("free-free", 6)[-1]), np.linspace(0.0, 1.0, len(factors))) ** 2
    assert sixth.frequency == pytest.approx(ROVING * np.average(factors, weights=shares), abs=0.5)
    assert sixth.damping == pytest.approx(2e-4 * 2.0 * np.pi * ROVING, abs=0.03)
    for damping in (3.0, 20.0):
        for amplitudes in (
            [(0.0, 1.0), (1.0, 0.0), (1.0, 0.3), (1.0, 0.0)],
            [(0.0, 1.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0)],
        ):
            pair = modes_of_response(*pair_response(amplitudes, damping))
            assert found(pair)[0] == pytest.approx(PAIR, abs=0.02)
            assert found(pair)[1] == pytest.approx([damping] * 2, abs=0.05)
            assert pair.notes == ()


@pytest.mark.parametrize(
    ("amplitudes", "damping"),
    [
        ([(0, 1), (1, 0.15)], 3.0),
        ([(0, 1), (1, 0), (1, 0.3)], 10.0),
        ([(1, 0.5), (1, -0.5), (0.3, 1)], 20.0),
    ],
)
def test_a_pair_in_few_rows_is_two_modes(amplitudes: list[tuple[float, float]], damping: float) -> None:
    """One row shows both peaks, or fewer poles than rows explain everything."""
    pair = modes_of_response(*pair_response(amplitudes, damping))
    assert found(pair)[0] == pytest.approx(PAIR, abs=0.02)


def test_a_close_pair_in_several_rows_stays_two_modes() -> None:
    """Rows that all have both, in proportions of their own: no row alone is explained by one pole."""
    random = np.random.default_rng(1)
    pair = np.array([300.0, 301.6])
    signals = np.array([decay(pair, np.array([5.0, 5.0]), random) for _ in range(4)])
    identified = modes_of_decay(signals + 1e-3 * random.normal(size=signals.shape), RATE)
    assert found(identified)[0] == pytest.approx(pair, abs=0.02)
    assert [mode.spread for mode in identified.modes] == [0.0, 0.0]


def test_a_tone_that_grows_is_no_mode() -> None:
    times = np.arange(SAMPLES) / RATE
    ringing = impulse_response(times, np.array([310.0]), np.array([12.0]))
    hum = 0.05 * np.exp(0.2 * times) * np.sin(2.0 * np.pi * 50.0 * times)
    identified = modes_of_decay(ringing + hum, RATE)
    assert found(identified)[0] == pytest.approx([310.0], rel=1e-9)
    assert [pole.frequency for pole in identified.undamped] == pytest.approx([50.0], rel=1e-6)
    assert "50 Hz" in identified.notes[0]
