"""The sound of a unit impulse: a sum of decaying sines, of any length and at any rate.

``S(t) = sum_i (w_i / w_di) Im(g_i exp((-d_i + i w_di) t))`` with ``w_d = sqrt(w^2 - d^2)``: what
``harness.sim.modal_sound.ring`` answers to one impulse, at a hundredth of the cost. ``w / w_d`` is one to
5e-5 for a mode damped by a hundredth of the critical damping, and carries the sum through critical
damping, see ``modal_sound.impulse_response``.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg.blas import dgemm, sgemm

from harness.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.errors import WrongUse
from harness.sim.modal_sound import audible, check_modes, check_rate, impulse_response, is_heavy
from harness.sim.synthesis_kernels import TILE, block_counts, fill, largest_rest

SynthesisLevel = Literal["fast", "double", "exact"]
"""``"fast"``: tables in single precision from phases in double, for every use; ``"double"``: tables in
double precision; ``"exact"``: every sine of every mode summed in double precision, the reference."""

CUTS: Mapping[SynthesisLevel, float] = {"fast": 100.0, "double": 260.0}
"""dB: all modes that are left out late together stay that far below the root of the sum of squares of
all first amplitudes. Few are ever near their share of it: with random amplitudes of a hundred modes
or more it comes to 25 dB more."""

_FLOORS: Mapping[SynthesisLevel, float] = {"fast": 1e-12, "double": 1e-140}
"""Entries of a table below are zero: neither a product nor a difference of two is then subnormal."""

_MULTIPLE = 16
"""Blocks in which a mode sounds are rounded up to it, so that few products of matrices are needed."""

_SEGMENT = 2048
"""Blocks of one table, which is made anew for each segment of a long sound."""

_LIKE = 0.75
"""Modes are multiplied together that sound for at least this share of the longest among them."""

_FADED = 65.0
"""Times the time constant after which a heavily damped mode is over: 1e-28."""

_SUMMED = 4096
"""Samples that are summed directly at a time."""

_SIGMAS = 4.5
"""A normal error exceeds it once in 150 000 samples."""


@dataclass(frozen=True, eq=False)
class Synthesis:
    """Sounds and how far to trust them.

    Attributes:
        sound: ``(k, t)``, float64, in the unit of the amplitudes.
        rate: samples per second.
        left_out: ``(m,)``: the modes at or above half of the rate, which have no part in it.
        error: dB, of the worst sample against the same sum in exact arithmetic, relative to the
            loudest sample of the same sound, the worst of the sounds; what the modes left out late
            and the phases add to it is a bound, what rounding adds an estimate at 4.5 standard
            deviations of a random walk. Minus infinity for silence.
        seconds: s on the clock that it took.
    """

    sound: FloatArray
    rate: float
    left_out: BoolArray
    error: float
    seconds: float


@dataclass(frozen=True, eq=False)
class _Steps:
    """Underdamped modes, and how each turns from sample to sample.

    Attributes:
        dampings: ``(m,)`` 1/s.
        turns: ``(m,)`` turns of the phase per sample.
        rate: samples per second.
    """

    dampings: FloatArray
    turns: FloatArray
    rate: float

    def take(self, order: IntArray) -> "_Steps":
        return _Steps(self.dampings[order], self.turns[order], self.rate)

    def over(self, samples: int) -> AnyArray:
        """``(m,)`` complex factor of some samples; the phase loses no whole turns to rounding."""
        turns = samples * self.turns
        decay = np.exp(-self.dampings * (samples / self.rate))
        return np.asarray(decay * np.exp(2j * np.pi * (turns - np.rint(turns))))


def synthesize(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: AnyArray,
    duration: float,
    rate: float,
    level: SynthesisLevel = "fast",
) -> Synthesis:
    """The sounds of modes that all start with one impulse at the first sample.

    One core serves best: call it under ``threadpool_limits(1)`` where other programs run.

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
    sound, errors = _blocks(f[~direct], d[~direct], parts[:, ~direct], samples, rate, level)
    if direct.any():
        sound += _summed(f[direct], d[direct], parts[:, direct], samples, rate)
    peaks = np.maximum(sound.max(axis=1), -sound.min(axis=1))
    errors += _phase_errors(f, d, parts, samples / rate) + _rounding(parts, peaks, level)
    return Synthesis(
        read_only(sound), rate, read_only(~heard), _decibels(errors, peaks), time.perf_counter() - begun
    )


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
        steps = _Steps(dampings, split / (2.0 * np.pi * rate), rate)
        weights = np.real(amplitudes) * (omega / split) + 1j * np.imag(amplitudes)
        for strike, each in enumerate(weights):
            rests[strike] = _one(steps, each, sound[strike], level)
    return sound.reshape(len(amplitudes), -1)[:, :samples], rests


