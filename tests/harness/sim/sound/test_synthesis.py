"""The sum of struck modes: against many digits, an equation of motion, and the laws of sums."""

from concurrent.futures import ThreadPoolExecutor

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS, Material
from harness.sim.modal.modes import dampings
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.synthesis import SynthesisLevel, synthesize
from harness.sim.sound.synthesis_kernels import TILE, fill

RATE = 44.1e3
LEVELS: tuple[SynthesisLevel, ...] = ("fast", "double", "exact")


def drawn(seed: int, modes: int, sounds: int = 1) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Modes of a ceramic between 200 Hz and 20 kHz, and random amplitudes."""
    random = np.random.default_rng(seed)
    frequencies = np.sort(random.uniform(200.0, 20e3, modes))
    return frequencies, dampings(frequencies, MATERIALS["ceramic"]), random.standard_normal((sounds, modes))


def decibels(error: AnyArray, of: AnyArray) -> float:
    """The largest of one against the largest of the other."""
    return float(20.0 * np.log10(np.maximum(np.abs(error).max(), 1e-300) / np.abs(of).max()))


def many_digits(
    f: FloatArray, d: FloatArray, amplitudes: FloatArray, at: AnyArray, rate: float
) -> FloatArray:
    """The sum at some samples, to 40 digits."""
    found = []
    with mpmath.workdps(40):
        omegas = [2 * mpmath.pi * mpmath.mpf(float(value)) for value in f]
        splits = [mpmath.sqrt(w**2 - mpmath.mpf(float(v)) ** 2) for w, v in zip(omegas, d, strict=True)]
        factors = [mpmath.mpf(float(g)) * w / s for g, w, s in zip(amplitudes, omegas, splits, strict=True)]
        for sample in at:
            t = mpmath.mpf(int(sample)) / mpmath.mpf(rate)
            terms = (
                g * mpmath.exp(-mpmath.mpf(float(v)) * t) * mpmath.sin(s * t)
                for g, v, s in zip(factors, d, splits, strict=True)
            )
            found.append(float(mpmath.fsum(terms)))
    return np.array(found)


def test_128_modes_over_3_s_agree_with_many_digits() -> None:
    f, d, g = drawn(1, 128)
    exact = synthesize(f, d, g, 3.0, RATE, "exact")
    at = np.r_[np.arange(40), np.random.default_rng(2).integers(40, exact.sound.shape[1], 60)]
    digits = many_digits(f, d, g[0], at, RATE)
    assert decibels(exact.sound[0, at] - digits, exact.sound) < -230.0
    fast, double = synthesize(f, d, g, 3.0, RATE, "fast"), synthesize(f, d, g, 3.0, RATE, "double")
    assert fast.sound.shape == (1, 132_300)
    assert decibels(fast.sound - exact.sound, exact.sound) < -115.0
    assert decibels(double.sound - exact.sound, exact.sound) < -220.0


@pytest.mark.parametrize("level", LEVELS)
def test_one_mode_is_a_decaying_sine(level: SynthesisLevel) -> None:
    f, d = np.array([440.0]), np.array([5.0])
    found = synthesize(f, d, np.array([[2.0]]), 0.5, RATE, level)
    times = np.arange(22050) / RATE
    split = np.sqrt((2.0 * np.pi * 440.0) ** 2 - 25.0)
    closed = 2.0 * 2.0 * np.pi * 440.0 / split * np.exp(-5.0 * times) * np.sin(split * times)
    assert np.abs(found.sound[0] - closed).max() < (1e-6 if level == "fast" else 1e-11)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 70), st.integers(1, 20_000), st.sampled_from(["fast", "double"])
)
def test_the_error_is_at_most_what_is_stated(
    seed: int, modes: int, samples: int, level: SynthesisLevel
) -> None:
    """Any frequencies, dampings from none to beyond critical, gains over nine decades, any phase."""
    random = np.random.default_rng(seed)
    f = 10.0 ** random.uniform(1.0, 4.5, modes)
    d = np.where(random.random(modes) < 0.1, 0.0, 10.0 ** random.uniform(-2.0, 5.0, modes))
    g = 10.0 ** random.uniform(-9.0, 0.0, (2, modes)) * np.exp(2j * np.pi * random.random((2, modes)))
    g *= 10.0 ** random.uniform(-30.0, 30.0)
    reference = synthesize(f, d, g, samples / RATE, RATE, "exact")
    found = synthesize(f, d, g, samples / RATE, RATE, level)
    peaks = np.abs(reference.sound).max(axis=1)
    assert np.isfinite(found.sound).all()
    allowed = peaks * (10.0 ** (found.error / 20.0) + 10.0 ** (reference.error / 20.0))
    assert (np.abs(found.sound - reference.sound).max(axis=1) <= allowed).all()


@pytest.mark.slow  # fewer modes meet the same standard in quick tests
def test_two_thousand_modes_are_known_to_better_than_115_db() -> None:
    """They are added up in groups, so that what is stated grows slower than with the root of their number."""
    f, d, g = drawn(11, 2048)
    found, exact = (synthesize(f, d, g, 0.1, RATE, level) for level in ("fast", "exact"))
    assert decibels(found.sound - exact.sound, exact.sound) < found.error < -115.0


@pytest.mark.parametrize("modes", [16, 128, 300])
@pytest.mark.parametrize("rate_of_decay", [14.0, 50.0])
def test_modes_that_all_end_together_are_known_to_better_than_115_db(
    modes: int, rate_of_decay: float
) -> None:
    """All of them are left out at one time, and what they then add up to is bounded with one sign."""
    f, _, g = drawn(modes, modes)
    d = np.full(modes, rate_of_decay)
    found, exact = (synthesize(f, d, g, 1.5, RATE, level) for level in ("fast", "exact"))
    assert decibels(found.sound - exact.sound, exact.sound) < found.error < -115.0


@pytest.mark.parametrize("level", ["fast", "double"])
def test_it_is_what_an_impulse_of_force_rings(level: SynthesisLevel) -> None:
    f, d, g = drawn(3, 40)
    force = np.zeros((1, 30_000))
    force[0, 0] = RATE
    rung = ring(f, d, g, force, RATE)
    found = synthesize(f, d, g, 30_000 / RATE, RATE, level)
    assert decibels(found.sound - rung, rung) < (-115.0 if level == "fast" else -200.0)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0))
def test_sounds_add(seed: int, factor: float) -> None:
    f, d, g = drawn(seed, 30, sounds=2)
    both = synthesize(f, d, g, 0.4, RATE).sound
    mixed = synthesize(f, d, g[:1] + factor * g[1:], 0.4, RATE).sound
    assert decibels(mixed[0] - both[0] - factor * both[1], both) < -110.0


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_modes_does_not_matter(seed: int) -> None:
    f, d, g = drawn(seed, 50)
    order = np.random.default_rng(seed).permutation(50)
    first = synthesize(f, d, g, 0.4, RATE).sound
    second = synthesize(f[order], d[order], g[:, order], 0.4, RATE).sound
    assert decibels(second - first, first) < -115.0


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5000))
def test_a_sound_begun_later_is_the_rest_of_it(seed: int, late: int) -> None:
    f, d, g = drawn(seed, 30)
    omega = 2.0 * np.pi * f
    split = np.sqrt(omega**2 - d**2)
    turned = g * omega / split * np.exp((-d + 1j * split) * late / RATE)
    rest = synthesize(f, d, turned.real * split / omega + 1j * turned.imag, 0.3, RATE).sound
    whole = synthesize(f, d, g, 0.3 + late / RATE, RATE).sound[:, late:]
    assert decibels(rest - whole, whole) < -100.0


def test_length_and_rate_only_choose_the_samples() -> None:
    f, d, g = drawn(5, 60)
    whole = synthesize(f, d, g, 2.0, RATE)
    for duration in (1.0 / RATE, 0.01, 0.3):
        part = synthesize(f, d, g, duration, RATE)
        assert part.sound.shape[1] == round(duration * RATE)
        assert (
            np.abs(part.sound - whole.sound[:, : part.sound.shape[1]]).max()
            < 1e-6 * np.abs(whole.sound).max()
        )
    finer = synthesize(f, d, g, 2.0, 2.0 * RATE)
    assert decibels(finer.sound[:, ::2] - whole.sound, whole.sound) < -115.0


def test_a_chain_of_masses_moves_as_its_modes_say() -> None:
    """``M x'' + (alpha M + beta K) x' + K x = F``: the convention of ``dampings``, with its half."""
    mass = np.diag([1.0, 2.0, 1.5])
    stiffness = 4e6 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    soft = Material("soft", 1000.0, 1e9, 0.3, 40.0, 2e-5)
    squares, shapes = eigh(stiffness, mass)
    frequencies = np.sqrt(squares) / (2.0 * np.pi)
    times = np.arange(4000) / 20e3
    resistance = soft.alpha * mass + soft.beta * stiffness
    inverse: FloatArray = np.diag(1.0 / np.diag(mass))

    def rhs(_t: float, state: FloatArray) -> FloatArray:
        x, v = state[:3], state[3:]
        return np.concatenate([v, -inverse @ (stiffness @ x + resistance @ v)])

    struck = np.array([0.0, 0.0, 0.0, 0.0, 0.0, inverse[2, 2]])
    solved = solve_ivp(rhs, (0.0, float(times[-1])), struck, "DOP853", times, rtol=1e-11, atol=1e-16)
    amplitudes = shapes[:1] * shapes[2:] / np.sqrt(squares)
    decays = dampings(frequencies, soft)
    found = synthesize(frequencies, decays, amplitudes, 0.2, 20e3, "double").sound[0]
    assert np.abs(found - solved.y[0]).max() < 1e-7 * np.abs(solved.y[0]).max()
    without_half = synthesize(frequencies, 2.0 * decays, amplitudes, 0.2, 20e3, "double").sound[0]
    assert np.abs(without_half - solved.y[0]).max() > 0.1 * np.abs(solved.y[0]).max()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("decay", [1.0, 0.3, 1e-9])
