"""How probable a list of peaks is at every size: a Poisson process over the logarithm of frequency."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from experiments.scale_estimation.sound.model import RingingModel
from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled
from harness.sim.modal.modes import dampings

NARROW, WIDE = 0.008, 0.035
"""Deviations of a mode's frequency from its model's, relative: most, and the others."""

NARROW_SHARE = 0.8

LEVEL_SIGMA = 13.0
"""dB, of a peak's level about the model's: the struck places, the microphone's way, the wall. Measured on
strikes of mocked objects whose size was known."""

FOUND = 0.9
"""Chance that a mode loud enough is found as a peak of its own."""

WIDTHS = 3.0
"""Half widths of a resonance within which two are heard as one peak."""

CLUTTER = 2.0
"""Peaks a band that are no mode's: echoes of the room, and what noise leaves of the weakest."""

CLUTTER_FALL = 5.0
"""dB over which these become rarer by e above the faintest peak. Measured on mocked strikes: they stand 3.5
above it on average, peaks of modes 16."""

_REACH = 4.0


@dataclass(frozen=True, eq=False)
class Peaks:
    """What was heard.

    Attributes:
        frequencies: ``(p,)`` Hz.
        levels: ``(p,)`` dB re 1 Pa/N.
        band: Hz, from and to, that the strikes excited.
        window_decay: 1/s that the analysis adds to every decay.
        decays: ``(p,)`` 1/s, the window's taken off.
    """

    frequencies: FloatArray
    levels: FloatArray
    band: tuple[float, float]
    window_decay: float
    decays: FloatArray


def log_likelihood(peaks: Peaks, model: RingingModel, log_sizes: FloatArray) -> FloatArray:
    """Of the peaks, at every size.

    Args:
        peaks: heard; one or more.
        model: of the object at its nominal size.
        log_sizes: ``(k,)`` evenly spaced: logarithms of the size over the nominal one.

    Returns:
        ``(k,)`` logarithm of the likelihood over that of chance peaks alone.
    """
    levels = model.levels(log_sizes, peaks.window_decay)
    threshold = float(peaks.levels.min()) - 0.5 * LEVEL_SIGMA
    low, high = np.log(peaks.band)
    logs = np.log(model.frequencies)
    heard = logs - log_sizes[:, None]
    loud = FOUND * ndtr((levels - threshold) / LEVEL_SIGMA) / _overlapping(model, heard, peaks.window_decay)
    in_band = ndtr((heard - low) / NARROW) - ndtr((heard - high) / NARROW)
    expected = (loud * in_band).sum(axis=1)
    above = (peaks.levels - peaks.levels.min()) / CLUTTER_FALL
    clutter = CLUTTER / (high - low) * np.exp(-above) / CLUTTER_FALL
    matches = _matched(
        np.log(peaks.frequencies), peaks.levels, logs, levels, loud, log_sizes, clutter,
    )  # fmt: skip
    return np.asarray(matches - expected)


def _overlapping(model: RingingModel, heard: FloatArray, window_decay: float) -> FloatArray:
    """``(k, m)``: how many modes share each mode's peak: those nearer than its own width, itself included."""
    frequencies = np.exp(heard)
    widths = WIDTHS * (dampings(frequencies, model.material) + window_decay) / (2.0 * np.pi)
    # Compared at the nominal size, where the modes are in order once and for all sizes.
    nominal = model.frequencies
    reach = widths * nominal / frequencies
    first = np.searchsorted(nominal, nominal - reach)
    last = np.searchsorted(nominal, nominal + reach)
    return np.asarray(last - first, dtype=np.float64)


@compiled
def _matched(
    heard: FloatArray,
    heard_levels: FloatArray,
    modes: FloatArray,
    levels: FloatArray,
    found: FloatArray,
    log_sizes: FloatArray,
    clutter: FloatArray,
) -> FloatArray:
    """``(k,)`` sum over peaks of the logarithm of their intensity over clutter's, at every size."""
    first, step, count = log_sizes[0], log_sizes[1] - log_sizes[0], len(log_sizes)
    total = np.zeros(count)
    intensity = np.empty(count)
    norm = 1.0 / np.sqrt(2.0 * np.pi)
    for peak in range(len(heard)):
        intensity[:] = 0.0
        for mode in range(len(modes)):
            middle = modes[mode] - heard[peak]  # the size at which this mode is heard there
            low = max(0, int(np.ceil((middle - _REACH * WIDE - first) / step)))
            high = min(count - 1, int(np.floor((middle + _REACH * WIDE - first) / step)))
            for k in range(low, high + 1):
                apart = log_sizes[k] - middle
                narrow = NARROW_SHARE / NARROW * np.exp(-0.5 * (apart / NARROW) ** 2)
                wide = (1.0 - NARROW_SHARE) / WIDE * np.exp(-0.5 * (apart / WIDE) ** 2)
                off = (heard_levels[peak] - levels[k, mode]) / LEVEL_SIGMA
                loudness = norm / LEVEL_SIGMA * np.exp(-0.5 * off * off)
                intensity[k] += found[k, mode] * norm * (narrow + wide) * loudness
        for k in range(count):
            total[k] += np.log1p(intensity[k] / clutter[peak])
    return total
