"""One channel of whole-number samples as a WAV file."""

import wave
from typing import BinaryIO

import numpy as np

from harness.basics.arrays import IntArray


def write_pcm(file: str | BinaryIO, counts: IntArray, rate: int, bits: int) -> None:
    """Write one channel.

    Args:
        file: a path, or a stream to write to.
        counts: ``(t,)``, each within a signed number of so many bits.
        rate: samples per second.
        bits: of a sample: 24 or 32.
    """
    width = bits // 8
    with wave.open(file, "wb") as written:
        written.setnchannels(1)
        written.setsampwidth(width)
        written.setframerate(rate)
        # Little end first: the bytes that a narrower sample leaves out are the last ones.
        written.writeframes(counts.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :width].tobytes())
