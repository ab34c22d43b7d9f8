"""A sum of decaying sines as products of two tables: underdamped modes after one impulse.

The kernels of ``harness.sim.sound.synthesis_kernels`` make the tables; here is which modes are in them, for
how long, and in which order they are multiplied. Many modes that hardly die away are left to
``harness.sim.sound.synthesis_spectrum``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg.blas import dgemm, sgemm

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.sim.sound.synthesis_kernels import MEMORY, TILE, block_counts, fill, largest_rest
from harness.sim.sound.synthesis_spectrum import add_modes, may_be_added

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
            starts = self._starts(group, begin, counts)
            self._gemm(1.0, group.within.T, starts.T, 1.0, product[:rows].T, trans_a=True, overwrite_c=True)
        np.multiply(product, scale, out=sound[: len(product)], dtype=np.float64)

    def _starts(self, group: _Group, begin: int, counts: IntArray) -> AnyArray:
        """``(rows, 2 TILE tiles)``: where each block begins."""
        weights = self._weights[group.modes]
        if begin:
            weights = weights * self._steps.over(begin * self._block)[group.modes]
        starts = MEMORY.piece((int(counts[0]), group.within.shape[1]), self._type)
        for tile, count in enumerate(counts):
            starts[max(count, 0) :, 2 * TILE * tile : 2 * TILE * (tile + 1)] = 0.0
        fill(starts, counts, _in_tiles(weights), _in_tiles(self._ahead[group.modes]), self._floor, False)
        return starts


def _together(counts: IntArray) -> list[slice]:
    """Runs of whole tiles whose counts are like, of descending counts, ``TOGETHER`` modes at most."""
    groups, first = [], 0
    for tile in range(TILE, len(counts), TILE):
        if counts[tile] < _LIKE * counts[first] or tile - first >= TOGETHER:
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
