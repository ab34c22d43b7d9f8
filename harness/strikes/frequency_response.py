"""Transfer functions from repeated blows: H1, H2 and coherence (ISO 7626-5, 1994; Bendat and Piersol, 2010).

``H1`` divides the mean cross spectrum by the force's power: noise in the response averages out, noise in
the force makes it too small. ``H2`` is the other way round. Their ratio is the coherence, the share
of the response that the force explains; from one blow it would be one whatever was measured, so two
are the least for it. After the contact the force is what its cell makes of nothing, and is set to its rest.

``measure_blow`` measures one blow of an instrumented hammer. A converter's filter has left nothing above half
its rate, so that between samples the force is what band-limited interpolation makes of them; a blow of 0.2 ms
at 25 kHz is five samples wide, and its peak lies between two of them. Levels are shares of that peak. Each
quantity has the standard deviation that the noise of the quiet samples gives it; what the cell and its
amplifier add is not in it (ISO 7626-5, 1994).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.rest_level import RestLine, coarse_rest, fit_rest
from harness.bench.acquisition_channels import SECOND_HIT
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

_FINE = 32
"""Points in one sample's time."""

_SETTLED = 1.0e-3
"""s by which what lies around a contact is quiet: a converter's filter rings for some ten samples."""

_LOUD = 0.02
"""Of the peak, or eight deviations of the noise: from there on, something touches."""

_ROUNDS = 3
"""Iterations of finding the loud samples and the rest next to them."""

_LEAST_REST = 8
_ABOVE_NOISE = 8.0


