"""Sound: the resonances that strikes have in common, against the modes of a model.

All of an object's frequencies are off by one factor together, as its wall and its material are, and each
by a little of its own; of the peaks heard, a share is no mode's: two modes at once, the room, the support.
Where the model is right, how many of them no mode explains is binomial.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

from harness.agreement.agreement import Residual, SenseResiduals, SideBySide, Source
from harness.agreement.phases import PhaseNoise
from harness.agreement.readings import PressedContact
from harness.agreement.stated_error import gain_error
from harness.agreement.strike_shares import ShareNoise, StruckModes, microphone_residual
from harness.agreement.subject import Subject
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import TouchstoneError
from harness.basics.geometry import inverse
from harness.sim.modal.modal import from_arrays
from harness.sim.modal.modes import Modes
from harness.strikes.peaks import analyse

_GRID = 1.0e-3
_LEAST = 1.0e-300


@dataclass(frozen=True)
class ResonanceNoise:
    """How far resonances heard may be from a model's modes.

    Attributes:
        scale: one sigma of the logarithm of the factor that all frequencies share.
        frequency: one sigma of the logarithm of each frequency's own.
        reach: sigmas of ``frequency`` within which a mode explains a peak.
        clutter: share of peaks that no mode explains.
    """

    scale: float = 0.05
    frequency: float = 0.02
    reach: float = 2.0
    clutter: float = 0.2


@dataclass(frozen=True, eq=False)
class ResonanceMatch:
    """Peaks beside modes, under the likeliest common factor.

    Attributes:
        factor: of the object's frequencies over the model's.
        explained: ``(peaks,)`` whether a mode lies near each.
        chance: ``(peaks,)`` probability that a peak anywhere about it would have a mode that near.
    """

    factor: float
    explained: BoolArray
    chance: FloatArray


def compare_sound(
    subject: Subject,
    source: Source,
    contacts: Sequence[PressedContact],
    noise: ResonanceNoise | None = None,
    shares: ShareNoise | None = None,
    phases: PhaseNoise | None = None,
) -> SenseResiduals:
    """The resonances of a run against a model's modes, and how its strikes share them.

    Args:
        subject: the object.
        source: the ObjectFile's network, or finite elements.
        contacts: of the run.
        noise: of the resonances; None for the stated one.
        shares: of the strikes' levels; None for the stated one.
        phases: of the strikes; None for the stated one.
    """
    noise, shares, phases = noise or ResonanceNoise(), shares or ShareNoise(), phases or PhaseNoise()
    struck = [contact for contact in contacts if contact.seen.strike is not None]
    if not struck:
        return SenseResiduals("sound", source, (), "no contact was struck")
    evidence = analyse([contact.seen.strike for contact in struck if contact.seen.strike is not None])
    peaks = np.array([peak.frequency for peak in evidence.peaks])
    if not len(peaks):
        return SenseResiduals("sound", source, (), "no resonance stood out of the noise in two strikes")
    try:
        stored = subject.simulated("audio", source, ("object.modes",), {})["object.modes"]
        modes, error = from_arrays(stored), gain_error(subject, source)
    except TouchstoneError as refusal:
        return SenseResiduals("sound", source, (), str(refusal))
    resonances = resonance_residual(struck[-1].step, peaks, np.asarray(modes.frequencies), noise)
    places = struck_modes(subject, struck, modes, resonances.numbers["factor"], error)
    still = microphone_residual(struck[-1].step, evidence.peaks, places, shares, phases)
    return SenseResiduals("sound", source, (resonances,) if still is None else (resonances, still))


def struck_modes(
    subject: Subject, struck: Sequence[PressedContact], modes: Modes, factor: float, error: float
) -> StruckModes:
    """A model's modes where the strikes fell: at the places pressed, along the gel's axis.

    Args:
        subject: the object, where the scene states it.
        struck: contacts that were.
        modes: of the object.
        factor: of the object's frequencies over the model's.
        error: of a gain, that its source states.
    """
    poses = inverse(subject.base_from_object) @ np.array([one.seen.base_from_gel for one in struck])
    axes, depths = poses[:, :3, 2], np.array([max(0.0, float(one.heights.max())) for one in struck])
    # Unit to the last digit, whatever the controller's quaternions are.
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    points = poses[:, :3, 3] - depths[:, None] * axes
    normal = np.einsum("nmi,ni->nm", modes.shapes, modes.normals)
    gains, squares = modes.gains(points, axes), np.asarray(np.mean(normal**2, axis=0))
    return StruckModes(factor * modes.frequencies, gains, squares, error)


def resonance_residual(step: int, peaks: FloatArray, modes: FloatArray, noise: ResonanceNoise) -> Residual:
    """How improbable it is that modes explain no more of the peaks, as ``-2 ln p``.

    Args:
        step: the last one that was struck.
        peaks: ``(P,)`` Hz, at least one.
        modes: ``(m,)`` Hz, ascending.
        noise: of the resonances.
    """
    found = matched(peaks, modes, noise)
    unexplained = int(np.count_nonzero(~found.explained))
    probability = float(binom.sf(unexplained - 1, len(peaks), noise.clutter))
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
