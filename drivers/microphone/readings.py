"""Readings made of a microphone's blocks: counts, flags, callback times and the fitted clock.

A sound card counts its own seconds, 10 to 100 ppm away from the computer's, and says of each
block only when the block was handed over. Hand-over comes late now and then, never early by
more than the card's own jitter, so late blocks are given little weight.

This is another fit than that of `harness.bench.clock_fit`, because it is given something else. There,
arrivals are late by chance and never early, over a whole run, and a line under all of them is
sought; no rate is assumed. Here, PortAudio takes the age of a block off its arrival, so that
errors go both ways, and the line must hold a few tenths of a second after a gap, when the rate
is better known from the crystal than from the blocks.
"""

import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.bench.device import Reading
from harness.bench.microphone_take import BAD, COUNT_BROKEN, OVERLOAD, readings_of_take


@dataclass(frozen=True)
class Block:
    """The samples of one audio callback."""

    first: int  #: number of its first sample since the stream began.
    arrived: float  #: s on the bench clock, at the callback.
    age: float  #: s from its first sample's conversion to the callback, as PortAudio states it.
    flags: int  #: of `harness.bench.microphone_take`.
    counts: bytes  #: the bytes of its samples, all channels.


@dataclass(frozen=True)
class Format:
    """The sample format of a microphone's stream."""

    rate: int  #: samples a second, nominal.
    bits: int  #: 24 or 32, of one sample.
    channels: int  #: interleaved in a block.
    channel: int  #: which of them is the microphone, from 0.
    block: int  #: samples in a block.
    latency: float = 0.0  #: s by which the card's times are late, as measured; taken off.

    @property
    def full_scale(self) -> int:
        """The largest count; the smallest is one further from zero."""
        return (1 << (self.bits - 1)) - 1

    def counts(self, raw: bytes) -> AnyArray:
        """``(samples,)`` int32 of the microphone's channel; 24-bit samples keep their sign."""
        if self.bits == 32:
            samples = np.frombuffer(raw, np.dtype("=i4"))
        else:
            wide = np.zeros((len(raw) // 3, 4), np.uint8)
            wide[:, 1:] = np.frombuffer(raw, np.uint8).reshape(-1, 3)
            samples = wide.view(np.dtype("<i4"))[:, 0] >> 8
        return samples.reshape(-1, self.channels)[:, self.channel].astype(np.int32)


class Blocks:
    """The newest blocks of a stream; filled by the sound library's thread, read by any."""

    def __init__(self, capacity: int, size: int) -> None:
        self._kept: deque[Block] = deque(maxlen=capacity)
        self._size = size
        # Re-entrant, so that what is waited for may look at the blocks.
        self._arrived = threading.Condition(threading.RLock())
        self._total = 0
        self.bad = 0  #: blocks since opening that must not be used.

    def add(self, block: Block) -> None:
        """Keep a block and wake whoever waits for one."""
        with self._arrived:
            self.bad += bool(block.flags & BAD)
            self._total += 1
            self._kept.append(block)
            self._arrived.notify_all()

    @property
    def total(self) -> int:
        """Blocks that have come since opening, kept or not."""
        return self._total

    def newest(self) -> Block | None:
        """The last block, if there is one."""
        with self._arrived:
            return self._kept[-1] if self._kept else None

    def since(self, first: int) -> list[Block]:
        """The kept blocks that hold sample number ``first`` or later ones, oldest first."""
        with self._arrived:
            return [block for block in self._kept if block.first + self._size > first]

    def wait(self, enough: Callable[[], bool], timeout: float) -> bool:
        """Wait until ``enough()``, or ``timeout`` s; looked at after every block."""
        with self._arrived:
            return self._arrived.wait_for(enough, timeout)


class Trigger:
    """Search for the first sample further than a threshold from the baseline, block by block."""

    def __init__(self, blocks: Blocks, form: Format, start: int, baseline: float, threshold: int) -> None:
        self.index = start  #: number of the sample found; ``start`` until then.
        self._blocks = blocks
        self._form = form
        self._next = start
        self._baseline = baseline
        self._threshold = threshold

    def look(self) -> bool:
        """Search the new blocks for a sample above the threshold; its number is then in ``index``."""
        for block in self._blocks.since(self._next):
            loud = np.flatnonzero(np.abs(self._form.counts(block.counts) - self._baseline) > self._threshold)
            self._next = block.first + self._form.block
            if len(loud):
                self.index = block.first + int(loud[0])
                return True
        return False


CRYSTAL_DRIFT = 100e-6
"""Standard deviation of an audio crystal's rate about its nominal one, before anything is measured."""

_SHARPNESS = 20e-6
"""s: lateness that no fit resolves; the bench clock and the callback's own jitter."""

_ROUNDS = 30
_MAD_TO_DEVIATION = 1.4826


@dataclass(frozen=True)
class SampleClock:
    """A straight line from sample number to bench clock."""

    index: float  #: the sample number at which the line is anchored.
    time: float  #: s on the bench clock, of that sample.
    rate: float  #: samples per bench-clock second.
    residual: float  #: s, median distance of the blocks' measured times from the line.
    uncertainty: float  #: s, standard deviation of the line at its anchor, as if blocks erred independently.

    def times(self, indices: FloatArray) -> FloatArray:
        """Bench-clock seconds of samples, ``(n,)``."""
        return self.time + (indices - self.index) / self.rate


def fit_clock(indices: FloatArray, times: FloatArray, nominal_rate: float) -> SampleClock:
    """The line through blocks' measured times, late blocks given little weight.

    A least-squares line reweighted by ``min(1, s / late)``, ``s`` the median absolute residual
    (Huber's weights, on the late side only). The rate is held to its nominal value with the
    standard deviation `CRYSTAL_DRIFT`, so that a second of blocks cannot invent a drift.

    Args:
        indices: ``(n,)`` number of each block's first sample, ascending.
        times: ``(n,)`` s on the bench clock, when that sample was taken as far as is known.
        nominal_rate: samples a second.

    Raises:
        ValueError: there is no block.
    """
    if len(indices) == 0:
        raise ValueError("a clock cannot be fitted to no block")
    anchor = float(indices[-1])
    elapsed = (indices - anchor) / nominal_rate
    excess = times - times[-1] - elapsed  # what the nominal rate leaves unexplained
    weights = np.ones_like(excess)
    scale = _SHARPNESS
    offset = stretch = 0.0
    for _ in range(_ROUNDS):
        # Weighted linear fit; `CRYSTAL_DRIFT` is the prior deviation of its slope.
        total = weights.sum()
        mean_x, mean_y = weights @ elapsed / total, weights @ excess / total
        spread = weights @ (elapsed - mean_x) ** 2 + (scale / CRYSTAL_DRIFT) ** 2
        stretch = float(weights @ ((elapsed - mean_x) * (excess - mean_y)) / spread)
        offset = float(mean_y - stretch * mean_x)
        residuals = excess - offset - stretch * elapsed
        scale = max(_SHARPNESS, _MAD_TO_DEVIATION * float(np.median(np.abs(residuals))))
        weights = np.where(residuals > scale, scale / np.maximum(residuals, scale), 1.0)
    residual = float(np.median(np.abs(excess - offset - stretch * elapsed)))
    # Standard deviation of the line at the last block, in s.
    total = weights.sum()
    mean = weights @ elapsed / total
    spread = weights @ (elapsed - mean) ** 2 + (scale / CRYSTAL_DRIFT) ** 2
    uncertainty = float(scale * np.sqrt(1.0 / total + mean**2 / spread))
    return SampleClock(
        anchor, float(times[-1]) + offset, nominal_rate / (1.0 + stretch), residual, uncertainty
    )


def steps(indices: FloatArray, times: FloatArray, nominal_rate: float, settle: int) -> FloatArray:
    """How far the samples' numbers and the clock come apart, in s, place by place.

    Samples lost without a word make every later block late; samples made up make every later
    block early. One late block does neither. The earliest of the ``settle`` blocks before a
    place is compared with the earliest of the ``settle`` blocks from it on, by the nominal
    rate: a crystal's drift of 100 ppm adds 0.1 ms a second.

    Args:
        indices: ``(n,)`` number of each block's first sample, ascending.
        times: ``(n,)`` s on the bench clock, when that sample was taken as far as is known.
        nominal_rate: samples a second.
        settle: blocks on either side of a place, above zero.

    Returns:
        ``(n + 1 - 2 settle,)``, the k-th for the place before block ``k + settle``: positive
        where samples are missing, negative where there are too many. Empty for fewer blocks.
    """
    if len(indices) < 2 * settle:
        return np.zeros(0)
    lateness = times - times[0] - (indices - indices[0]) / nominal_rate
    earliest = np.lib.stride_tricks.sliding_window_view(lateness, settle).min(axis=1)
    return np.asarray(earliest[settle:] - earliest[:-settle], np.float64)


SETTLE = 0.2
"""s of blocks on either side of a place at which samples may be missing."""

_LONGEST_AGE = 2.0
_SMALLEST_STEP = 2e-3
_OVERLOAD_RUN = 3


def starts(blocks: Sequence[Block], form: Format) -> FloatArray:
    """When each block's first sample was converted, s on the bench clock, ``(n,)``, as measured.

    The callback's time less the age that PortAudio states. Some back ends state none or a
    wrong one (PortAudio issues 850 and 94); where one block's age is not between half a block
    and two seconds, none is believed, and a block is taken to arrive as it is full.
    """
    arrived = np.array([block.arrived for block in blocks])
    ages = np.array([block.age for block in blocks])
    return arrived - (ages if states_ages(blocks, form) else form.block / form.rate)


def states_ages(blocks: Sequence[Block], form: Format) -> bool:
    """Whether PortAudio's times of conversion can be believed for these blocks."""
    shortest = 0.5 * form.block / form.rate
    return all(shortest <= block.age <= _LONGEST_AGE for block in blocks)


def clock_of(blocks: Sequence[Block], form: Format) -> SampleClock:
    """The line from sample number to bench clock through these blocks, of which there is one at least."""
    return fit_clock(firsts(blocks), starts(blocks, form), form.rate)


def firsts(blocks: Sequence[Block]) -> FloatArray:
    """``(n,)`` number of each block's first sample."""
    return np.array([block.first for block in blocks], np.float64)


def places_of_doubt(blocks: Sequence[Block], form: Format) -> BoolArray:
    """``(n,)`` whether samples may be missing or made up near a block, by the clock alone.

    A step is one of at least a quarter of a block and `_SMALLEST_STEP`; shorter losses are
    below what hand-over times can show, as are those within `SETTLE` of either end. A step is
    seen from all of the twice `SETTLE` that show it, so up to 0.4 s about it are in doubt.
    """
    settle = int(np.ceil(SETTLE * form.rate / form.block))
    limit = max(_SMALLEST_STEP, 0.25 * form.block / form.rate)
    found = np.abs(steps(firsts(blocks), starts(blocks, form), form.rate, settle)) > limit
    doubtful = np.zeros(len(blocks), np.bool_)
    for place in np.flatnonzero(found):
        doubtful[place + 1 : place + 2 * settle] = True
    return doubtful


def unbroken(blocks: Sequence[Block], doubtful: BoolArray, first: int, form: Format) -> Sequence[Block]:
    """Those after the last gap that ends before sample number ``first``; a clock fits to no others."""
    bad = np.array([bool(block.flags & BAD) for block in blocks])
    before = np.array([block.first + form.block <= first for block in blocks])
    gaps = np.flatnonzero((doubtful | bad) & before)
    return blocks[gaps[-1] + 1 :] if len(gaps) else blocks


def usual_rate(blocks: Sequence[Block], form: Format) -> float:
    """Samples a bench-clock second, the median over spans of 0.2 s: single losses do not change it.

    The nominal rate where fewer than five such spans are given.
    """
    span = int(np.ceil(SETTLE * form.rate / form.block))
    if len(blocks) < 5 * span:
        return float(form.rate)
    number, time = firsts(blocks), starts(blocks, form)
    return float(np.median((number[span:] - number[:-span]) / (time[span:] - time[:-span])))


def overloaded(counts: AnyArray, form: Format) -> bool:
    """Whether three or more neighbouring samples stand at one end of the converter's scale."""
    for end in (form.full_scale, -form.full_scale - 1):
        at_end = (counts == end).astype(np.int64)
        if (
            len(at_end) >= _OVERLOAD_RUN
            and np.convolve(at_end, np.ones(_OVERLOAD_RUN)).max() >= _OVERLOAD_RUN
        ):
            return True
    return False


def readings(
    blocks: Sequence[Block], first: int, end: int, form: Format, opened: float, flags: int = 0
) -> tuple[Reading, ...]:
    """What was recorded, and what is known of it.

    Args:
        blocks: consecutive; those of the take, some that came before it and `SETTLE` s after it.
        first: number of the take's first sample.
        end: number of the sample after its last.
        form: of their bytes.
        opened: s on the bench clock, when the stream was.
        flags: raised for every block of the take.

    Returns:
        ``microphone.pressure`` counts ``(n, block)``; ``microphone.flags`` ``(n,)``, of
        `harness.bench.microphone_take`; ``microphone.callback`` ``(n, 2)`` s, arrival on the bench
        clock and age of the first sample as PortAudio states it, 0 where it states none;
        ``microphone.clock`` ``(1, 6)``, of `harness.bench.microphone_take`. All but the last have the
        fitted times of the blocks' first samples, less the latency that the form states.
    """
    doubtful = places_of_doubt(blocks, form)
    inside = [block.first < end and block.first + form.block > first for block in blocks]
    take = [block for block, is_inside in zip(blocks, inside, strict=True) if is_inside]
    clock = clock_of(unbroken(blocks, doubtful, first, form), form)
    times = clock.times(firsts(take)) - form.latency
    counts = np.stack([form.counts(block.counts) for block in take])
    flags |= COUNT_BROKEN if np.any(doubtful[inside]) else 0
    flags |= OVERLOAD if overloaded(counts.ravel(), form) else 0
    raised = np.array([block.flags | flags for block in take])
    callback = np.array([(block.arrived, block.age) for block in take])
    time = clock.time - form.latency
    line = np.array([clock.index, time, clock.rate, clock.residual, clock.uncertainty, opened])
    return readings_of_take(times, counts, raised, callback, line, float(form.rate))
