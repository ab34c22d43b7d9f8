"""Transfer functions from repeated blows: H1, H2 and coherence (ISO 7626-5, 1994; Bendat and Piersol, 2010).

``H1`` divides the mean cross spectrum by the force's power: noise in the response averages out, noise in
the force makes it too small. ``H2`` is the other way round. Their ratio is the coherence, the share
of the response that the force explains; from one blow it would be one whatever was measured, so two
are the least for it. After the contact the force is what its cell makes of nothing, and is set to its rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.strikes.blow import Blow, measure_blow
from harness.strikes.pole_fit import ComplexArray

FORCE_FLOOR = 20.0
"""dB below its greatest spectral value, where a force no longer excites (ISO 7626-5)."""

_AROUND = 0.5e-3
"""s of force that count before and after the contact."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Of one pair of places.

    Attributes:
        frequencies: ``(f,)`` Hz, evenly spaced from 0 on.
        h1: ``(f,)`` response per force.
        h2: ``(f,)``; zero where the response has nothing in common with the force.
        coherence: ``(f,)`` from 0 to 1; None of a single blow.
        sigma: ``(f,)`` standard deviation of ``h1``; None of a single blow.
        excited: ``(f,)`` whether every force is within ``FORCE_FLOOR`` of its greatest.
        decay: 1/s of the exponential window, which adds to every mode's damping.
        blows: in order.
    """

    frequencies: FloatArray
    h1: ComplexArray
    h2: ComplexArray
    coherence: FloatArray | None
    sigma: FloatArray | None
    excited: BoolArray
    decay: float
    blows: tuple[Blow, ...]

    @property
    def band(self) -> tuple[float, float]:
        """Hz, from the first line on, up to where a force first excites no more."""
        stop = int(np.argmin(self.excited[1:])) + 1 if not self.excited[1:].all() else len(self.excited)
        return float(self.frequencies[1]), float(self.frequencies[stop - 1])


def frequency_response(
    forces: AnyArray, responses: AnyArray, rate: float, decay: float = 0.0
) -> FrequencyResponse:
    """The transfer function of one pair of places from blows at one and responses at the other.

    Args:
        forces: ``(n, t)`` N.
        responses: ``(n, t)`` of the same blows, sampled with them.
        rate: samples per second.
        decay: 1/s of an exponential window on both, for responses that outlast the record. It adds as much
            to every damping; ``modes_of_response`` takes it off again if it is told.

    Raises:
        DataRefused: shapes that differ, values that are not finite, a blow that ``measure_blow`` refuses, or
            one that hit twice, so that its spectrum has gaps, or that was clipped.
    """
    driven, heard = (np.atleast_2d(np.asarray(signal, np.float64)) for signal in (forces, responses))
    if driven.shape != heard.shape or not np.isfinite(heard).all():
        raise DataRefused(
            f"forces of shape {driven.shape} and responses of shape {heard.shape}; each blow needs both, "
            "of one length and finite"
        )
    blows = tuple(measure_blow(force, rate) for force in driven)
    _check(blows)
    samples = driven.shape[1]
    window = np.exp(-decay * np.arange(samples) / rate)
    force = rfft(np.array([_windowed(f, b, rate) for f, b in zip(driven, blows, strict=True)]) * window)
    response = rfft(heard * window)
    drive, answer = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    cross = np.sum(response * force.conj(), axis=0)
    h1 = _ratio(cross, drive)
    coherence = np.real(_ratio(np.abs(cross) ** 2, drive * answer)) if len(blows) > 1 else None
    strength = np.abs(force)
    floor = strength.max(axis=1, keepdims=True) * 10.0 ** (-FORCE_FLOOR / 20.0)
    return FrequencyResponse(
        read_only(rfftfreq(samples, 1.0 / rate)),
        read_only(h1),
        read_only(_ratio(answer, cross.conj())),
        None if coherence is None else read_only(coherence),
        None if coherence is None else read_only(_scatter(h1, coherence, len(blows))),
        read_only((strength >= floor).all(axis=0)),
        decay,
        blows,
    )


def _check(blows: Sequence[Blow]) -> None:
    for number, blow in enumerate(blows, start=1):
        if blow.double_hit:
            raise DataRefused(f"blow {number} hit twice; leave it out and strike again")
        if blow.clipped:
            raise DataRefused(
                f"blow {number} was clipped; leave it out, and strike softer or set a wider range"
            )


def _windowed(force: FloatArray, blow: Blow, rate: float) -> FloatArray:
    """The force about its contact, above its rest."""
    times = np.arange(len(force)) / rate
    touching = (times >= blow.start - _AROUND) & (times <= blow.start + blow.duration + _AROUND)
    return np.where(touching, force - blow.rest, 0.0)


def _ratio(above: AnyArray, below: AnyArray) -> ComplexArray:
    """Zero where there is nothing below."""
    there = below != 0.0
    return np.asarray(np.where(there, above / np.where(there, below, 1.0), 0.0), np.complex128)


def _scatter(h1: ComplexArray, coherence: FloatArray, count: int) -> FloatArray:
    """Bendat and Piersol, Random Data, 4th edition, section 9.2, with ``count - 1`` degrees of freedom."""
    share = np.maximum(coherence, 1e-300)
    return np.asarray(np.abs(h1) * np.sqrt(np.maximum(1.0 - share, 0.0) / (2.0 * share * (count - 1))))
