"""Which mode may sound at which peak: groups of modes, and scales between two lists of frequencies."""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from harness.arrays import FloatArray, IntArray

_GRID = 1.0e-3
_APART = 8.0e-3
"""Two scales whose logarithms are closer are one."""


@dataclass(frozen=True)
class SoundNoise:
    """How far sound may differ from what the modes say.

    Attributes:
        spreads: of a strike's share at a peak, in units of the mode's rms gain over the surface; some
            modes are as they were computed and some hardly, and each peak is weighed under every one.
        frequency: relative, one sigma of a mode's frequency about the common scale.
        scale: relative, one sigma of the common scale.
        scale_limits: within which a common scale is looked for.
        scales: at most so many are kept.
        scale_weight: factor on the nats by which two lists of frequencies prefer a scale.
        clutter: share of peaks that no mode explains.
        weight: factor on a peak's nats: the model's errors are shared between peaks.
        group: modes whose frequencies differ by less than this share mix freely.
        most: modes in one group at most; at most ``sound_kernels.MOST_RANK``.
    """

    spreads: tuple[float, ...] = (0.1, 0.4)
    frequency: float = 0.02
    scale: float = 0.05
    scale_limits: tuple[float, float] = (0.85, 1.15)
    scales: int = 4
    scale_weight: float = 0.3
    clutter: float = 0.2
    weight: float = 0.2
    group: float = 0.01
    most: int = 3


@dataclass(frozen=True, eq=False)
class Scales:
    """Common factors between a real object's frequencies and its model's.

    Attributes:
        factors: ``(S,)`` real frequency over the model's, most probable first.
        log_shares: ``(S,)`` nats, of shares that sum to 1.
    """

    factors: FloatArray
    log_shares: FloatArray


def group_starts(frequencies: FloatArray, noise: SoundNoise) -> IntArray:
    """``(G + 1,)`` first mode of every group of near-equal frequencies.

    Within a group the eigenvectors are any rotation of each other, and a small asymmetry of the real
    object picks another one; a group is therefore taken whole.

    Args:
        frequencies: ``(m,)`` Hz, ascending.
        noise: gives the group's width.
    """
    starts = [0]
    for mode in range(1, len(frequencies)):
        close = frequencies[mode] < (1.0 + noise.group) * frequencies[mode - 1]
        if not close or mode - starts[-1] >= noise.most:
            starts.append(mode)
    return np.array([*starts, len(frequencies)] if len(frequencies) else [0], dtype=np.int64)


def likely_scales(peaks: FloatArray, modes: FloatArray, noise: SoundNoise) -> Scales:
    """Common factors under which the peaks fall on modes.

    Each peak is a normal mixture over the modes in log frequency, or clutter anywhere between them; the
    factor is normal about 1. Several hills are kept: the highest is now and then not the true one.

    Args:
        peaks: ``(P,)`` Hz.
        modes: ``(m,)`` Hz.
        noise: of the frequencies.
    """
    low, high = np.log(noise.scale_limits)
    grid = np.linspace(low, high, int(np.ceil((high - low) / _GRID)) + 1)
    score = np.zeros(len(grid))
    if len(peaks) and len(modes):
        gaps = np.log(peaks)[None, :, None] - np.log(modes)[None, None, :] - grid[:, None, None]
        near = np.exp(-0.5 * (gaps / noise.frequency) ** 2).sum(axis=2)
        density = near / (len(modes) * noise.frequency * np.sqrt(2.0 * np.pi))
        reach = float(np.log(modes.max() / modes.min())) + high - low
        score += np.log((1.0 - noise.clutter) * density + noise.clutter / reach).sum(axis=1)
    prior = -0.5 * (grid / noise.scale) ** 2
    return _hills(grid, prior + noise.scale_weight * score, noise.scales)


def _hills(grid: FloatArray, score: FloatArray, most: int) -> Scales:
    edged = np.concatenate([[-np.inf], score, [-np.inf]])
    tops = np.nonzero((score >= edged[:-2]) & (score > edged[2:]))[0]
    factors: list[float] = []
    logs: list[float] = []
    for top in tops[np.argsort(-score[tops], kind="stable")]:
        if len(factors) < most and all(abs(grid[top] - np.log(other)) >= _APART for other in factors):
            factors.append(float(np.exp(grid[top])))
            logs.append(float(score[top]))
    log_shares = np.array(logs)
    return Scales(np.array(factors), log_shares - logsumexp(log_shares))