@dataclass(frozen=True)
class Blow:
    """What one blow was. Sigmas are standard deviations by the noise at rest."""

    peak: float  #: N, the greatest force.
    peak_sigma: float  #: N.
    impulse: float  #: N s, of all touches.
    impulse_sigma: float  #: N s.
    duration: float  #: s for which the first touch was above the level asked for.
    duration_sigma: float  #: s.
    width: float  #: s above half the peak.
    start: float  #: s from the first sample, where the first touch crossed the level.
    touches: int  #: how often the force rose to 5 % of its peak, having fallen to half of that before.
    rest: float  #: N that was read with nothing touching, next to the blow, at ``start``.
    drift: float  #: N/s by which the rest changes there.
    noise: float  #: N, standard deviation at rest.
    clipped: bool
    """whether the force stayed at one value as only a full scale makes it: peak and impulse are then too
    small, and nobody knows by how much."""

    @property
    def double_hit(self) -> bool:
        """Whether the hammer touched more than once: its spectrum then has gaps."""
        return self.touches > 1


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Of one pair of places."""

    frequencies: FloatArray  #: ``(f,)`` Hz, evenly spaced from 0 on.
    h1: ComplexArray  #: ``(f,)`` response per force.
    h2: ComplexArray  #: ``(f,)``; zero where the response has nothing in common with the force.
    coherence: FloatArray | None  #: ``(f,)`` from 0 to 1; None of a single blow.
    sigma: FloatArray | None  #: ``(f,)`` standard deviation of ``h1``; None of a single blow.
    excited: BoolArray  #: ``(f,)`` whether every force is within ``FORCE_FLOOR`` of its greatest.
    decay: float  #: 1/s of the exponential window, which adds to every mode's damping.
    blows: tuple[Blow, ...]  #: in order.
    notes: tuple[str, ...] = ()
    """sentences about responses that do not fit their blows: late, of opposite sign, of another gain, or with
    lost samples."""

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
    times, contacts = np.arange(samples) / rate, np.zeros_like(driven)
    for contact, blow, samples_ in zip(contacts, blows, driven, strict=True):
        # The force about its contact, above its rest.
        touching = (times >= blow.start - _AROUND) & (times <= blow.start + blow.duration + _AROUND)
        contact[touching] = samples_[touching] - blow.rest
    force = rfft(contacts * window)
    response = rfft(heard * window)
    drive, answer = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    cross = np.sum(response * force.conj(), axis=0)
    h1 = _ratio(cross, drive)
    coherence = np.real(_ratio(np.abs(cross) ** 2, drive * answer)) if len(blows) > 1 else None
    scatter = None
    if coherence is not None:
        # Bendat and Piersol, Random Data, 4th edition, section 9.2, with one degree of freedom fewer.
        share = np.maximum(coherence, 1e-300)
        scatter = np.abs(h1) * np.sqrt(np.maximum(1.0 - share, 0.0) / (2.0 * share * (len(blows) - 1)))
    strength = np.abs(force)
    floor = strength.max(axis=1, keepdims=True) * 10.0 ** (-FORCE_FLOOR / 20.0)
    return FrequencyResponse(
        read_only(rfftfreq(samples, 1.0 / rate)),
        read_only(h1),
        read_only(_ratio(answer, cross.conj())),
        None if coherence is None else read_only(coherence),
        None if scatter is None else read_only(scatter),
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


def _ratio(above: AnyArray, below: AnyArray) -> ComplexArray:
    """Zero where there is nothing below."""
    there = below != 0.0
    return np.asarray(np.where(there, above / np.where(there, below, 1.0), 0.0), np.complex128)


def measure_blow(force: AnyArray, rate: float, level: float = 0.1) -> Blow:
    """A blow from its samples.

    Args:
        force: ``(t,)`` N, compression positive, with some time of rest before it or after it.
        rate: samples per second.
        level: share of the peak above which the hammer counts as touching; a Hertzian contact is above
            a tenth for 85 % of its duration.

    Raises:
        DataRefused: no blow above the noise, one that is cut off by an end of the record, no rest, or
            values that are not finite.
        WrongUse: a rate or a level that cannot be.
    """
    samples = np.asarray(force, np.float64)
    _check_blow(samples, rate, level)
    line, risen = _above_rest(samples, rate)
    noise, top = line.noise, int(np.argmax(risen))
    if not risen[top] > _ABOVE_NOISE * noise:
        down = float(risen.min())
        swapped = -down > max(4.0 * float(risen[top]), _ABOVE_NOISE * noise)
        raise DataRefused(
            f"no blow: the greatest force is {risen[top]:.3g} N above a rest with noise of {noise:.3g} N; "
            + (
                f"the force falls by {-down:.3g} N: its sign is swapped, compression must be positive"
                if swapped
                else "strike harder, or trigger on the right channel"
            )
        )
    second_hit = float(max(SECOND_HIT * risen.max(), _ABOVE_NOISE * noise))
    touching = np.flatnonzero(risen > second_hit)
    first, last = int(touching[0]), int(touching[-1])
    if first == 0 or last == len(risen) - 1:
        raise DataRefused(
            "the blow is cut off by an end of the record; record some milliseconds more about it"
        )
    around = round(_SETTLED * rate)
    begin, end = max(0, first - around), min(len(risen), last + around + 1)
    within = risen[begin:end]
    # ``_FINE`` points a sample; mirrored, so that the ends meet.
    mirrored = np.concatenate([within, within[::-1]])
    # Imported here, because it takes half a second and most commands do not need it.
    from scipy.signal import resample

    fine: FloatArray = resample(mirrored, len(mirrored) * _FINE)[: (len(within) - 1) * _FINE + 1]
    peak = float(fine.max())
    touch, touch_slopes = _above(fine, level * peak)
    half, _ = _above(fine, 0.5 * peak)
    span, start = end - begin, (begin + touch[0] / _FINE) / rate
    # A touch: the force rises to the level of a second hit, having fallen to half of it before.
    state = np.where(risen >= second_hit, 1, np.where(risen < 0.5 * second_hit, -1, 0))
    held = state[state != 0]
    return Blow(
        peak=peak,
        peak_sigma=float(np.hypot(noise, line.sigma)),
        impulse=float(within.sum()) / rate,
        impulse_sigma=float(np.hypot(noise * np.sqrt(span), line.sum_sigma(np.arange(begin, end) / rate)))
        / rate,
        duration=(touch[1] - touch[0]) / (_FINE * rate),
        duration_sigma=float(
            np.hypot(noise * np.hypot(*(1.0 / touch_slopes)), line.sigma * np.sum(1.0 / touch_slopes))
        )
        / (_FINE * rate),
        width=(half[1] - half[0]) / (_FINE * rate),
        start=start,
        touches=int(np.count_nonzero(np.diff(held) > 0) + (held[0] > 0)),
        rest=float(line.at(np.array(start))),
        drift=line.slope,
        noise=noise,
        clipped=is_clipped(samples, above_only=True),
    )


def _check_blow(samples: FloatArray, rate: float, level: float) -> None:
    if not (np.isfinite(rate) and rate > 0.0 and 0.0 < level < 0.5):
        raise WrongUse(
            f"a rate of {rate:g} Hz and a level of {level:g}; say a rate above 0, a level from 0 to 0.5"
        )
    if samples.ndim != 1 or len(samples) < 4 * _LEAST_REST:
        raise DataRefused(
            f"a force of shape {samples.shape}; a blow and its rest need {4 * _LEAST_REST} samples"
        )
    if not np.isfinite(samples).all():
        raise DataRefused("the force holds values that are not finite; calibrate the channel again")


def _above_rest(samples: FloatArray, rate: float) -> tuple[RestLine, FloatArray]:
    """Return the rest next to the blow, and ``(t,)`` N above the rest.

    Far from the blow the rest is the medians of blocks, so that a drift is no second touch.
    """
    rest = coarse_rest(samples, rate)
    around = round(_SETTLED * rate)
    line = None
    for _ in range(_ROUNDS):
        risen = samples - rest
        top = int(np.argmax(risen))
        spread = 1.4826 * float(np.median(np.abs(risen - np.median(risen))))
        loud = np.abs(risen) > max(_LOUD * risen[top], _ABOVE_NOISE * spread)
        begin = end = top
        if loud[top]:
            # The loud samples about the top that no quiet stretch separates from it.
            places = np.flatnonzero(loud)
            groups = np.split(places, np.flatnonzero(np.diff(places) > 2 * around) + 1)
            group = next(group for group in groups if group[0] <= top <= group[-1])
            begin, end = int(group[0]), int(group[-1])
        quiet = np.ones(len(samples), np.bool_)
        for place in np.flatnonzero(loud):
            quiet[max(0, place - around) : place + around + 1] = False
        quiet[begin : end + 1] = False
        if np.count_nonzero(quiet) >= _LEAST_REST:
            line = fit_rest(samples, quiet, rate, begin, end)
        if line is None:
            break
        near = slice(max(0, begin - around), end + around + 1)
        rest = coarse_rest(samples, rate)
        rest[near] = line.at(np.arange(len(samples))[near] / rate)
    if line is None:
        raise DataRefused(
            "the force is at rest nowhere near the blow; record some milliseconds more about the blow"
        )
    return line, samples - rest


def _above(fine: FloatArray, level: float) -> tuple[tuple[float, float], FloatArray]:
    """Where the touch of the peak crosses a level, in points, and the slopes there, per point."""
    top = int(np.argmax(fine))
    up = top - int(np.argmax(fine[top::-1] < level))
    down = top + int(np.argmax(fine[top:] < level))
    rise, fall = fine[up + 1] - fine[up], fine[down - 1] - fine[down]
    crossings = (up + (level - fine[up]) / rise, down - (level - fine[down]) / fall)
    return (float(crossings[0]), float(crossings[1])), np.array([rise, fall])
