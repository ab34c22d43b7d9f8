"""Synthesize decaying sines as products of two tables: underdamped modes after one impulse.

The kernels of ``harness.sim.sound.synthesis_kernels`` compute the tables; this module chooses the modes in
them, their durations, and the order of the products. The cost of a table grows with the durations. For many
long modes a Fourier transform costs less: within a block of ``L`` samples a mode times a Gaussian window has
a Gaussian spectrum, also at a complex frequency, so that ``2 REACH + 1`` bins suffice. The bins are summed
over all modes, transformed, and divided by the window
(Greengard and Lee, Accelerating the Nonuniform Fast Fourier Transform, SIAM Review 46(3), 2004).
Everything is in double precision; the truncation error is bounded in closed form (``missing``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.fft import next_fast_len
from scipy.linalg.blas import dgemm, sgemm

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.sim.sound.synthesis_kernels import MEMORY, TILE, block_counts, fill, largest_rest

STRETCH = 16_500
"""Approximate number of samples of one transform: an eighth of three seconds."""

_TOGETHER = 8
"""Stretches transformed together, in registers side by side."""

MOST_DECAY = 4.0
"""Times the time constant that a stretch may last: the bells of what dies faster overlap their images."""

REACH = 13
"""Bins of a bell to each side of its nearest one."""

_LONGER = 1.5
"""Smallest number of samples of a transform, as a multiple of the samples of its stretch."""

_WIDTH = 1.6
"""Squared bins: a bell is ``exp(-x^2 / (4 width))`` at ``x`` bins from its middle. Wider ones have nearer
images, narrower ones more of them beyond ``REACH``; at this width both are below 1e-8."""


TableLevel = Literal["fast", "double"]
"""Tables in single precision, from phases in double; or tables in double precision."""

CUTS: Mapping[TableLevel, float] = {"fast": 100.0, "double": 260.0}
"""dB: all modes that are left out late together stay that far below the root of the sum of squares of
all first amplitudes. Few are ever near their share of it: with random amplitudes of a hundred modes
or more it comes to 25 dB more. Modes that all die at one rate are, and sound for longer: see ``_FARTHER``."""

_FARTHER = 20.0
"""dB by which what is left out at any one time is to be below ``CUTS`` even where all end together."""

_FLOORS: Mapping[TableLevel, float] = {"fast": 1e-12, "double": 1e-140}
"""Entries of a table below are zero: neither a product nor a difference of two is then subnormal."""

_MULTIPLE = 16
"""Blocks in which a mode sounds are rounded up to it, so that few products of matrices are needed."""

_SEGMENT = 2048
"""Blocks of one table, which is made anew for each segment of a long sound."""

_LIKE = 0.75
"""Modes are multiplied together that sound for at least this share of the longest among them."""

TOGETHER = 128
"""Modes multiplied together at most: their sum is rounded at its own size, not at that of all, so that
roundings of 2048 modes add up to a third."""

_LASTING = 150
"""Modes as long as the whole sound, or more that are shorter, which transforms sum sooner than tables do."""

_SHORTEST = 4096
"""Samples from which a sound may be summed by transforms."""

SPLITS = 24
"""Groups more than that that ``_LIKE`` can make of a sound of ``_SEGMENT`` blocks, nearly: each sounds
for less than three quarters of the one before."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Underdamped modes, and how each turns from sample to sample."""

    dampings: FloatArray  #: ``(m,)`` 1/s.
    turns: FloatArray  #: ``(m,)`` turns of the phase per sample.
    rate: float  #: samples per second.

    def take(self, order: IntArray) -> "Steps":
        """Some of the modes, in an order."""
        return Steps(self.dampings[order], self.turns[order], self.rate)

    def over(self, samples: int) -> AnyArray:
        """``(m,)`` complex factor of some samples; the phase loses no whole turns to rounding."""
        turns = samples * self.turns
        decay = np.exp(-self.dampings * (samples / self.rate))
        return np.asarray(decay * np.exp(2j * np.pi * (turns - np.rint(turns))))


