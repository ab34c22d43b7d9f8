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


class Striker:
    """Hands the box the record of a strike soon after the output was switched on.

    A record takes longer to compute than a block lasts, so it is computed beside the box's loop;
    what it holds in front of the blow is quiet, and a little more of that changes nothing.

    Args:
        strikes: of the run.
        firing: the newest firing.
    """

    def __init__(self, strikes: StrikeCounts, firing: Callable[[], Firing]) -> None:
        self._strikes = strikes
        self._firing = firing
        self._seen = firing().number
        self._made: list[AnyArray] = []
        self._thread: threading.Thread | None = None

    def next_record(self) -> AnyArray | None:
        """The record of a new firing, once; None while there is none."""
        firing = self._firing()
        busy = self._thread is not None and self._thread.is_alive()
        if firing.number != self._seen and not busy:
            self._seen = firing.number
            self._thread = threading.Thread(target=self._make, args=(firing,), daemon=True)
            self._thread.start()
        return self._made.pop() if self._made else None

    def _make(self, firing: Firing) -> None:
        self._made.append(self._strikes.record(firing.base_from_flange, firing.step, firing.sample))
