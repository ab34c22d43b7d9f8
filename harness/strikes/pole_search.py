"""Where the lines that poles have not explained show that there are more."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks
from scipy.stats import f as f_distribution

from harness.basics.arrays import AnyArray, FloatArray
from harness.strikes.pole_fit import PoleFit, SpectralLines

_MEDIAN_COSTS = 1.0 / np.log(2.0) ** 2
"""Variance of the median of an exponential distribution over that of its mean, both scaled to the mean."""

APART = 8
"""Half widths from a stronger peak within which a peak waits for the next round."""


@dataclass(frozen=True)
class PoleSearch:
    """How modes are looked for.

    Attributes:
        low: Hz, of the band that is fitted.
        high: Hz; None for half the rate, or the last line.
        most: modes at most.
        false_alarm: chance that noise alone is taken for a mode, in all of the band.
        misfit: share of a line's power that may stay unexplained without there being another mode.
        floor_reach: lines to each side over whose median the noise is known.
        prominence: dB that a peak of the residual stands above what surrounds it.
        skirt: terms of the polynomial that stands for modes out of the band.
    """

    low: float = 0.0
    high: float | None = None
    most: int = 40
    false_alarm: float = 1e-3
    misfit: float = 0.02
    floor_reach: int = 100
    prominence: float = 6.0
    skirt: int = 3


def new_poles(
    lines: SpectralLines, fit: PoleFit, search: PoleSearch, rounding: float
) -> list[tuple[float, float]]:
    """Where the residual stands out, strongest first: ``w`` in rad/s and ``d`` in 1/s to start a fit from.

    Args:
        lines: that were fitted.
        fit: of the poles known so far.
        search: what counts as standing out.
        rounding: of the strongest line of a channel, below which everything is arithmetic.
    """
    power = np.abs(fit.residual) ** 2
    reach = min(2 * search.floor_reach + 1, power.shape[1])
    # The mean of an exponential distribution is its median over log 2.
    floor = median_filter(power, size=(1, reach), mode="reflect") / np.log(2.0)
    least = (rounding * np.abs(lines.values).max(axis=1, keepdims=True)) ** 2
    sizes = np.sum(power / np.maximum(floor, least), axis=0)
    channels, count = power.shape
    # The floor is itself an estimate: a median of n is worth a mean of n / 2.08.
    known = 2.0 * channels * reach / _MEDIAN_COSTS
    threshold = channels * float(f_distribution.isf(search.false_alarm / count, 2.0 * channels, known))
    level = 10.0 * np.log10(np.maximum(sizes, 1e-30))
    padded = np.concatenate([[-300.0], level, [-300.0]])
    tops = find_peaks(padded, height=10.0 * np.log10(threshold), prominence=search.prominence)[0] - 1
    everything = np.sum(np.abs(lines.values) ** 2, axis=0)
    left = np.sum(power, axis=0)
    tops = tops[left[tops] > search.misfit * everything[tops]]
    return _spread_out(lines, fit, left, tops[np.argsort(-left[tops])])


def _spread_out(
    lines: SpectralLines, fit: PoleFit, power: FloatArray, tops: AnyArray
) -> list[tuple[float, float]]:
    """Those peaks that no stronger one can have caused: its skirt, or the other side of a misfit mode."""
    chosen: list[tuple[float, float]] = []
    reach: list[tuple[float, float]] = []
    known, widths = fit.omegas / (2.0 * np.pi), fit.decays / (2.0 * np.pi)
    for top in tops:
        frequency, half = float(lines.frequencies[top]), _half_width(lines, power, int(top))
        beside = np.abs(known - frequency) < 2.0 * APART * widths
        broad = max(half, 2.0 * float(widths[beside].max(initial=0.0)))
        if all(abs(frequency - other) > APART * max(broad, breadth) for other, breadth in reach):
            reach.append((frequency, broad))
            # A hump at the lowest lines is a mode near critical damping, as fast as it is broad.
            chosen.append((2.0 * np.pi * max(frequency, half), 2.0 * np.pi * half))
    return chosen


def _half_width(lines: SpectralLines, power: FloatArray, top: int) -> float:
    """Hz from a peak to where it has half its power, on its steeper side."""
    below = power < 0.5 * power[top]
    up = np.flatnonzero(below[top:])
    down = np.flatnonzero(below[top::-1])
    reach = min([int(side[0]) for side in (up, down) if len(side)], default=1)
    return max(0.5, reach - 0.5) * lines.step
