"""From the world's strikes to the counts of the box that reads them, and when each is played."""

import threading
from collections.abc import Callable

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition import AcquisitionCalibration
from mocks.daq.source import Wiring, skewed
from mocks.shared_pose import Firing
from mocks.world.sound import StrikeTruth, WorldSound

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
