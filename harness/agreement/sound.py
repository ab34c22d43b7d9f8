"""Sound: the resonances that strikes have in common, against the modes of a model.

All of an object's frequencies are off by one factor together, as its wall and its material are, and each
by a little of its own; of the peaks heard, a share is no mode's: two modes at once, the room, the support.
Where the model is right, how many of them no mode explains is binomial.

``microphone_residual``: to a microphone at rest, strikes share each resonance as the model's gains at the
struck places do. At a peak, strike ``k`` is heard as ``y_k = sum_r a_r g_r(x_k)``: the real gains ``g_r`` of
the modes there, and one complex ``a_r`` for the way of each to the microphone, which is not known. So ``y``
lies in the span of the gains. Modes of nearly one frequency, as a solid of revolution has them in pairs, are
taken together: an imperfect object has any basis of them, and all bases have one span. What is left of ``y``
outside of it is what the model's gains are off by, or what the microphone's way changed by from one strike to
the next.

``phase_score``: to a microphone at rest, a mode is in phase with itself, or opposed, whichever place was
struck. A mode answers every strike with one waveform times a real gain, so that its shares of the strikes are
real but for one complex factor. A microphone, or an object, that moves between strikes turns them. Two modes
at one peak, each heard with a phase of its own, are out of phase though nothing moved, so that only those
peaks count at which the model has a single mode: few of a solid of revolution, whose modes are paired.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import log_ndtr, ndtr

from harness.agreement.agreement import (
    Residual,
    SenseResiduals,
    SideBySide,
    Source,
    probability_of_at_least,
)
from harness.agreement.stated_error import gain_error
from harness.agreement.subject import PressedContact, Subject
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.geometry import inverse
from harness.sim.modal.modes import Modes
from harness.strikes.peaks import Peak, analyse

_GRID = 1.0e-3
_LEAST = 1.0e-300

_SPARE = 2
"""Strikes that a peak must have beyond the modes that are fitted to it."""

_WEAK = 0.1
"""Of a mode's rms gain: a mode that the strikes hardly moved is not found to be loud."""

_LEAST_SHARED = 1.0e-9
"""Of a peak's energy: what lies in the span to the last digit has a logarithm too."""

_LEAST_PHASES = 1.0e-7
"""Of a share: strikes that are in phase to the last digit have a logarithm too."""

_FEWEST = 3

_NEXT = 0.01
"""Logarithm between frequencies, below which a model does not know how far a mode is from a peak."""


@dataclass(frozen=True)
class ResonanceNoise:
    """How far resonances heard may be from a model's modes."""

    scale: float = 0.05  #: one sigma of the logarithm of the factor that all frequencies share.
    frequency: float = 0.02  #: one sigma of the logarithm of each frequency's own.
    reach: float = 2.0  #: sigmas of ``frequency`` within which a mode explains a peak.
    clutter: float = 0.2  #: share of peaks that no mode explains.


@dataclass(frozen=True, eq=False)
class ResonanceMatch:
    """Peaks beside modes, under the likeliest common factor."""

    factor: float  #: of the object's frequencies over the model's.
    explained: BoolArray  #: ``(peaks,)`` whether a mode lies near each.
    chance: FloatArray  #: ``(peaks,)`` probability that a peak anywhere about it would have a mode that near.


@dataclass(frozen=True)
class ShareNoise:
    """How far strikes' shares may be from a model's gains."""

    gain: float = 0.1
    """of a mode's gain at a place, of its root mean square over surface and struck places together: what the
    model is off by, in the median."""
    spread: float = 0.78
    """one sigma of its logarithm: some modes are as they were computed, and some hardly."""
    shared: float = 0.2  #: sigmas by which all modes of an object are off more, or less, together.
    skirts: float = 0.3
    """of the skirts that the modes around leave at a peak, what is left of them once a level part is taken
    off."""
    counted: float = 2.5  #: sigmas that one peak counts at most: a peak may be no mode's.
    group: float = 0.01  #: modes whose frequencies differ by less than this share are taken together.
    most: int = 3  #: modes that are taken together at most.
    near: float = 0.04  #: most logarithm between a peak's frequency and that of its modes.


