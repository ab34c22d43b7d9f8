"""When a sound card's samples were taken: sample numbers against the bench clock.

A sound card counts its own seconds, 10 to 100 ppm away from the computer's, and says of each
block only when the block was handed over. Hand-over comes late now and then, never early by
more than the card's own jitter, so late blocks are given little weight.

This is another fit than that of `harness.bench.clock_fit`, because it is given something else. There,
arrivals are late by chance and never early, over a whole run, and a line under all of them is
sought; no rate is assumed. Here, PortAudio takes the age of a block off its arrival, so that
errors go both ways, and the line must hold a few tenths of a second after a gap, when the rate
is better known from the crystal than from the blocks.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray

CRYSTAL_DRIFT = 100e-6
"""Standard deviation of an audio crystal's rate about its nominal one, before anything is measured."""

_SHARPNESS = 20e-6
"""s: lateness that no fit resolves; the bench clock and the callback's own jitter."""

_ROUNDS = 30
_MAD_TO_DEVIATION = 1.4826


@dataclass(frozen=True)
class SampleClock:
    """A straight line from sample number to bench clock.

    Attributes:
        index: the sample number at which the line is anchored.
        time: s on the bench clock, of that sample.
        rate: samples per bench-clock second.
        residual: s, median distance of the blocks' measured times from the line.
        uncertainty: s, standard deviation of the line at its anchor, as if blocks erred independently.
    """

    index: float
    time: float
    rate: float
    residual: float
    uncertainty: float

    def times(self, indices: FloatArray) -> FloatArray:
        """Bench-clock seconds of samples, ``(n,)``."""
        return self.time + (indices - self.index) / self.rate


def fit_clock(indices: FloatArray, times: FloatArray, nominal_rate: float) -> SampleClock:
    """The line through blocks' measured times, late blocks given little weight.

    A least-squares line reweighted by ``min(1, s / late)``, ``s`` the median absolute residual
    (Huber's weights, on the late side only). The rate is held to its nominal value with the
    standard deviation `CRYSTAL_DRIFT`, so that a second of blocks cannot invent a drift.

    Args:
        indices: ``(n,)`` number of each block's first sample, ascending.
        times: ``(n,)`` s on the bench clock, when that sample was taken as far as is known.
        nominal_rate: samples a second.

    Raises:
        ValueError: there is no block.
    """
    if len(indices) == 0:
        raise ValueError("a clock cannot be fitted to no block")
    anchor = float(indices[-1])
    elapsed = (indices - anchor) / nominal_rate
    excess = times - times[-1] - elapsed  # what the nominal rate leaves unexplained
    weights = np.ones_like(excess)
    scale = _SHARPNESS
    offset = stretch = 0.0
    for _ in range(_ROUNDS):
        offset, stretch = _line(elapsed, excess, weights, scale)
        residuals = excess - offset - stretch * elapsed
        scale = max(_SHARPNESS, _MAD_TO_DEVIATION * float(np.median(np.abs(residuals))))
        weights = np.where(residuals > scale, scale / np.maximum(residuals, scale), 1.0)
    residual = float(np.median(np.abs(excess - offset - stretch * elapsed)))
    uncertainty = _uncertainty(elapsed, weights, scale)
    return SampleClock(
        anchor, float(times[-1]) + offset, nominal_rate / (1.0 + stretch), residual, uncertainty
    )


def _uncertainty(x: FloatArray, weights: FloatArray, noise: float) -> float:
    """Standard deviation in s, at ``x = 0``, of the line that `_line` draws through noise ``noise`` s."""
    total = weights.sum()
    mean = weights @ x / total
    spread = weights @ (x - mean) ** 2 + (noise / CRYSTAL_DRIFT) ** 2
    return float(noise * np.sqrt(1.0 / total + mean**2 / spread))


def _line(x: FloatArray, y: FloatArray, weights: FloatArray, noise: float) -> tuple[float, float]:
    """Offset and slope; the slope drawn to zero as `CRYSTAL_DRIFT` demands of noise ``noise`` s."""
    total = weights.sum()
    mean_x, mean_y = weights @ x / total, weights @ y / total
    spread = weights @ (x - mean_x) ** 2 + (noise / CRYSTAL_DRIFT) ** 2
    slope = float(weights @ ((x - mean_x) * (y - mean_y)) / spread)
    return float(mean_y - slope * mean_x), slope


def steps(indices: FloatArray, times: FloatArray, nominal_rate: float, settle: int) -> FloatArray:
    """How far the samples' numbers and the clock come apart, in s, place by place.

    Samples lost without a word make every later block late; samples made up make every later
    block early. One late block does neither. The earliest of the ``settle`` blocks before a
    place is compared with the earliest of the ``settle`` blocks from it on, by the nominal
    rate: a crystal's drift of 100 ppm adds 0.1 ms a second.

    Args:
        indices: ``(n,)`` number of each block's first sample, ascending.
        times: ``(n,)`` s on the bench clock, when that sample was taken as far as is known.
        nominal_rate: samples a second.
        settle: blocks on either side of a place, above zero.

    Returns:
        ``(n + 1 - 2 settle,)``, the k-th for the place before block ``k + settle``: positive
        where samples are missing, negative where there are too many. Empty for fewer blocks.
    """
    if len(indices) < 2 * settle:
        return np.zeros(0)
    lateness = times - times[0] - (indices - indices[0]) / nominal_rate
    earliest = np.lib.stride_tricks.sliding_window_view(lateness, settle).min(axis=1)
    return np.asarray(earliest[settle:] - earliest[:-settle], np.float64)
