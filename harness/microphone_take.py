"""What a take of a microphone says about itself: the flags of its blocks, in words."""

from collections.abc import Sequence

import numpy as np

from harness.errors import DataRefused
from harness.reading import Reading

FLAGS = "microphone.flags"
CLOCK = "microphone.clock"
CALLBACK = "microphone.callback"

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

_WORDS = {
    SILENCE_INSERTED: "silence was inserted by the sound library (input underflow)",
    SAMPLES_LOST: "samples were lost because the computer was late (input overflow)",
    OTHER_STATUS: "the sound library raised a status that means nothing for a microphone",
    COUNT_BROKEN: "samples are missing or made up: the count of samples does not agree with the clock",
    OVERLOAD: "the microphone's converter was overloaded",
    UNTRIGGERED: "no sound came above the trigger's threshold",
}


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
