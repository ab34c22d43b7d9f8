"""The sound of a unit impulse: a sum of decaying sines, of any length and at any rate.

``S(t) = sum_i (w_i / w_di) Im(g_i exp((-d_i + i w_di) t))`` with ``w_d = sqrt(w^2 - d^2)``: what
``harness.sim.sound.modal_sound.ring`` answers to one impulse, in a fraction of its time. ``w / w_d`` is one
to 5e-5 for a mode damped by a hundredth of the critical damping, and carries the sum through critical
damping, see ``modal_sound.impulse_response``.
"""

import threading
import time
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from threadpoolctl import ThreadpoolController

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.sim.sound.modal_sound import audible, check_modes, check_rate, impulse_response, is_heavy
from harness.sim.sound.synthesis_kernels import TILE
from harness.sim.sound.synthesis_tables import SPLITS, TOGETHER, Steps, fill_sound

SynthesisLevel = Literal["fast", "double", "exact"]
"""``"fast"``: tables in single precision from phases in double, and a spectrum in double precision of modes
that hardly die away, if they are many; ``"double"``: tables in double precision; ``"exact"``: every sine of
every mode summed in double precision, the reference."""

_FADED = 65.0
"""Times the time constant after which a heavily damped mode is over: 1e-28."""

_SUMMED = 4096
"""Samples that are summed directly at a time."""

_SIGMAS = 4.5
"""A normal error exceeds it once in 150 000 samples."""


@dataclass(frozen=True, eq=False)
class Synthesis:
    """Sounds and how far to trust them."""

    sound: FloatArray  #: ``(k, t)``, float64, in the unit of the amplitudes.
    rate: float  #: samples per second.
    left_out: BoolArray  #: ``(m,)``: the modes at or above half of the rate, which have no part in it.
    error: float
    """dB, of the worst sample against the same sum in exact arithmetic, relative to the loudest sample of the
    same sound, the worst of the sounds; what the modes left out late and the phases add to it is a bound,
    what rounding adds an estimate at 4.5 standard deviations of a random walk. Minus infinity for silence."""
    seconds: float  #: s on the clock that it took.


def synthesize(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: AnyArray,
    duration: float,
    rate: float,
    level: SynthesisLevel = "fast",
) -> Synthesis:
    """The sounds of modes that all start with one impulse at the first sample.

    It runs on one core: the products are too small for a second one, which would wait for them
    where anything else runs.

    Args:
        frequencies: ``(m,)`` Hz, undamped, above zero; those at or above half of ``rate`` are left
            out and named in the result.
        dampings: ``(m,)`` 1/s, zero or more; critical damping and more are allowed.
        amplitudes: ``(k, m)`` of each mode in each of k sounds. The imaginary part of a complex
            one goes with the cosine.
        duration: s, above zero.
        rate: samples per second, above zero.
        level: how precisely.

    Raises:
        WrongUse: shapes that do not belong together, numbers that are not finite, a duration
            shorter than a sample, or an unknown level.
    """
    begun = time.perf_counter()
    if level not in ("fast", "double", "exact"):
        raise WrongUse(f"no level {level!r} of synthesis; say 'fast', 'double' or 'exact'")
    check_rate(rate)
    check_modes(frequencies, dampings, amplitudes)
    if not (np.isfinite(duration) and duration * rate >= 1.0):
        raise WrongUse(
            f"a sound of {duration:g} s has no sample at {rate:g} Hz; say at least {1.0 / rate:g} s"
        )
    samples = round(duration * rate)
    heard = audible(frequencies, rate)
    f, d, parts = frequencies[heard], dampings[heard], amplitudes[:, heard]
    direct = np.full(len(f), True) if level == "exact" else is_heavy(f, d)
    with _one_sum, _one_core().limit(limits=1):
        sound, errors = _blocks(f[~direct], d[~direct], parts[:, ~direct], samples, rate, level)
        if direct.any():
            sound += _summed(f[direct], d[direct], parts[:, direct], samples, rate)
    peaks = loudest(sound)
    # A phase has an error of four roundings of its cycles, at the time of the largest effect.
    lasting = np.minimum(samples / rate, 1.0 / (np.e * np.maximum(d, 1e-300)))
    phase_errors = np.abs(parts) @ (4.0 * np.finfo(np.float64).eps * np.pi * f * lasting)
    double = float(np.finfo(np.float64).eps) / 2.0
    unit = float(np.finfo(np.float32).eps) / 2.0 if level == "fast" else double
    sizes = np.abs(parts)
    whole = np.sqrt(np.sum(sizes**2, axis=1))
    modes = terms = parts.shape[1]
    if level != "exact":
        # Maximum number of terms in one sum: those of a group, and then the groups.
        terms = min(modes, TOGETHER) + modes / TOGETHER + min(modes / TILE, SPLITS)
    walk = np.sqrt((2.0 + terms) / 3.0) * np.maximum(_SIGMAS * np.sqrt(0.5) * whole, peaks)
    block = _block_length(samples)
    powers = np.sqrt(5.0) * (block + samples / block) * sizes.sum(axis=1)
    errors += phase_errors + np.asarray(unit * (walk + 6.0 * whole) + double * powers)
    return Synthesis(
        read_only(sound), rate, read_only(~heard), decibels(errors, peaks), time.perf_counter() - begun
    )


