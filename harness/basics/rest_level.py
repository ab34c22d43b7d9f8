"""Estimate the rest level of a sensor next to an event, where the level drifts."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray

_BLOCK = 0.05
"""Seconds whose median is the level at its centre: longer than twice the longest contact of a hammer."""

_WINDOW = 0.05
"""Seconds of rest next to the event that a straight line is fitted to."""

_MIN_BEFORE = 64
"""Quiet samples before the event that a line through them alone needs. An amplifier that passes no steady
level undershoots after an event, so the rest before it is preferred."""

_MIN_LINE = 16

_DRIFT = 0.002
"""Fraction of the event's height by which the level changes over a record that drifts."""


@dataclass(frozen=True)
class RestLine:
    """A straight line through the rest next to an event."""

    level: float  #: rest at ``time``, in the unit of the signal.
    slope: float  #: drift per s.
    time: float  #: s from the first sample.
    noise: float  #: standard deviation of a sample about the line.
    covariance: FloatArray  #: ``(2, 2)`` of ``level`` and ``slope`` for samples of deviation one.

    def at(self, times: FloatArray) -> FloatArray:
        """Return the rest level at ``times``, in s from the first sample."""
        return np.asarray(self.level + self.slope * (times - self.time))

    @property
    def sigma(self) -> float:
        """Standard deviation of ``level``, for the stated noise."""
        return self.noise * float(np.sqrt(self.covariance[0, 0]))

    def sum_sigma(self, times: FloatArray) -> float:
        """Return the standard deviation of the line's sum over ``times``, for the stated noise."""
        weights = np.array([float(len(times)), float(np.sum(times - self.time))])
        return self.noise * float(np.sqrt(max(weights @ self.covariance @ weights, 0.0)))


def coarse_rest(samples: AnyArray, rate: float) -> FloatArray:
    """Return ``(t,)`` a slowly varying level: medians of blocks, joined by straight lines.

    Args:
        samples: ``(t,)`` values; an event must be shorter than half a block of 50 ms.
        rate: samples per second. A record shorter than two blocks has one level, its median.
    """
    values = np.asarray(samples, np.float64)
    blocks = int(len(values) / (_BLOCK * rate))
    if blocks < 2:
        return np.full(len(values), float(np.median(values)))
    parts = np.array_split(values, blocks)
    sizes = np.array([len(part) for part in parts], np.float64)
    centres = np.cumsum(sizes) - 0.5 * (sizes + 1.0)
    medians = np.array([float(np.median(part)) for part in parts])
    # Straight on beyond the outer centres, where interpolation would hold the level.
    ends = (
        medians[0] - (medians[1] - medians[0]) * centres[0] / (centres[1] - centres[0]),
        medians[-1]
        + (medians[-1] - medians[-2]) * (len(values) - 1 - centres[-1]) / (centres[-1] - centres[-2]),
    )
    knots = np.concatenate([[0.0], centres, [len(values) - 1.0]])
    levels = np.concatenate([[ends[0]], medians, [ends[1]]])
    return np.asarray(np.interp(np.arange(len(values), dtype=np.float64), knots, levels))


def fit_rest(samples: AnyArray, quiet: BoolArray, rate: float, first: int, last: int) -> RestLine | None:
    """Fit the rest next to an event: a line before it where the record drifts, else one level.

    Args:
        samples: ``(t,)`` values.
        quiet: ``(t,)`` whether nothing acts on the sensor.
        rate: samples per second.
        first: first sample of the event.
        last: last sample of the event.

    Returns:
        The line, at the event's first sample. Of a record whose level changes by less than 0.2 % of the
        event's height, the median of all quiet samples. Where fewer than 64 samples before the event are
        quiet, the line goes through those on both sides. None where no sample is quiet.
    """
    values = np.asarray(samples, np.float64)
    window = round(_WINDOW * rate)
    level = coarse_rest(values, rate)
    height = float(np.max(np.abs(values[first : last + 1] - level[first : last + 1])))
    numbers, sloped = np.flatnonzero(quiet), float(np.ptp(level)) > _DRIFT * height
    if sloped:
        before = numbers[(numbers < first) & (numbers >= first - window)]
        about = numbers[(numbers >= first - window) & (numbers <= last + window)]
        numbers = before if len(before) >= _MIN_BEFORE else about
        sloped = len(numbers) >= _MIN_LINE
    if len(numbers) == 0:
        return None
    time, terms = first / rate, 2 if sloped else 1
    design = np.column_stack([np.ones(len(numbers)), numbers / rate - time])[:, :terms]
    line, covariance = np.zeros(2), np.zeros((2, 2))
    line[:terms] = np.linalg.lstsq(design, values[numbers], rcond=None)[0]
    covariance[:terms, :terms] = np.linalg.inv(design.T @ design)
    if not sloped:
        # Tails of the event move the mean; the median's variance is pi / 2 times as large.
        line[0], covariance[0, 0] = np.median(values[numbers]), 0.5 * np.pi * covariance[0, 0]
    noise = 1.4826 * float(np.median(np.abs(values[numbers] - design @ line[:terms])))
    return RestLine(float(line[0]), float(line[1]), time, noise, covariance)