def _block_length(samples: int) -> int:
    """A power of two near the root of the samples: both tables are then about as long."""
    return min(max(1 << (samples.bit_length() - 1) // 2, 32), 256)


def _one(steps: _Steps, weights: AnyArray, sound: FloatArray, level: SynthesisLevel) -> float:
    """Fill ``(blocks, block)`` samples of one sound; returns the most that was left out."""
    sizes = np.abs(weights)
    loudest = float(sizes.max())
    if loudest == 0.0:
        return 0.0
    sizes /= loudest
    blocks, length = sound.shape
    seconds = length / steps.rate
    quiet = 10.0 ** (-CUTS[level] / 20.0) * float(np.linalg.norm(sizes)) / len(sizes)
    counts = block_counts(sizes, steps.dampings, quiet, seconds, blocks, _MULTIPLE)
    rest = largest_rest(sizes, steps.dampings, counts, seconds, blocks, _MULTIPLE)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    tables = _Tables(steps.take(order), weights[order] / loudest, counts[order], level, length)
    for first in range(0, int(counts[order[0]]), _SEGMENT):
        tables.multiply(first, loudest, sound[first : first + _SEGMENT])
    return loudest * (rest + 4.0 * len(sizes) * _FLOORS[level])


@dataclass(frozen=True, eq=False)
class _Group:
    """Modes that fall silent at about the same time.

    Attributes:
        modes: of the ordered ones, from and to.
        counts: ``(tiles,)`` blocks in which each tile sounds.
        within: ``(block, 2 TILE tiles)`` table of one block.
    """

    modes: slice
    counts: IntArray
    within: AnyArray


class _Tables:
    """The tables of one sound, its modes in the order in which they fall silent, last first.

    Each group is multiplied for as many blocks as its longest mode sounds and added to the sum, so
    that every entry of a table is read once.
    """

    def __init__(
        self, steps: _Steps, weights: AnyArray, counts: IntArray, level: SynthesisLevel, block: int
    ) -> None:
        self._steps, self._weights, self._block = steps, weights, block
        self._type = np.dtype(np.float32 if level == "fast" else np.float64)
        self._floor = _FLOORS[level]
        self._gemm = sgemm if level == "fast" else dgemm
        self._ahead = steps.over(block)
        sample = steps.over(1)
        self._groups = tuple(self._group(modes, counts, sample[modes]) for modes in _together(counts))

    def _group(self, modes: slice, counts: IntArray, sample: AnyArray) -> _Group:
        within = np.empty((self._block, _width(len(sample))), self._type)
        whole = np.full(within.shape[1] // (2 * TILE), self._block)
        fill(within, whole, _in_tiles(np.ones_like(sample)), _in_tiles(sample), self._floor, True)
        return _Group(modes, counts[modes][::TILE].copy(), within)

    def multiply(self, begin: int, scale: float, sound: FloatArray) -> None:
        """Write the blocks of a segment that begins at block ``begin``."""
        product: AnyArray = np.empty(0)
        for group in self._groups:
            counts = np.minimum(group.counts - begin, len(sound))
            rows = int(counts[0])
            if rows <= 0:
                break
            if not product.size:
                product = np.zeros((rows, self._block), self._type)
            starts = self._starts(group, begin, counts)
            self._gemm(1.0, group.within.T, starts.T, 1.0, product[:rows].T, trans_a=True, overwrite_c=True)
        np.multiply(product, scale, out=sound[: len(product)], dtype=np.float64)

    def _starts(self, group: _Group, begin: int, counts: IntArray) -> AnyArray:
        """``(rows, 2 TILE tiles)``: where each block begins."""
        weights = self._weights[group.modes]
        if begin:
            weights = weights * self._steps.over(begin * self._block)[group.modes]
        starts = np.zeros((int(counts[0]), group.within.shape[1]), self._type)
        fill(starts, counts, _in_tiles(weights), _in_tiles(self._ahead[group.modes]), self._floor, False)
        return starts


def _together(counts: IntArray) -> list[slice]:
    """Runs of whole tiles whose counts are like, of descending counts."""
    groups, first = [], 0
    for tile in range(TILE, len(counts), TILE):
        if counts[tile] < _LIKE * counts[first]:
            groups.append(slice(first, tile))
            first = tile
    return [*groups, slice(first, len(counts))]


def _width(modes: int) -> int:
    """Columns of a table."""
    return 2 * TILE * -(-modes // TILE)


def _in_tiles(values: AnyArray) -> FloatArray:
    """``(2, TILE tiles)`` real and imaginary parts, zero beyond the values."""
    parts = np.zeros((2, _width(len(values)) // 2))
    parts[0, : len(values)], parts[1, : len(values)] = values.real, values.imag
    return parts


def _summed(
    frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray, samples: int, rate: float
) -> FloatArray:
    """``(k, t)``: every mode's own answer, added up in double precision."""
    omega = 2.0 * np.pi * frequencies
    over = np.sqrt(np.maximum((dampings - omega) * (dampings + omega), 0.0))
    slowest = float(
        np.min(np.where(dampings > omega, omega**2 / np.maximum(dampings + over, omega), dampings))
    )
    lasting = samples if slowest * samples <= _FADED * rate else int(np.ceil(_FADED / slowest * rate))
    sound = np.zeros((len(amplitudes), samples))
    for begin in range(0, lasting, _SUMMED):
        times = np.arange(begin, min(begin + _SUMMED, lasting)) / rate
        part = np.real(amplitudes) @ impulse_response(times, frequencies, dampings)
        if np.iscomplexobj(amplitudes):
            part += np.imag(amplitudes) @ impulse_response(times, frequencies, dampings, quadrature=True)
        sound[:, begin : begin + len(times)] = part
    return sound


def _phase_errors(
    frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray, duration: float
) -> FloatArray:
    """``(k,)``: a phase known to four roundings of its turns, at the time when that tells most."""
    lasting = np.minimum(duration, 1.0 / (np.e * np.maximum(dampings, 1e-300)))
    off = 4.0 * np.finfo(np.float64).eps * np.pi * frequencies * lasting
    return np.asarray(np.abs(amplitudes) @ off)


def _rounding(amplitudes: AnyArray, peaks: FloatArray, level: SynthesisLevel) -> FloatArray:
    """``(k,)``: what single roundings add up to, as a random walk along the sum of two terms a mode.

    A partial sum is as large as independent phases make it, or as the sound itself where they agree
    (Higham and Mary, A New Approach to Probabilistic Rounding Error Analysis, SIAM J. Sci. Comput.
    41(5), 2019, for why a walk and not the sum of all roundings).
    """
    unit = float(np.finfo(np.float32 if level == "fast" else np.float64).eps) / 2.0
    typical = np.sqrt(0.5 * np.sum(np.abs(amplitudes) ** 2, axis=1))
    walk = np.sqrt((2.0 + amplitudes.shape[1]) / 3.0)
    return np.asarray(unit * walk * np.maximum(_SIGMAS * typical, peaks))


def _decibels(errors: FloatArray, peaks: FloatArray) -> float:
    """The worst error against its sound's peak; minus infinity where no sound is in error."""
    sounding = peaks > 0.0
    shares = errors[sounding] / peaks[sounding]
    return float(20.0 * np.log10(shares.max())) if shares.size and shares.max() > 0.0 else float("-inf")
