"""A microphone at rest: a mode is heard in phase with itself, or opposed, whichever place was struck.

A mode answers every strike with one waveform times a real gain, so that its shares of the strikes are real
but for one complex factor. A microphone, or an object, that moves between strikes turns them.
Two modes at one peak, each heard with a phase of its own, are out of phase though nothing moved, so that only
those peaks count at which the model has a single mode: few of a solid of revolution, whose modes are paired.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.strikes.peaks import Peak

_LEAST = 1.0e-7
"""Of a share: strikes that are in phase to the last digit have a logarithm too."""

_FEWEST = 3

_NEXT = 0.01
"""Logarithm between frequencies, below which a model does not know how far a mode is from a peak."""


@dataclass(frozen=True)
class PhaseNoise:
    """How far strikes may be out of phase at a resonance.

    Attributes:
        out_of_phase: share of a mode's energy that is out of phase, in the median.
        spread: one sigma of its logarithm.
        skirts: of the skirts that the modes around leave at a peak, what is left of them once a level part is
            taken off.
        alone: least logarithm between a mode's frequency and the next one's, of a mode that is alone.
        broad: half width of a peak over its frequency, from which on it may be more than one mode whatever
            the model says.
        near: most logarithm between a peak's frequency and that of its mode.
    """

    out_of_phase: float = 0.8e-4
    spread: float = 2.6
    skirts: float = 0.5
    alone: float = 0.04
    broad: float = 0.004
    near: float = 0.04


def phase_score(peak: Peak, modes: FloatArray, noise: PhaseNoise) -> float | None:
    """How far strikes are out of phase at a peak, in sigmas above the median; None where it has no phase.

    Args:
        peak: a resonance that the strikes have in common.
        modes: ``(m,)`` Hz of the model, with the factor that the object's frequencies have over it.
        noise: of the phases.
    """
    if np.count_nonzero(peak.heard) < _FEWEST or not is_single(peak, modes, noise):
        return None
    y = peak.y[peak.heard]
    parts = np.array([y.real, y.imag])
    least, most = np.linalg.eigvalsh(parts @ parts.T)
    share = max(float(least / (least + most)), _LEAST)
    around = np.sort(skirts_at(peak, modes))[:-1]
    # Of what has a phase of its own, half of the energy is out of phase.
    noisy = 0.5 * float(np.sum(peak.sigma[peak.heard] ** 2) / (least + most) + noise.skirts**2 * around.sum())
    return float(np.log(share / (noise.out_of_phase + noisy)) / noise.spread)


def skirts_at(peak: Peak, modes: FloatArray) -> FloatArray:
    """``(m,)``: the energy of each mode's skirt at a peak over its own, were it as broad and as loud.

    Args:
        peak: a resonance.
        modes: ``(m,)`` Hz.
    """
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