@dataclass(frozen=True)
class PhaseNoise:
    """How far strikes may be out of phase at a resonance."""

    out_of_phase: float = 0.8e-4  #: share of a mode's energy that is out of phase, in the median.
    spread: float = 2.6  #: one sigma of its logarithm.
    skirts: float = 0.5
    """of the skirts that the modes around leave at a peak, what is left of them once a level part is taken
    off."""
    alone: float = 0.04
    """least logarithm between a mode's frequency and the next one's, of a mode that is alone."""
    broad: float = 0.004
    """half width of a peak over its frequency, from which on it may be more than one mode whatever the model
    says."""
    near: float = 0.04  #: most logarithm between a peak's frequency and that of its mode.


def compare_sound(subject: Subject, source: Source, contacts: Sequence[PressedContact]) -> SenseResiduals:
    """Compare the resonances of a run, and their amplitudes in each strike, with a model's modes."""
    struck = [contact for contact in contacts if contact.seen.strike is not None]
    if not struck:
        return SenseResiduals("sound", source, (), "no contact was struck")
    evidence = analyse([contact.seen.strike for contact in struck if contact.seen.strike is not None])
    peaks = np.array([peak.frequency for peak in evidence.peaks])
    if not len(peaks):
        return SenseResiduals("sound", source, (), "no resonance stood out of the noise in two strikes")
    try:
        modes = subject.simulated("audio", source, ("object.modes",), {}).sound.modes
        error = gain_error(subject, source)
    except TouchstoneError as refusal:
        return SenseResiduals("sound", source, (), str(refusal))
    assert modes is not None  # they were wanted
    resonances = resonance_residual(struck[-1].step, peaks, np.asarray(modes.frequencies), ResonanceNoise())
    places = struck_modes(subject, struck, modes, resonances.numbers["factor"], error)
    still = microphone_residual(struck[-1].step, evidence.peaks, places, ShareNoise(), PhaseNoise())
    return SenseResiduals("sound", source, (resonances,) if still is None else (resonances, still))


@dataclass(frozen=True, eq=False)
class StruckModes:
    """A model's modes where the strikes fell."""

    frequencies: FloatArray
    """``(m,)`` Hz ascending, with the factor that the object's have over the model's."""
    gains: FloatArray  #: ``(K, m)`` 1/sqrt(kg), of each mode at each strike's place along the blow.
    mean_squares: FloatArray  #: ``(m,)`` 1/kg, of its gain along the normal all over the surface.
    error: float = 0.0
    """of a gain, of its root mean square over the surface: what the source states of itself."""

    def __post_init__(self) -> None:
        count = len(self.frequencies)
        if self.gains.ndim != 2 or self.gains.shape[1] != count or self.mean_squares.shape != (count,):
            raise WrongUse(
                f"gains of shape {self.gains.shape} and mean squares of shape {self.mean_squares.shape} were "
                f"given for {count} modes; (strikes, {count}) and ({count},) are wanted"
            )


def struck_modes(
    subject: Subject, struck: Sequence[PressedContact], modes: Modes, factor: float, error: float
) -> StruckModes:
    """Evaluate a model's modes at the struck points, along the gel's axis; see ``StruckModes``."""
    poses = inverse(subject.base_from_object) @ np.array([one.seen.base_from_gel for one in struck])
    axes, depths = poses[:, :3, 2], np.array([max(0.0, float(one.heights.max())) for one in struck])
    # Unit to the last digit, whatever the controller's quaternions are.
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    points = poses[:, :3, 3] - depths[:, None] * axes
    normal = np.einsum("nmi,ni->nm", modes.shapes, modes.normals)
    gains, squares = modes.gains(points, axes), np.asarray(np.mean(normal**2, axis=0))
    return StruckModes(factor * modes.frequencies, gains, squares, error)


def resonance_residual(step: int, peaks: FloatArray, modes: FloatArray, noise: ResonanceNoise) -> Residual:
    """Test how many of ``(P,)`` peaks the ``(m,)`` ascending modes explain, both in Hz, as ``-2 ln p``."""
    found = matched(peaks, modes, noise)
    unexplained = int(np.count_nonzero(~found.explained))
    probability = probability_of_at_least(unexplained, len(peaks), noise.clutter)
    numbers = {
        "resonances": float(len(peaks)),
        "unexplained": float(unexplained),
        "factor": found.factor,
        "probability": probability,
        "by_chance": float(found.chance.mean()),
    }
    sides = SideBySide(peaks, found.factor * modes, "Hz")
    return Residual(step, "resonances", -2.0 * float(np.log(max(probability, _LEAST))), 2.0, numbers, sides)


