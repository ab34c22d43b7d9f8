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
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused
from harness.strikes.blow import Blow, measure_blow
from harness.strikes.pole_fit import ComplexArray

FORCE_FLOOR = 20.0
"""dB below its greatest spectral value, where a force no longer excites (ISO 7626-5)."""

_AROUND = 0.5e-3
"""s of force that count before and after the contact."""

_MISFIT = 0.02
"""Fraction of a response's power that the other blows may leave unexplained."""

_MIN_MISFIT, _OUTLIER = 2e-3, 5.0
"""Residual of one of three or more blows, and its ratio to the median, from which it is reported."""

_ALIGNED = 0.5
"""Largest fraction of that residual that a delay, a sign or a gain leaves if it is the cause."""

_DELAY = 0.3
"""Samples: a shorter delay is not reported."""

_DELAY_STEPS = 8
"""Steps per sample, twice, in which a delay is searched."""

_GAIN = 1.1
"""Ratio of two responses from which a gain is reported."""

_EARLY = 3.0
"""Samples by which a response may start before its blow: a converter's filter rings."""

_LATE = 1e-3
"""Seconds after the blow from which a response that starts late is reported."""

_QUIET_SAMPLES = 64
"""Samples before a blow from which the response's noise is known."""

_STARTED = 0.02
"""Fraction of the greatest response, and at least ten deviations of the noise, at which a response starts."""


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
        notes: sentences about responses that do not fit their blows: late, of opposite sign, of another gain,
            or with lost samples.
    """

    frequencies: FloatArray
    h1: ComplexArray
    h2: ComplexArray
    coherence: FloatArray | None
    sigma: FloatArray | None
    excited: BoolArray
    decay: float
    blows: tuple[Blow, ...]
    notes: tuple[str, ...] = ()

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
            one that hit twice, so that its spectrum has gaps, or a force or response that was clipped.
    """
    driven, heard = (np.atleast_2d(np.asarray(signal, np.float64)) for signal in (forces, responses))
    if driven.shape != heard.shape or not np.isfinite(heard).all():
        raise DataRefused(
            f"forces of shape {driven.shape} and responses of shape {heard.shape}; each blow needs both, "
            "of one length and finite"
        )
    blows = tuple(measure_blow(force, rate) for force in driven)
    _check(blows, heard)
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
        _find_faults(blows, heard, force, response, (strength >= floor).all(axis=0), rate),
    )


def _check(blows: Sequence[Blow], responses: FloatArray) -> None:
    for number, (blow, response) in enumerate(zip(blows, responses, strict=True), start=1):
        if blow.double_hit:
            raise DataRefused(f"blow {number} hit twice; leave it out and strike again")
        if blow.clipped:
            raise DataRefused(
                f"blow {number} was clipped; leave it out, and strike softer or set a wider range"
            )
        if is_clipped(response):
            raise DataRefused(
                f"the response to blow {number} was clipped at {np.abs(response).max():.3g}; leave it out, "
                "and strike softer or set a wider range"
            )


