"""A microphone at rest: strikes share each resonance as the model's gains at the struck places do.

At a peak, strike ``k`` is heard as ``y_k = sum_r a_r g_r(x_k)``: the real gains ``g_r`` of the modes there,
and one complex ``a_r`` for the way of each to the microphone, which is not known. So ``y`` lies in the span
of the gains. Modes of nearly one frequency, as a solid of revolution has them in pairs, are taken together:
an imperfect object has any basis of them, and all bases have one span. What is left of ``y`` outside of it is
what the model's gains are off by, or what the microphone's way changed by from one strike to the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import norm

from harness.agreement.agreement import Residual
from harness.agreement.phases import PhaseNoise, phase_score, skirts_at
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.strikes.peaks import Peak

_SPARE = 2
"""Strikes that a peak must have beyond the modes that are fitted to it."""

_WEAK = 0.1
"""Of a mode's rms gain: a mode that the strikes hardly moved is not found to be loud."""

_LEAST = 1.0e-9
"""Of a peak's energy: what lies in the span to the last digit has a logarithm too."""


@dataclass(frozen=True)
class ShareNoise:
    """How far strikes' shares may be from a model's gains.

    Attributes:
        gain: of a mode's gain at a place, of its root mean square over surface and struck places together:
            what the model is off by, in the median.
        spread: one sigma of its logarithm: some modes are as they were computed, and some hardly.
        shared: sigmas by which all modes of an object are off more, or less, together.
        skirts: of the skirts that the modes around leave at a peak, what is left of them once a level part is
            taken off.
        counted: sigmas that one peak counts at most: a peak may be no mode's.
        group: modes whose frequencies differ by less than this share are taken together.
        most: modes that are taken together at most.
        near: most logarithm between a peak's frequency and that of its modes.
    """

    gain: float = 0.1
    spread: float = 0.78
    shared: float = 0.2
    skirts: float = 0.3
    counted: float = 2.5
    group: float = 0.01
    most: int = 3
    near: float = 0.04


@dataclass(frozen=True, eq=False)
class StruckModes:
    """A model's modes where the strikes fell.

    Attributes:
        frequencies: ``(m,)`` Hz ascending, with the factor that the object's have over the model's.
        gains: ``(K, m)`` 1/sqrt(kg), of each mode at each strike's place along the blow.
        mean_squares: ``(m,)`` 1/kg, of its gain along the normal all over the surface.
        error: of a gain, of its root mean square over the surface: what the source states of itself.
    """

    frequencies: FloatArray
    gains: FloatArray
    mean_squares: FloatArray
    error: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.frequencies)
        if self.gains.ndim != 2 or self.gains.shape[1] != count or self.mean_squares.shape != (count,):
            raise WrongUse(
                f"gains of shape {self.gains.shape} and mean squares of shape {self.mean_squares.shape} were "
                f"given for {count} modes; (strikes, {count}) and ({count},) are wanted"
            )


def microphone_residual(
    step: int, peaks: Sequence[Peak], modes: StruckModes, shares: ShareNoise, phases: PhaseNoise
) -> Residual | None:
    """How improbable the strikes' shares are of a microphone at rest; None where no peak has any to compare.

    Each peak has a score of its phases and one of its gains, normal where the model is right, and so is their
    sum over its own sigma (Stouffer). Of that it is ``-2 ln p``, which is a chi-square of two degrees.

    Args:
        step: the last one that was struck.
        peaks: resonances that the strikes have in common.
        modes: of the model.
        shares: noise of the gains.
        phases: noise of the phases.

    Raises:
        WrongUse: gains of another number of strikes than the peaks have.
    """
    gains = [score for peak in peaks if (score := gain_score(peak, modes, shares)) is not None]
    turns = [score for peak in peaks if (score := phase_score(peak, modes.frequencies, phases)) is not None]
    if not gains and not turns:
        return None
    counted = np.clip([*gains, *turns], -shares.counted, shares.counted)
    sigmas = float(counted.sum() / np.sqrt(len(counted) + (shares.shared * len(gains)) ** 2))
    medians = {name: float(np.median(of)) for name, of in (("gains", gains), ("phases", turns)) if of}
    numbers = {
        "resonances": float(len(gains)),
        "single_modes": float(len(turns)),
        **{f"{name}_off_in_sigmas": value for name, value in medians.items()},
        "probability": float(norm.sf(sigmas)),
    }
    return Residual(step, "shares of the strikes", -2.0 * float(norm.logsf(sigmas)), 2.0, numbers)


def gain_score(peak: Peak, modes: StruckModes, noise: ShareNoise) -> float | None:
    """How far a peak's shares are from the gains of the group that is nearest, in sigmas above the median.

    Returns:
        None where no mode is near, or so many are that any shares would fit.

    Raises:
        WrongUse: gains of another number of strikes than the peak has.
    """
    if len(modes.gains) != len(peak.y):
        raise WrongUse(f"gains of {len(modes.gains)} strikes were given for a peak of {len(peak.y)}")
    logs = np.log(modes.frequencies)
    groups = [
        group
        for group in mode_groups(modes.frequencies, noise)
        if abs(float(logs[group].mean()) - np.log(peak.frequency)) < noise.near
    ]
    spare = int(np.count_nonzero(peak.heard)) - max((g.stop - g.start for g in groups), default=0)
    if not groups or spare < _SPARE:
        return None
    return min(_off(peak, modes, group, noise) for group in groups) / noise.spread


def mode_groups(frequencies: FloatArray, noise: ShareNoise) -> list[slice]:
    """Runs of ``(m,)`` ascending frequencies in Hz, each near to the next."""
    starts: list[int] = []
    for mode in range(len(frequencies)):
        near = mode > 0 and frequencies[mode] < (1.0 + noise.group) * frequencies[mode - 1]
        if not near or mode - starts[-1] >= noise.most:
            starts.append(mode)
    return [slice(a, b) for a, b in pairwise([*starts, len(frequencies)])]


def _off(peak: Peak, modes: StruckModes, group: slice, noise: ShareNoise) -> float:
    """Logarithm of what lies outside of a group's span, over what may in the median."""
    y, gains = peak.y[peak.heard], modes.gains[peak.heard, group]
    surface = float(np.mean(modes.mean_squares[group]))
    left, sizes, right = np.linalg.svd(gains, full_matrices=False)
    along = left.T @ y
    energy = float(np.linalg.norm(y) ** 2)
    outside = max(energy - float(np.linalg.norm(along) ** 2), _LEAST * energy) / (len(y) - gains.shape[1])
    ways = right.T @ (along * sizes / (sizes**2 + _WEAK**2 * surface))
    fitted = float(np.linalg.norm(gains @ ways) ** 2) / len(y)
    loud = surface * float(np.linalg.norm(ways) ** 2)
    allowed = noise.gain**2 * (loud + fitted) + modes.error**2 * loud
    around = skirts_at(peak, modes.frequencies) * modes.mean_squares
    skirts = noise.skirts**2 * float(np.linalg.norm(ways) ** 2 * (around.sum() - around[group].sum()))
    noisy = float(np.mean(peak.sigma[peak.heard] ** 2)) + _LEAST * energy
    return 0.5 * float(np.log(outside / (allowed + skirts + noisy)))
