"""One channel of a captured strike as recorded: whole counts on a steady clock, and where they rest."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, RecordingDamaged
from harness.bench.reading import Reading

_STEADY = 1e-4
_FAR = 6.0


@dataclass(frozen=True, eq=False)
class Record:
    """All blocks of one channel in a row, and the steady clock that their times give.

    Attributes:
        name: of the channel.
        counts: ``(t,)``, whole.
        start: s on the bench clock, of the first.
        rate: Hz on the bench clock.
    """

    name: str
    counts: FloatArray
    start: float
    rate: float

    @property
    def end(self) -> float:
        """Seconds on the bench clock, of the last sample."""
        return self.start + (len(self.counts) - 1) / self.rate

    @classmethod
    def of(cls, readings: Mapping[str, Reading], name: str) -> "Record":
        """The channel called ``name``.

        Raises:
            DataRefused: it is missing, or one block, whose samples have no rate.
            RecordingDamaged: block times that no steady clock gives.
        """
        reading = reading_of(readings, name)
        blocks, block = reading.values.shape
        if blocks < 2:
            raise DataRefused(f"{name} has {blocks} block; two are needed to know the rate of its samples")
        numbers = np.arange(blocks) * block
        origin = reading.times[0]
        period, late = np.polyfit(numbers, reading.times - origin, 1)
        astray = np.abs(reading.times - origin - late - period * numbers).max()
        if not period > 0.0 or astray > _STEADY:
            raise RecordingDamaged(
                f"{name}: block times leave a steady clock by {astray * 1e6:.0f} us; "
                f"at most {_STEADY * 1e6:.0f} us are possible"
            )
        counts = reading.values.ravel().astype(np.float64)
        return cls(name, counts, float(origin + late), 1.0 / float(period))


def reading_of(readings: Mapping[str, Reading], name: str) -> Reading:
    """The reading called ``name``; ``DataRefused`` where there is none."""
    if name not in readings:
        raise DataRefused(f"the step has no channel {name}; it recorded {', '.join(sorted(readings))}")
    return readings[name]


def check_counts(record: Record, full_scale: int) -> None:
    """``DataRefused`` where a count is beyond what a converter of this full scale can say."""
    low, high = record.counts.min(), record.counts.max()
    if low < -full_scale - 1 or high > full_scale:
        raise DataRefused(
            f"{record.name} holds counts from {low:.0f} to {high:.0f}; the calibrated box says "
            f"{-full_scale - 1} to {full_scale}: the calibration is of another box"
        )


def middle(counts: FloatArray) -> float:
    """The mean of what is not far out: neither a loud beginning nor a full scale moves it."""
    away = np.abs(counts - np.median(counts))
    return float(counts[away <= _FAR * max(1.0, float(np.median(away)))].mean())


def rest_of(name: str, rest: float, offset: float, tolerance: float) -> float:
    """Counts at rest as measured, checked against the calibrated offset."""
    if abs(rest - offset) > tolerance:
        raise DataRefused(
            f"{name} rests at {rest:.0f} counts; it was calibrated at {offset:.0f}, within "
            f"{tolerance:.0f}: check that the channels are not swapped, or calibrate again"
        )
    return rest