def _find_faults(
    blows: Sequence[Blow],
    responses: FloatArray,
    force: ComplexArray,
    response: ComplexArray,
    excited: BoolArray,
    rate: float,
) -> tuple[str, ...]:
    """Return sentences about responses that start at the wrong time or that the other blows do not explain.

    Args:
        blows: in order.
        responses: ``(n, t)`` as sampled.
        force: ``(n, f)`` spectra.
        response: ``(n, f)`` spectra.
        excited: ``(f,)`` whether every blow excites a line.
        rate: samples per second.
    """
    notes = [
        note
        for number, (blow, samples) in enumerate(zip(blows, responses, strict=True), start=1)
        if (note := _find_delay(number, blow, samples, rate))
    ]
    used = np.flatnonzero(excited)[1:]
    turns = 2.0 * np.pi * used / responses.shape[1]  # rad per sample of delay
    if len(blows) < 2:
        return tuple(notes)
    transfers = _ratio(response[:, used], force[:, used])
    middle = np.median(transfers.real, axis=0) + 1j * np.median(transfers.imag, axis=0)
    # Of two blows neither is the odd one: the second is compared with the first.
    reference, numbers = (transfers[0], [1]) if len(blows) == 2 else (middle, list(range(len(blows))))
    expected = reference * force[:, used]
    powers = np.sum(np.abs(response[:, used]) ** 2, axis=1)
    misfits = np.sum(np.abs(response[:, used] - expected) ** 2, axis=1) / np.maximum(powers, 1e-300)
    limit = _MISFIT
    if len(blows) > 2:
        limit = min(limit, max(_MIN_MISFIT, _OUTLIER * float(np.median(misfits))))
    for number in numbers:
        if misfits[number] > limit:
            cause = _find_cause(response[number, used], expected[number], turns, rate, responses.shape[1])
            other = "blow 1" if len(blows) == 2 else "the median of the blows"
            misfit = f"{100.0 * misfits[number]:.3g} % of its power differs"
            notes.append(
                f"the response to blow {number + 1} {cause}, compared with {other} for the same force "
                f"({misfit}): check its channel, and leave it out"
                if cause
                else f"the response to blow {number + 1} does not follow from its force as in {other} "
                f"({misfit}): samples of a channel were lost, or the object or the place of the blow "
                "changed; leave it out"
            )
    return tuple(notes)


def _find_delay(number: int, blow: Blow, samples: FloatArray, rate: float) -> str:
    """Return a sentence about a response that starts before its blow or long after it; empty otherwise."""
    begin = int(blow.start * rate - _EARLY)
    before = samples[: max(0, begin - round(_LATE * rate))]
    if len(before) < _QUIET_SAMPLES:
        return ""
    risen = np.abs(samples - np.median(before[: len(before) // 2]))
    # The first half, which a response that starts early has not reached.
    level = max(_STARTED * float(risen.max()), 10.0 * float(np.std(before[: len(before) // 2])))
    start = int(np.argmax(risen > level))
    late = start / rate - blow.start
    if risen[start] <= level or begin <= start <= (blow.start + _LATE) * rate:
        return ""
    if late < 0.0:
        return (
            f"the response to blow {number} starts {-1e3 * late:.2f} ms before the blow: the two channels "
            "do not share one clock, or the object was moving"
        )
    return (
        f"the response to blow {number} starts {1e3 * late:.2f} ms after the blow: a late channel, or sound "
        f"from {343.0 * late:.2g} m away"
    )


def _find_cause(
    measured: ComplexArray, expected: ComplexArray, turns: FloatArray, rate: float, samples: int
) -> str:
    """Return the delay, sign or gain that explains a misfit, as a predicate; empty where none does.

    Args:
        measured: ``(f,)`` lines of a response.
        expected: ``(f,)`` lines that other blows predict.
        turns: ``(f,)`` rad by which a delay of one sample turns each line.
        rate: samples per second.
        samples: number of samples in the record.
    """
    across = measured * expected.conj()
    spectrum = np.zeros(_DELAY_STEPS * (samples // 2 + 1), np.complex128)
    spectrum[np.rint(turns * samples / (2.0 * np.pi)).astype(np.intp)] = across
    correlation = np.fft.ifft(spectrum) * len(spectrum)
    best = int(np.argmax(np.abs(correlation.real)))
    delay = samples / len(spectrum) * (best - len(spectrum) * (best > len(spectrum) // 2))
    gain = float(correlation[best].real / np.sum(np.abs(expected) ** 2))
    aligned = gain * np.exp(-1j * turns * delay) * expected
    if np.sum(np.abs(measured - aligned) ** 2) > _ALIGNED * np.sum(np.abs(measured - expected) ** 2):
        return ""
    causes = []
    if abs(delay) > _DELAY:
        causes.append(f"comes {1e6 * abs(delay) / rate:.0f} us {'later' if delay > 0.0 else 'earlier'}")
    if gain < 0.0:
        causes.append("has the opposite sign")
    if not 1.0 / _GAIN < abs(gain) < _GAIN:
        causes.append(f"is {abs(gain):.2g} times as large")
    return " and ".join(causes)


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
