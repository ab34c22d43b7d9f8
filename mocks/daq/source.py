"""What the wires of a hammer and a microphone carry, in counts of the box they end in."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray


@dataclass(frozen=True)
class Wiring:
    """How newtons and pascals become counts: the truth, which a calibration only approximates.

    Attributes:
        counts_per_newton: cell, conditioner and converter.
        counts_per_pascal: the same of the microphone.
        offsets: counts of (hammer, microphone) at rest.
        noise: counts rms of (hammer, microphone).
        full_scale: greatest count; beyond it the converter stays there.
    """

    counts_per_newton: float
    counts_per_pascal: float
    offsets: tuple[float, float]
    noise: tuple[float, float]
    full_scale: int = 2**15 - 1

    def counts(self, force: FloatArray, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """Counts of one record.

        Args:
            force: ``(t,)`` N, at the moments of input 0.
            pressure: ``(t,)`` Pa, at the moments of input 1 (see ``skewed``).
            noise: drawn from for both channels.

        Returns:
            ``(t, 2)`` int16.
        """
        volts = np.stack([force * self.counts_per_newton, pressure * self.counts_per_pascal], axis=1)
        noisy = volts + np.array(self.offsets) + noise.normal(size=volts.shape) * np.array(self.noise)
        clipped: AnyArray = np.clip(np.rint(noisy), -self.full_scale - 1, self.full_scale).astype(np.int16)
        return clipped


def skewed(signal: FloatArray, fraction: float) -> FloatArray:
    """``(t,)`` the signal as a converter sees it that comes ``fraction`` of a sample late.

    By a phase ramp over a padded spectrum, which is exact for a signal that begins and ends at rest.
    With two channels in the scan list the second is half a sample late.
    """
    length = 2 * len(signal)
    spectrum = np.fft.rfft(signal, length)
    late: FloatArray = np.fft.irfft(
        spectrum * np.exp(2j * np.pi * fraction * np.fft.rfftfreq(length)), length
    )
    return late[: len(signal)]


class Played:
    """Idles until there is a record to play; a ``Source``.

    What a strike's record holds in front of the strike is the hammer's flight: from the moment
    the striker is fired, every sample is the record's, whatever the timing was.

    Args:
        idle: ``(p, 2)`` int16 counts, repeated while nothing happens.
        next_record: asked before every block; a ``(t, 2)`` int16 record to play from now on, or None.
            A record that is still being played is broken off.
    """

    def __init__(self, idle: AnyArray, next_record: Callable[[], AnyArray | None]) -> None:
        self._idle = idle
        self._next_record = next_record
        self._record: AnyArray = np.zeros((0, 2), np.int16)
        self._record_begin = 0

    def __call__(self, first: int, count: int) -> AnyArray:
        """Counts of ``count`` scans from ``first``."""
        record = self._next_record()
        if record is not None:
            self._record, self._record_begin = record, first
        numbers = np.arange(first, first + count)
        counts: AnyArray = self._idle[numbers % len(self._idle)].copy()
        at = numbers - self._record_begin
        playing = (at >= 0) & (at < len(self._record))
        counts[playing] = self._record[at[playing]]
        return counts