def fill_sound(steps: Steps, weights: AnyArray, sound: FloatArray, level: TableLevel) -> float:
    """Write ``(blocks, block)`` samples of one sound that is all zero.

    Args:
        steps: of the modes.
        weights: ``(m,)`` complex, of each at time zero.
        sound: written to; its second length is a power of two.
        level: precision.

    Returns:
        The most that any sample lacks of modes left out because they were nearly over, or of their spectrum.
    """
    sizes = np.abs(weights)
    loudest = float(sizes.max())
    if loudest == 0.0:
        return 0.0
    MEMORY.forget()
    sizes /= loudest
    blocks, length = sound.shape
    seconds = length / steps.rate
    counts = _counts(sizes, steps.dampings, seconds, blocks, level)
    # Many slowly decaying modes are summed by their spectrum.
    lasting = may_be_added(steps.dampings, blocks * length, steps.rate) & (counts > 0)
    if level != "fast" or blocks * length < _SHORTEST or counts[lasting].sum() < _LASTING * blocks:
        lasting = np.zeros_like(lasting)
    counts[lasting], sizes[lasting] = 0, 0.0
    rest = largest_rest(sizes, steps.dampings, counts, seconds, blocks, _MULTIPLE)
    missed = loudest * (rest + 4.0 * len(sizes) * _FLOORS[level])
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    if len(order):
        tables = _Tables(steps.take(order), weights[order] / loudest, counts[order], level, length)
        for first in range(0, int(counts[order[0]]), _SEGMENT):
            tables.multiply(first, loudest, sound[first : first + _SEGMENT])
    if lasting.any():
        slow, flat = steps.take(np.flatnonzero(lasting)), sound.reshape(-1)
        missed += add_modes(slow.dampings, slow.turns, weights[lasting], steps.rate, flat)
    return missed


def _counts(
    sizes: FloatArray, dampings: FloatArray, seconds: float, blocks: int, level: TableLevel
) -> IntArray:
    """``(m,)``: blocks of each mode, so many that no sample misses more than ``_FARTHER`` allows."""
    cut = 10.0 ** (-CUTS[level] / 20.0) * float(np.linalg.norm(sizes))
    quiet, most = cut / len(sizes), cut * 10.0 ** (-_FARTHER / 20.0)
    while True:
        counts = block_counts(sizes, dampings, quiet, seconds, blocks, _MULTIPLE)
        rest = largest_rest(sizes, dampings, counts, seconds, blocks, _MULTIPLE)
        if rest <= most:
            return counts
        # Counts are whole multiples, so that a little less may change none.
        quiet *= min(most / rest, 0.8)


@dataclass(frozen=True, eq=False)
class _Group:
    """Modes that fall silent at about the same time."""

    modes: slice  #: of the ordered ones, from and to.
    counts: IntArray  #: ``(tiles,)`` blocks in which each tile sounds.
    within: AnyArray  #: ``(block, 2 TILE tiles)`` table of one block.


class _Tables:
    """The tables of one sound, its modes in the order in which they fall silent, last first.

    Each group is multiplied for as many blocks as its longest mode sounds and added to the sum, so
    that every entry of a table is read once.
    """

    def __init__(
        self, steps: Steps, weights: AnyArray, counts: IntArray, level: TableLevel, block: int
    ) -> None:
        self._steps, self._weights, self._block = steps, weights, block
        self._type = np.dtype(np.float32 if level == "fast" else np.float64)
        self._floor = _FLOORS[level]
        self._gemm = sgemm if level == "fast" else dgemm
        self._ahead = steps.over(block)
        sample = steps.over(1)
        self._groups = tuple(self._group(modes, counts, sample[modes]) for modes in _together(counts))

    def _group(self, modes: slice, counts: IntArray, sample: AnyArray) -> _Group:
        within = MEMORY.piece((self._block, _width(len(sample))), self._type)
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
                product = MEMORY.piece((rows, self._block), self._type)
                product[:] = 0.0
            weights = self._weights[group.modes]
            if begin:
                weights = weights * self._steps.over(begin * self._block)[group.modes]
            starts = MEMORY.piece((int(counts[0]), group.within.shape[1]), self._type)
            for tile, count in enumerate(counts):
                starts[max(count, 0) :, 2 * TILE * tile : 2 * TILE * (tile + 1)] = 0.0
            fill(starts, counts, _in_tiles(weights), _in_tiles(self._ahead[group.modes]), self._floor, False)
            self._gemm(1.0, group.within.T, starts.T, 1.0, product[:rows].T, trans_a=True, overwrite_c=True)
        np.multiply(product, scale, out=sound[: len(product)], dtype=np.float64)


