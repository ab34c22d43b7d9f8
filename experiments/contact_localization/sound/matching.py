"""Which mode may sound at which peak: groups of modes, and scales between two lists of frequencies."""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from harness.basics.arrays import BoolArray, FloatArray, IntArray

_GRID = 1.0e-3
_FAR = 4.0
"""Sigmas of frequency at which a mode is no longer considered for a peak."""

_LEAST_DENSITY = 0.05
"""Of modes at a peak, in units of one mode right at it: with fewer about, clutter gains."""

_NEGLIGIBLE = -6.0
"""Nats behind the most probable scale at which one is left out."""


@dataclass(frozen=True)
class SoundNoise:
    """How far sound may differ from what the modes say.

    Attributes:
        spreads: of a strike's share at a peak, in units of the mode's rms gain over the surface; some
            modes are as they were computed and some hardly, and each peak is weighed under every one.
        frequency: relative, one sigma of a mode's frequency about the common scale.
        scale: relative, one sigma of the common scale.
        scale_limits: within which a common scale is looked for.
        scale_step: between the logarithms of the common scales that are weighed; as ``frequency`` or finer.
        scale_weight: factor on the nats by which two lists of frequencies prefer a scale.
        clutter: share of peaks that no mode explains.
        weight: factor on a peak's nats, beside images: the model's errors are shared between peaks.
        aside: metres, one sigma along each axis of the object, beside images: by so much places that sound
            tells are off together, as its modes, the hammer's mount and the object's attitude are.
        alone: ``weight`` by sound alone, where nothing names the errors that contacts share.
        group: modes whose frequencies differ by less than this share mix freely.
        pair: relative difference in frequency up to which the two modes of a round object's pair mix freely.
        most: modes in one group at most; at most ``sound_kernels.MOST_RANK``.
    """

    spreads: tuple[float, ...] = (0.1, 0.4)
    frequency: float = 0.02
    scale: float = 0.05
    scale_limits: tuple[float, float] = (0.85, 1.15)
    scale_step: float = 0.015
    scale_weight: float = 0.3
    clutter: float = 0.2
    weight: float = 0.5
    aside: float = 1.0e-3
    alone: float = 0.2
    group: float = 0.01
    pair: float = 0.05
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


@dataclass(frozen=True, eq=False)
class Pairs:
    """Which group of modes may sound at which peak, pairs of a peak side by side.

    Attributes:
        starts: ``(P + 1,)`` first pair of each peak.
        groups: ``(Q,)`` group of each pair.
        shares: ``(S, Q)`` prior share of a pair in its peak, under each scale.
        clutter: ``(S, P)`` share left for anything else.
    """

    starts: IntArray
    groups: IntArray
    shares: FloatArray
    clutter: FloatArray

    def under(self, scale: int) -> "Pairs":
        """The same, were one scale the only one."""
        one = slice(scale, scale + 1)
        return Pairs(self.starts, self.groups, self.shares[one], self.clutter[one])


def group_starts(frequencies: FloatArray, pairs: BoolArray, noise: SoundNoise) -> IntArray:
    """Return ``(G + 1,)`` the first mode of every group of near-equal frequencies.

    Within a group the eigenvectors are any rotation of each other, and a small asymmetry of the real
    object picks another one; a group is therefore taken whole.

    Args:
        frequencies: ``(m,)`` frequencies in Hz, ascending.
        pairs: ``(m - 1,)`` whether a mode and the next one are a pair of a round object, which its
            asymmetries may split further.
        noise: widths of the groups.
    """
    starts = [0]
    for mode in range(1, len(frequencies)):
        width = noise.pair if pairs[mode - 1] else noise.group
        close = frequencies[mode] < (1.0 + width) * frequencies[mode - 1]
        if not close or mode - starts[-1] >= noise.most:
            starts.append(mode)
    return np.array([*starts, len(frequencies)] if len(frequencies) else [0], dtype=np.int64)


def likely_scales(peaks: FloatArray, modes: FloatArray, noise: SoundNoise) -> Scales:
    """Common factors under which the peaks fall on modes.

    Each peak is a normal mixture over the modes in log frequency, or clutter anywhere between them; the
    factor is normal about 1. Where modes are dense their frequencies hardly tell one factor from another,
    so that all that are likely are kept: the places struck must tell.

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
    return _even(grid, prior + noise.scale_weight * score, noise.scale_step)


def _even(grid: FloatArray, score: FloatArray, step: float) -> Scales:
    """Factors at even steps about the most probable, which comes first; what hardly weighs is left out."""
    nats = score - score.max()
    apart = max(1, round(step / (grid[1] - grid[0])))
    chosen = np.arange(int(np.argmax(nats)) % apart, len(grid), apart)
    chosen = chosen[nats[chosen] > _NEGLIGIBLE]
    chosen = chosen[np.argsort(-nats[chosen], kind="stable")]
    return Scales(np.exp(grid[chosen]), nats[chosen] - logsumexp(nats[chosen]))


def pairs_of(peaks: FloatArray, groups: FloatArray, factors: FloatArray, noise: SoundNoise) -> Pairs:
    """The groups near each peak, under each scale.

    Args:
        peaks: ``(P,)`` Hz.
        groups: ``(G,)`` Hz, of the groups of modes.
        factors: ``(S,)`` scales.
        noise: of the frequencies.
    """
    starts, found, shares = [0], [], []
    clutter = np.ones((len(factors), len(peaks)))
    for index, peak in enumerate(peaks):
        sigmas = (np.log(peak) - np.log(groups)[None] - np.log(factors)[:, None]) / noise.frequency
        density = np.where(np.abs(sigmas) < _FAR, np.exp(-0.5 * sigmas**2), 0.0)
        share = (1.0 - noise.clutter) * density / (density.sum(axis=1, keepdims=True) + _LEAST_DENSITY)
        near = np.nonzero(share.any(axis=0))[0]
        found.extend(near.tolist())
        shares.append(share[:, near])
        clutter[:, index] = 1.0 - share.sum(axis=1)
        starts.append(len(found))
    joined = np.concatenate(shares, axis=1) if shares else np.zeros((len(factors), 0))
    return Pairs(
        np.array(starts, dtype=np.int64),
        np.array(found, dtype=np.int64),
        np.ascontiguousarray(joined),
        clutter,
    )
