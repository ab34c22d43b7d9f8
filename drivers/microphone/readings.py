"""Readings made of a microphone's blocks: counts, flags, callback times and the fitted clock."""

from collections.abc import Sequence

import numpy as np

from drivers.microphone.blocks import Block, Format
from drivers.microphone.clock import SampleClock, fit_clock, steps
from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.bench.acquisition_channels import PRESSURE, block_channel
from harness.bench.microphone_take import BAD, CALLBACK, CLOCK, CLOCK_FIELDS, COUNT_BROKEN, FLAGS, OVERLOAD
from harness.bench.reading import Channel, Reading

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
    line = np.array([[clock.index, time, clock.rate, clock.residual, clock.uncertainty, opened]])
    return (
        Reading(block_channel(PRESSURE, form.block, form.rate), times, counts),
        Reading(_channel(FLAGS, "1", (), "uint8", form), times, raised),
        Reading(_channel(CALLBACK, "s", (2,), "float64", form), times, callback),
        Reading(_channel(CLOCK, "1", (len(CLOCK_FIELDS),), "float64", form), times[:1], line),
    )


def _channel(name: str, unit: str, shape: tuple[int, ...], dtype: str, form: Format) -> Channel:
    """A channel of a microphone; its nominal rate is that of its samples, not of its blocks."""
    return Channel(name, unit, shape, dtype, "", float(form.rate))
