"""A microphone at rest: at each resonance the strikes are heard in phase with each other, or opposed.

A mode answers every strike with one waveform times a real gain, wherever the object is struck, so that its
phase between two strikes is 0 or 180 degrees. A microphone, or an object, that moves between strikes turns
it.
Two modes at one peak, each heard with a phase of its own, are out of phase though nothing moved, so that only
those peaks count at which the model has a single mode: few of a solid of revolution, whose modes are paired.
Of these a small share is out of phase by chance, and how many there are is binomial.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

from harness.agreement.agreement import Residual
from harness.basics.arrays import FloatArray
from harness.strikes.peaks import Peak
from harness.strikes.spectra import ComplexArray

_LEAST = 1.0e-300


@dataclass(frozen=True)
class PhaseNoise:
    """How far strikes may be out of phase at a resonance.

    Attributes:
        within: rad, between two strikes of one mode.
        strong: share of the loudest strike's amplitude from which on a phase is read.
        alone: least logarithm between a mode's frequency and the next one's, of a mode that is alone.
        broad: half width of a peak over its frequency, from which on it may be more than one mode whatever
            the model says.
        near: most logarithm between a peak's frequency and that of its mode.
        clutter: share of such peaks that are more than one mode all the same, or read wrongly.
    """

    within: float = np.radians(20.0)
    strong: float = 0.25
    alone: float = 0.02
    broad: float = 0.004
    near: float = 0.04
    clutter: float = 0.05


def phase_residual(step: int, peaks: Sequence[Peak], modes: FloatArray, noise: PhaseNoise) -> Residual | None:
    """How improbable it is that so many peaks are out of phase, as ``-2 ln p``; None where none has a phase.

    Args:
        step: the last one that was struck.
        peaks: resonances that the strikes have in common.
        modes: ``(m,)`` Hz of the model, with the factor that the object's frequencies have over it.
        noise: of the phases.
    """
    shares = [peak.y[peak.heard] for peak in peaks if is_single(peak, modes, noise)]
    apart = np.array([angle for y in shares if (angle := phase_apart(y, noise.strong)) is not None])
    if not len(apart):
        return None
    beyond = int(np.count_nonzero(apart > noise.within))
    probability = float(binom.sf(beyond - 1, len(apart), noise.clutter))
    numbers = {
        "resonances": float(len(apart)),
        "out_of_phase": float(beyond),
        "median_rad": float(np.median(apart)),
        "probability": probability,
    }
    return Residual(step, "phases", -2.0 * float(np.log(max(probability, _LEAST))), 2.0, numbers)


def is_single(peak: Peak, modes: FloatArray, noise: PhaseNoise) -> bool:
    """Whether exactly one of ``(m,)`` modes, in Hz, lies at a peak, and no other beside that."""
    if not len(modes):
        return False
    apart = np.abs(np.log(modes / peak.frequency))
    nearest = int(np.argmin(apart))
    others = np.abs(np.log(np.delete(modes, nearest) / modes[nearest]))
    width = max(peak.damping, 0.0) / (2.0 * np.pi * peak.frequency)
    return bool(width < noise.broad and apart[nearest] < noise.near and (others > noise.alone).all())


def phase_apart(y: ComplexArray, strong: float) -> float | None:
    """Rad, 0 to pi / 2: how far any strong strike is from being in phase with the loudest, or opposed to it.

    Args:
        y: ``(K,)`` the strikes' complex shares.
        strong: share of the loudest amplitude from which on a strike counts.

    Returns:
        None where fewer than two count.
    """
    if len(y) < 2:
        return None
    loudest = y[int(np.argmax(np.abs(y)))]
    counting = y[np.abs(y) >= strong * np.abs(loudest)]
    if len(counting) < 2:
        return None
    # Squared, what is opposed is in phase.
    return float(np.abs(np.angle((counting * np.conj(loudest)) ** 2)).max() / 2.0)