def matched(peaks: FloatArray, modes: FloatArray, noise: ResonanceNoise) -> ResonanceMatch:
    """The common factor under which modes lie nearest to the peaks, between them and its prior."""
    limit = noise.reach * noise.frequency
    widest = 3.0 * noise.scale
    grid = np.linspace(-widest, widest, 2 * round(widest / _GRID) + 1)
    if not len(modes):
        none = np.zeros(len(peaks))
        return ResonanceMatch(1.0, none.astype(np.bool_), none)
    apart = np.abs(np.log(peaks)[:, None, None] - np.log(modes)[None, :, None] - grid).min(axis=1)
    near = np.minimum(apart / noise.frequency, noise.reach) ** 2
    best = int(np.argmin(near.sum(axis=0) + (grid / noise.scale) ** 2))
    return ResonanceMatch(float(np.exp(grid[best])), apart[:, best] <= limit, (apart <= limit).mean(axis=1))


def microphone_residual(
    step: int, peaks: Sequence[Peak], modes: StruckModes, shares: ShareNoise, phases: PhaseNoise
) -> Residual | None:
    """Test that the strikes' amplitudes fit a microphone at rest; None if no peak has comparable ones.

    Each peak has a score of its phases and one of its gains, normal where the model is right, and so is their
    sum over its own sigma (Stouffer). The residual is its ``-2 ln p``, a chi-square of two degrees.

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
        "probability": float(ndtr(-sigmas)),
    }
    return Residual(step, "shares of the strikes", -2.0 * float(log_ndtr(-sigmas)), 2.0, numbers)


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
    outside = max(energy - float(np.linalg.norm(along) ** 2), _LEAST_SHARED * energy) / (
        len(y) - gains.shape[1]
    )
    ways = right.T @ (along * sizes / (sizes**2 + _WEAK**2 * surface))
    fitted = float(np.linalg.norm(gains @ ways) ** 2) / len(y)
    loud = surface * float(np.linalg.norm(ways) ** 2)
    allowed = noise.gain**2 * (loud + fitted) + modes.error**2 * loud
    around = skirts_at(peak, modes.frequencies) * modes.mean_squares
    skirts = noise.skirts**2 * float(np.linalg.norm(ways) ** 2 * (around.sum() - around[group].sum()))
    noisy = float(np.mean(peak.sigma[peak.heard] ** 2)) + _LEAST_SHARED * energy
    return 0.5 * float(np.log(outside / (allowed + skirts + noisy)))


def phase_score(peak: Peak, modes: FloatArray, noise: PhaseNoise) -> float | None:
    """Compute the phase error of strikes at a peak, in sigmas above the median.

    Modes are ``(m,)`` Hz of the model times the common factor; None where the peak has no single mode.
    """
    if np.count_nonzero(peak.heard) < _FEWEST or not is_single(peak, modes, noise):
        return None
    y = peak.y[peak.heard]
    parts = np.array([y.real, y.imag])
    least, most = np.linalg.eigvalsh(parts @ parts.T)
    share = max(float(least / (least + most)), _LEAST_PHASES)
    around = np.sort(skirts_at(peak, modes))[:-1]
    # Of what has a phase of its own, half of the energy is out of phase.
    noisy = 0.5 * float(np.sum(peak.sigma[peak.heard] ** 2) / (least + most) + noise.skirts**2 * around.sum())
    return float(np.log(share / (noise.out_of_phase + noisy)) / noise.spread)


def skirts_at(peak: Peak, modes: FloatArray) -> FloatArray:
    """Compute the ``(m,)`` energies of the modes' tails at a peak, relative to an equal mode there."""
    apart = np.maximum(np.abs(np.log(modes / peak.frequency)), _NEXT)
    return np.asarray((half_width(peak) / apart) ** 2)


def half_width(peak: Peak) -> float:
    """Half of a resonance's width over its frequency; 0 where the scatter of its fit is below zero."""
    return max(peak.damping, 0.0) / (2.0 * np.pi * peak.frequency)


def is_single(peak: Peak, modes: FloatArray, noise: PhaseNoise) -> bool:
    """Whether exactly one of ``(m,)`` modes, in Hz, lies at a peak, and no other beside that."""
    if not len(modes):
        return False
    apart = np.abs(np.log(modes / peak.frequency))
    nearest = int(np.argmin(apart))
    others = np.abs(np.log(np.delete(modes, nearest) / modes[nearest]))
    return bool(
        half_width(peak) < noise.broad and apart[nearest] < noise.near and (others > noise.alone).all()
    )
