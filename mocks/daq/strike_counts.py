"""From the world's strikes to the counts of the box that reads them, and when each is played."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition import AcquisitionCalibration
from mocks.shared_pose import Firing
from mocks.world.sound import StrikeTruth, WorldSound


@dataclass(frozen=True)
class Wiring:
    """How newtons and pascals become counts: the truth, which a calibration only approximates."""

    counts_per_newton: float  #: cell, conditioner and converter.
    counts_per_pascal: float  #: the same of the microphone.
    offsets: tuple[float, float]  #: counts of (hammer, microphone) at rest.
    noise: tuple[float, float]  #: counts rms of (hammer, microphone).
    full_scale: int = 2**15 - 1  #: greatest count; beyond it the converter stays there.

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


CONVERTER_NOISE = 0.7
"""Counts rms of a 16-bit converter: its data sheet's 0.5 and the conditioner's own."""

SKEW = 0.5
"""Of a sample, by which a converter of two channels reads the second one later."""

_IDLE = 2.0


class StrikeCounts:
    """What the box reads of the strikes of one run.

    Args:
        sound: of the run.
        calibration: that is believed in; the world's force cell has a gain of its own.
        hears: whether the microphone is on input 1; else that is shorted.
    """

    def __init__(self, sound: WorldSound, calibration: AcquisitionCalibration, hears: bool = True) -> None:
        self.sound = sound
        self._wiring = Wiring(
            counts_per_newton=sound.force_gain / calibration.newtons_per_count,
            counts_per_pascal=1.0 / calibration.pascals_per_count if hears else 0.0,
            offsets=(calibration.hammer_offset, calibration.microphone_offset if hears else 0.0),
            noise=(CONVERTER_NOISE, CONVERTER_NOISE),
            full_scale=calibration.full_scale_counts,
        )

    def record(self, base_from_flange: FloatArray, step: int, sample: int) -> AnyArray:
        """``(t, 2)`` int16, from the switching of the striker's output on."""
        return self.read(self.sound.strike(base_from_flange, step, sample), step, sample)

    def read(self, truth: StrikeTruth, step: int, sample: int) -> AnyArray:
        """``(t, 2)`` int16 of a strike as it was."""
        return self._counts(truth.force, truth.pressure, self.sound.converter_noise(step, sample))

    def idle(self) -> AnyArray:
        """``(t, 2)`` int16: what is read while nothing is struck, to be repeated."""
        ambient = self.sound.idle(_IDLE)
        return self._counts(np.zeros(len(ambient)), ambient, self.sound.converter_noise(-1, -1))

    def _counts(self, force: FloatArray, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        return self._wiring.counts(force, skewed(pressure, SKEW), noise)


class StrikesOnBox:
    """Samples of inputs 0 and 1 of the hammer's box: idle except for each strike's record; a ``Source``.

    A record takes longer to compute than a block lasts, so it is computed beside the box's loop, and begins
    with the next block after that. What it holds in front of the blow is the hammer's flight, which is quiet,
    and a little more of that changes nothing. A record that is still being played is broken off.
    """

    def __init__(self, strikes: StrikeCounts, firing: Callable[[], Firing]) -> None:
        self._strikes = strikes
        self._firing = firing
        self._idle = strikes.idle()
        self._seen = firing().number
        self._next = 0
        self._playing: tuple[int, AnyArray] = (0, self._idle[:0])
        self._thread: threading.Thread | None = None

    def __call__(self, first: int, count: int) -> AnyArray:
        """Counts of ``count`` scans from ``first``."""
        self._next = first + count
        firing = self._firing()
        busy = self._thread is not None and self._thread.is_alive()
        if firing.number != self._seen and not busy:
            self._seen = firing.number
            self._thread = threading.Thread(target=self._strike, args=(firing,), daemon=True)
            self._thread.start()
        numbers = np.arange(first, first + count)
        counts: AnyArray = self._idle[numbers % len(self._idle)].copy()
        begin, record = self._playing
        here = (numbers >= begin) & (numbers < begin + len(record))
        counts[here] = record[numbers[here] - begin]
        return counts

    def _strike(self, firing: Firing) -> None:
        record = self._strikes.record(firing.base_from_flange, firing.step, firing.sample)
        self._playing = self._next, record