def test_tables_hold_powers_and_no_subnormal_numbers(kind: type, decay: float) -> None:
    floor = 1e-12 if kind is np.float32 else 1e-140
    step = np.full(TILE, decay * np.exp(1.3j))
    table: AnyArray = np.full((300, 2 * TILE), 7.0, kind)
    parts = np.stack([step.real, step.imag])
    one = np.stack([np.ones(TILE), np.zeros(TILE)])
    fill(table, np.array([299]), one, parts, floor, True)
    powers = step[0] ** np.arange(299)
    assert np.abs(table[:299, 0] - powers.imag).max() < 1e-6
    assert np.abs(table[:299, TILE] - powers.real).max() < 1e-6
    assert (table[299] == 7.0).all()
    held = np.abs(table[:299][table[:299] != 0.0])
    assert held.min() >= np.finfo(kind).tiny


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_each_tile_of_a_table_has_its_own_steps_and_rows(kind: type) -> None:
    random = np.random.default_rng(5)
    step = np.exp(-random.uniform(0.0, 0.1, 3 * TILE) + 1j * random.uniform(-3.0, 3.0, 3 * TILE))
    first = random.standard_normal(3 * TILE) + 1j * random.standard_normal(3 * TILE)
    table: AnyArray = np.full((20, 6 * TILE), 7.0, kind)
    rows = np.array([20, -4, 3])
    ahead, on = (np.stack([parts.real, parts.imag]) for parts in (first, step))
    fill(table, rows, ahead, on, 0.0, False)
    powers = first * step ** np.arange(20)[:, None]
    for tile, count in enumerate(rows):
        lanes = slice(TILE * tile, TILE * (tile + 1))
        real, imag = table[:, 2 * TILE * tile :][:, :TILE], table[:, 2 * TILE * tile + TILE :][:, :TILE]
        wanted = powers[: max(count, 0), lanes]
        assert np.abs(real[: len(wanted)] - wanted.real).max(initial=0.0) < 1e-6
        assert np.abs(imag[: len(wanted)] - wanted.imag).max(initial=0.0) < 1e-6
        assert (real[len(wanted) :] == 7.0).all()
        assert (imag[len(wanted) :] == 7.0).all()


