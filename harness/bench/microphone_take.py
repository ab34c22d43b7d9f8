"""What a take of a microphone says about itself: the flags of its blocks, in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.bench.acquisition_channels import PRESSURE, block_channel
from harness.bench.device import Channel, Reading

FLAGS = "microphone.flags"
CLOCK = "microphone.clock"
CALLBACK = "microphone.callback"

CLOCK_FIELDS = ("sample", "time", "rate", "residual", "uncertainty", "opened")
"""Of the one sample of ``microphone.clock``: a sample's number since the stream began, its bench time in s,
samples a second, the median distance of the blocks from this line in s, the line's own standard deviation
in s, and the bench time in s at which the stream was opened."""

SILENCE_INSERTED = 1
"""The sound library put silence in place of samples that it did not have (input underflow)."""
SAMPLES_LOST = 2
"""Samples were thrown away before or in this block, because nobody fetched them (input overflow)."""
OTHER_STATUS = 4
"""A status that PortAudio documents for output streams only; the block is not trusted."""
COUNT_BROKEN = 8
"""The blocks' numbers and the clock come apart in this take, though no status said so."""
OVERLOAD = 16
"""Three or more neighbouring samples at the converter's end of scale."""
UNTRIGGERED = 32
"""The take was asked to wait for a sound, and none came."""

BAD = SILENCE_INSERTED | SAMPLES_LOST | OTHER_STATUS | COUNT_BROKEN
"""A take with any of these must not be used: its sample count is not time."""

UNSURE = 100e-6
"""s, standard deviation of a take's place on the bench clock beyond which it must not be used: what
`harness.recording.observation` finds by the sounds of a run lies within four times this."""

_WORDS = {
    SILENCE_INSERTED: "silence was inserted by the sound library (input underflow)",
    SAMPLES_LOST: "samples were lost because the computer was late (input overflow)",
    OTHER_STATUS: "the sound library raised a status that means nothing for a microphone",
    COUNT_BROKEN: "samples are missing or made up: the count of samples does not agree with the clock",
    OVERLOAD: "the microphone's converter was overloaded",
    UNTRIGGERED: "no sound came above the trigger's threshold",
}


@dataclass(frozen=True)
class Take:
    """What is known of a take by a microphone on a clock of its own."""

    flags: int  #: all that were raised.
    uncertainty: float  #: s, standard deviation of its place on the bench clock, from one strike to another.
    residual: float  #: s, median distance of the blocks from the clock that was fitted to them.
    opened: float  #: s on the bench clock, when the stream was: takes of one stream share an unknown latency.

    @property
    def fault(self) -> str:
        """Why the take must not be used; empty where it may be."""
        if self.flags & BAD:
            return "; ".join(words(self.flags & BAD))
        if self.uncertainty > UNSURE:
            return (
                f"the sound card's clock is known to {1e6 * self.uncertainty:.0f} us and at most "
                f"{1e6 * UNSURE:.0f} us can be used: it does not say when it sampled, or comes unevenly"
            )
        return ""


def take_of(readings: Mapping[str, Reading]) -> Take | None:
    """What the readings of a strike say of a microphone of its own; None where the hammer's box heard it.

    Raises:
        DataRefused: the microphone recorded flags and no clock, or flags that mean nothing.
    """
    if FLAGS not in readings:
        return None
    flags = flags_of([readings[FLAGS]])
    words(flags)
    if CLOCK not in readings or readings[CLOCK].values.shape != (1, len(CLOCK_FIELDS)):
        raise DataRefused(
            f"the take has {FLAGS}, and no {CLOCK} of {len(CLOCK_FIELDS)} numbers to go with it"
        )
    said = dict(zip(CLOCK_FIELDS, readings[CLOCK].values[0].tolist(), strict=True))
    return Take(flags, said["uncertainty"], said["residual"], said["opened"])


def flags_of(readings: Sequence[Reading]) -> int:
    """All flags raised in a take, in one number.

    Raises:
        DataRefused: the readings hold no flags of a microphone.
    """
    for reading in readings:
        if reading.channel.name == FLAGS:
            return int(np.bitwise_or.reduce(reading.values.astype(np.int64))) if len(reading.values) else 0
    names = ", ".join(reading.channel.name for reading in readings) or "none"
    raise DataRefused(f"a microphone's take has the channel {FLAGS}; these readings have: {names}")


def words(flags: int) -> tuple[str, ...]:
    """What flags mean, a sentence each.

    Raises:
        DataRefused: a bit that no flag has.
    """
    unknown = flags & ~sum(_WORDS)
    if unknown:
        raise DataRefused(f"a microphone's flags have the bit {unknown}, which means nothing here")
    return tuple(text for bit, text in _WORDS.items() if flags & bit)


def readings_of_take(
    times: FloatArray, counts: AnyArray, flags: AnyArray, callbacks: FloatArray, line: FloatArray, rate: float
) -> tuple[Reading, ...]:
    """The recorded form of a take.

    Args:
        times: ``(n,)`` s on the bench clock, of the first sample of each block.
        counts: ``(n, block)``.
        flags: ``(n,)`` of each block.
        callbacks: ``(n, 2)`` s: when each block was handed over, and the age that was stated of it.
        line: of the fitted clock, in the order of ``CLOCK_FIELDS``.
        rate: nominal, of samples: not of blocks.
    """

    def channel(name: str, unit: str, shape: tuple[int, ...], dtype: str) -> Channel:
        return Channel(name, unit, shape, dtype, "", rate)

    return (
        Reading(block_channel(PRESSURE, counts.shape[1], rate), times, counts),
        Reading(channel(FLAGS, "1", (), "uint8"), times, flags),
        Reading(channel(CALLBACK, "s", (2,), "float64"), times, callbacks),
        Reading(channel(CLOCK, "1", (len(CLOCK_FIELDS),), "float64"), times[:1], line[None]),
    )