def _together(counts: IntArray) -> list[slice]:
    """Runs of whole tiles whose counts are like, of descending counts, ``TOGETHER`` modes at most."""
    groups, first = [], 0
    for tile in range(TILE, len(counts), TILE):
        if counts[tile] < _LIKE * counts[first] or tile - first >= TOGETHER:
            groups.append(slice(first, tile))
            first = tile
    return [*groups, slice(first, len(counts))]


def _width(modes: int) -> int:
    return 2 * TILE * -(-modes // TILE)


def _in_tiles(values: AnyArray) -> FloatArray:
    parts = np.zeros((2, _width(len(values)) // 2))
    parts[0, : len(values)], parts[1, : len(values)] = values.real, values.imag
    return parts


def may_be_added(dampings: FloatArray, samples: int, rate: float) -> BoolArray:
    """``(m,)``: which modes die slowly enough to be summed by their spectrum.

    Args:
        dampings: ``(m,)`` 1/s.
        samples: of the sound.
        rate: samples per second.
    """
    return np.asarray(dampings * (_stretch(samples) / rate) <= MOST_DECAY)


def add_modes(
    dampings: FloatArray, turns: FloatArray, weights: AnyArray, rate: float, sound: FloatArray
) -> float:
    """Add the sum of ``Im(weight exp((-damping + 2 pi i turns rate) t))`` to a sound.

    Args:
        dampings: ``(m,)`` 1/s, of modes that ``may_be_added``.
        turns: ``(m,)`` of the phase per sample, from 0 to half a turn.
        weights: ``(m,)`` complex, at the first sample.
        rate: samples per second.
        sound: ``(t,)``, C-contiguous, added to.

    Returns:
        The most that any sample lacks.
    """
    stretch = _stretch(len(sound))
    length = 2 * int(next_fast_len(int(np.ceil(0.5 * _LONGER * stretch)), real=True))
    rows = min(_TOGETHER, -(-len(sound) // stretch))
    bins = MEMORY.piece((rows, length // 2 + 1 + 2 * REACH), np.dtype(np.complex128))
    waves = MEMORY.piece((rows, length), np.dtype(np.float64))
    # Half of each: a real transform counts a bin and its mirror image.
    sizes = -0.5j * weights * _passed(dampings, turns, rate, stretch // 2)
    step = _passed(dampings, turns, rate, stretch)
    fades = dampings * (length / (2.0 * np.pi * rate))
    for begin in range(0, len(sound), rows * stretch):
        bins[:] = 0.0
        _spread(bins, sizes, step, length * turns, fades, _WIDTH)
        # The bins of real transforms of even length: what lies below the first or above the last, mirrored.
        last = bins.shape[1] - 2 * REACH - 1
        kept = bins[:, REACH : REACH + last + 1]
        kept[:, 1 : REACH + 1] += np.conj(bins[:, REACH - 1 :: -1])
        kept[:, last - REACH : last] += np.conj(bins[:, : REACH + last : -1])
        # The first and the last are their own mirror images.
        kept[:, [0, last]] *= 2.0
        np.fft.irfft(kept, length, axis=1, norm="forward", out=waves)
        for row, first in zip(waves, range(begin, len(sound), stretch), strict=False):
            _add_wave(row, _inverse_bell(stretch, length), sound[first : first + stretch])
    return float(np.abs(weights) @ missing(dampings * (stretch / rate), stretch, length))


def missing(decays: FloatArray, stretch: int, length: int) -> FloatArray:
    """``(m,)``: the most by which a sample misses a mode, of its size at the beginning of the stretch.

    Of the images of the bell (Poisson's sum) the nearest is largest at an end of the stretch; of the
    bins beyond ``REACH`` all are added up with one sign, where the bell that they are divided by is least.

    Args:
        decays: ``(m,)`` times the time constant that the stretch lasts, ``MOST_DECAY`` at most.
        stretch: samples.
        length: samples of the transform.
    """
    longer = length / stretch
    image = -4.0 * np.pi**2 * _WIDTH * (1.0 - 1.0 / longer)
    images = 2.02 * np.exp(image + decays * (longer - 1.0))
    fade = decays * longer / (2.0 * np.pi)
    away = REACH + 0.5 + np.arange(20.0)
    beyond = 2.0 * np.exp(-(away**2) / (4.0 * _WIDTH)).sum() / np.sqrt(4.0 * np.pi * _WIDTH)
    edge = fade**2 / (4.0 * _WIDTH) + np.pi**2 * _WIDTH / longer**2 - 0.5 * decays
    # Roundings of the transform, of a size of one, where the bell is least.
    rounding = 8.0 * np.finfo(np.float64).eps * np.log2(length) * np.exp(np.pi**2 * _WIDTH / longer**2)
    return np.asarray(images + beyond * np.exp(edge) + rounding)


def _stretch(samples: int) -> int:
    """Number of samples of each transform but the last, which may have fewer; even."""
    return 2 * -(-samples // (2 * max(1, round(samples / STRETCH))))


def _passed(dampings: FloatArray, turns: FloatArray, rate: float, samples: int) -> AnyArray:
    angle = samples * turns
    return np.asarray(np.exp(-dampings * (samples / rate) + 2j * np.pi * (angle - np.rint(angle))))


@lru_cache(maxsize=4)
def _inverse_bell(stretch: int, length: int) -> FloatArray:
    """``(stretch,)``: by what a transform is multiplied, sample after sample of its stretch."""
    place = (np.arange(stretch) - stretch // 2) / length
    return read_only(np.exp(4.0 * np.pi**2 * _WIDTH * place**2))


@compiled
def _add_wave(wave: FloatArray, inverse: FloatArray, sound: FloatArray) -> None:
    """Add a transform, whose first sample is the middle of its stretch, divided by its bell."""
    half = len(inverse) // 2
    before = min(half, len(sound))
    for at in range(before):
        sound[at] += wave[len(wave) - half + at] * inverse[at]
    for at in range(before, len(sound)):
        sound[at] += wave[at - half] * inverse[at]


@compiled
def _spread(
    bins: AnyArray, sizes: AnyArray, step: AnyArray, places: FloatArray, fades: FloatArray, width: float
) -> None:
    """Add every mode's bell to the bins around its place, in every stretch.

    Args:
        bins: ``(stretches, n + 2 REACH)``, bin 0 at ``REACH``.
        sizes: ``(m,)`` complex, at the middle of the first stretch; left as of the one after the last.
        step: ``(m,)`` its factor from one stretch to the next.
        places: ``(m,)`` bins.
        fades: ``(m,)`` imaginary part of the same.
        width: as ``_WIDTH``.
    """
    wide = 2 * REACH + 1
    bell = np.empty(wide, dtype=np.complex128)
    norm = 1.0 / np.sqrt(4.0 * np.pi * width)
    curve = np.exp(-0.5 / width)
    for mode in range(len(sizes)):
        nearest = int(np.rint(places[mode]))
        x = nearest - REACH - places[mode] - 1j * fades[mode]
        value, ratio = norm * np.exp(-x * x / (4.0 * width)), np.exp(-(2.0 * x + 1.0) / (4.0 * width))
        for at in range(wide):
            bell[at] = value
            value *= ratio
            ratio *= curve
        for stretch in range(len(bins)):
            for at in range(wide):
                bins[stretch, nearest + at] += sizes[mode] * bell[at]
            sizes[mode] *= step[mode]