def test_sounds_share_no_memory() -> None:
    """Neither one after another nor side by side."""
    cases = [(*drawn(seed, modes), 0.5 + 0.2 * seed) for seed, modes in enumerate((40, 300, 17, 120, 300, 5))]

    def made(f: FloatArray, d: FloatArray, g: FloatArray, duration: float) -> FloatArray:
        return synthesize(f, d, g, duration, RATE).sound

    alone = [made(*case) for case in cases]
    kept = [sound.copy() for sound in alone]
    with ThreadPoolExecutor(3) as pool:
        beside = list(pool.map(lambda case: made(*case), 4 * cases))
    for number, sound in enumerate(beside):
        assert (sound == kept[number % len(cases)]).all()
    assert all((sound == copy).all() for sound, copy in zip(alone, kept, strict=True))


def test_what_does_not_belong_together_is_refused() -> None:
    f, d, g = drawn(1, 3)
    with pytest.raises(WrongUse, match=r"dampings \(.*amplitudes \("):
        synthesize(f, d, g[:, :2], 1.0, RATE)
    with pytest.raises(WrongUse, match=r"\b0(\.0)? s .*Hz"):
        synthesize(f, d, g, 0.0, RATE)
    with pytest.raises(WrongUse, match=r"nan s .*Hz"):
        synthesize(f, d, g, float("nan"), RATE)
    with pytest.raises(WrongUse, match=r"0.* samples per second"):
        synthesize(f, d, g, 1.0, 0.0)
    with pytest.raises(WrongUse, match="finite"):
        synthesize(f, d, g * np.nan, 1.0, RATE)
    with pytest.raises(WrongUse, match="rigid"):
        synthesize(f * 0.0, d, g, 1.0, RATE)
    with pytest.raises(WrongUse, match=r"'quick'.*'fast'"):
        synthesize(f, d, g, 1.0, RATE, "quick")  # type: ignore[arg-type]
