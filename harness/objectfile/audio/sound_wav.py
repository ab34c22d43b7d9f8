"""A computed sound as a WAV file, for ears."""

import io
import math
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.wav import write_pcm
from harness.basics.whole_file import write_bytes_whole

BITS = 24
"""Of a sample: its rounding lies 140 dB below full scale, under what a sum of modes is in error."""

HEADROOM = 10.0 ** (1.0 / 20.0)
"""Of full scale above the loudest sample where nobody asks for a scale: 1 dB, as a player that resamples
overshoots."""

_MOST_RATE = (2**32 - 1) // (BITS // 8)


def write_wav(path: Path, sound: FloatArray, rate: float, full_scale: float | None = None) -> float:
    """Write one channel of 24 bits; what full scale is.

    Args:
        path: of the file.
        sound: ``(t,)`` finite, not silent.
        rate: samples per second, a whole number.
        full_scale: the value that a sample of 2^23 counts has, in the sound's unit; None for 1 dB
            more than the loudest.

    Returns:
        The full scale: a sample's value is its count times that over 2^23.

    Raises:
        WrongUse: a rate that the file cannot say, or a full scale below the loudest sample.
    """
    whole = wav_rate(rate)
    loudest = float(np.abs(sound).max())
    scale = HEADROOM * loudest if full_scale is None else full_scale
    most = (1 << (BITS - 1)) - 1
    if not (math.isfinite(scale) and scale * most >= loudest * (most + 1) and loudest > 0.0):
        raise WrongUse(
            f"a full scale of {scale:g} cannot hold a sound whose loudest sample is {loudest:g}; say "
            f"at least {1.001 * loudest:.4g}"
        )
    counts = np.rint(sound * ((most + 1) / scale)).astype(np.int64)
    stream = io.BytesIO()
    write_pcm(stream, counts, whole, BITS)
    write_bytes_whole(path, stream.getvalue())
    return scale


def wav_rate(rate: float) -> int:
    """The rate as the file says it.

    Raises:
        WrongUse: it is not a whole number above 0, or its bytes per second do not fit into four bytes.
    """
    if not (1.0 <= rate <= _MOST_RATE and rate == round(rate)):
        raise WrongUse(f"a WAV cannot say {rate:g} samples per second; say a whole number above 0, as 44100")
    return round(rate)