_one_sum = threading.Lock()
"""The number of cores belongs to the process, and a second thread's limit is not heeded: when the first left,
the second's products had all cores back, and other last bits."""


@cache
def _one_core() -> ThreadpoolController:
    """Looked for once: finding the libraries takes longer than a sound."""
    return ThreadpoolController().select(user_api="blas")


def _blocks(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: AnyArray,
    samples: int,
    rate: float,
    level: SynthesisLevel,
) -> tuple[FloatArray, FloatArray]:
    """``(k, t)`` sounds of underdamped modes, and ``(k,)`` the most that was left out of them."""
    block = _block_length(samples)
    sound = np.zeros((len(amplitudes), -(-samples // block), block))
    rests = np.zeros(len(amplitudes))
    if len(frequencies) and level != "exact":
        omega = 2.0 * np.pi * frequencies
        split = np.sqrt((omega - dampings) * (omega + dampings))
        steps = Steps(dampings, split / (2.0 * np.pi * rate), rate)
        weights = np.real(amplitudes) * (omega / split) + 1j * np.imag(amplitudes)
        for strike, each in enumerate(weights):
            rests[strike] = fill_sound(steps, each, sound[strike], level)
    return sound.reshape(len(amplitudes), -1)[:, :samples], rests


def _block_length(samples: int) -> int:
    """A power of two near the root of the samples: both tables are then about as long."""
    return min(max(1 << (samples.bit_length() - 1) // 2, 32), 256)


def _summed(
    frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray, samples: int, rate: float
) -> FloatArray:
    """``(k, t)``: every mode's own answer, added up in double precision."""
    lasting = min(samples, faded_after(frequencies, dampings, rate))
    sound = np.zeros((len(amplitudes), samples))
    for begin in range(0, lasting, _SUMMED):
        times = np.arange(begin, min(begin + _SUMMED, lasting)) / rate
        part = np.real(amplitudes) @ impulse_response(times, frequencies, dampings)
        if np.iscomplexobj(amplitudes):
            part += np.imag(amplitudes) @ impulse_response(times, frequencies, dampings, quadrature=True)
        sound[:, begin : begin + len(times)] = part
    return sound


def faded_after(frequencies: FloatArray, dampings: FloatArray, rate: float) -> int:
    """Samples after which the slowest of some modes, of any damping, is down to 1e-28 of its envelope."""
    omega = 2.0 * np.pi * frequencies
    over = np.sqrt(np.maximum((dampings - omega) * (dampings + omega), 0.0))
    slow = np.where(dampings > omega, omega**2 / np.maximum(dampings + over, omega), dampings)
    return int(min(np.ceil(_FADED * rate / max(float(slow.min()), 1e-12)), 2.0**53))


def loudest(sound: FloatArray) -> FloatArray:
    """``(k,)``: the largest sample of each of ``(k, t)`` sounds, of either sign."""
    return np.asarray(np.maximum(sound.max(axis=1), -sound.min(axis=1)))


def decibels(errors: FloatArray, peaks: FloatArray) -> float:
    """The worst error against its sound's peak; minus infinity where no sound is in error."""
    sounding = peaks > 0.0
    shares = errors[sounding] / peaks[sounding]
    return float(20.0 * np.log10(shares.max())) if shares.size and shares.max() > 0.0 else float("-inf")
