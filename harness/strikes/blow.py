"""One blow of an instrumented hammer: its greatest force, its impulse, how long it touched, and how often.

A converter's filter has left nothing above half its rate, so that between samples the force is what
band-limited interpolation makes of them; a blow of 0.2 ms at 25 kHz is five samples wide, and its peak lies
between two of them. Levels are shares of that peak. Each quantity has the standard deviation that the
noise of the quiet samples gives it; what the cell and its amplifier add is not in it (ISO 7626-5, 1994).
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import resample

from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.rest_level import RestLine, coarse_rest, fit_rest
from harness.bench.acquisition_channels import SECOND_HIT

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
    """What one blow was. Sigmas are standard deviations by the noise at rest.

    Attributes:
        peak: N, the greatest force.
        peak_sigma: N.
        impulse: N s, of all touches.
        impulse_sigma: N s.
        duration: s for which the first touch was above the level asked for.
        duration_sigma: s.
        width: s above half the peak.
        start: s from the first sample, where the first touch crossed the level.
        touches: how often the force rose to 5 % of its peak, having fallen to half of that before.
        rest: N that was read with nothing touching, next to the blow, at ``start``.
        drift: N/s by which the rest changes there.
        noise: N, standard deviation at rest.
        clipped: whether the force stayed at one value as only a full scale makes it: peak and impulse
            are then too small, and nobody knows by how much.
    """

    peak: float
    peak_sigma: float
    impulse: float
    impulse_sigma: float
    duration: float
    duration_sigma: float
    width: float
    start: float
    touches: int
    rest: float
    drift: float
    noise: float
    clipped: bool

    @property
    def double_hit(self) -> bool:
        """Whether the hammer touched more than once: its spectrum then has gaps."""
        return self.touches > 1


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
    _check(samples, rate, level)
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
    first, last = _reach(risen, noise)
    if first == 0 or last == len(risen) - 1:
        raise DataRefused(
            "the blow is cut off by an end of the record; record some milliseconds more about it"
        )
    around = round(_SETTLED * rate)
    begin, end = max(0, first - around), min(len(risen), last + around + 1)
    fine = _interpolated(risen, begin, end)
    peak = float(fine.max())
    touch, touch_slopes = _above(fine, level * peak)
    half, _ = _above(fine, 0.5 * peak)
    span, within = end - begin, risen[begin:end]
    start = (begin + touch[0] / _FINE) / rate
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
        touches=_touches(risen, noise),
        rest=float(line.at(np.array(start))),
        drift=line.slope,
        noise=noise,
        clipped=is_clipped(samples, above_only=True),
    )


def _check(samples: FloatArray, rate: float, level: float) -> None:
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
        loud = np.abs(risen) > max(_LOUD * risen[top], _ABOVE_NOISE * _spread(risen))
        begin, end = _event(loud, top, around)
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


def _event(loud: BoolArray, top: int, around: int) -> tuple[int, int]:
    """Return first and last loud sample about ``top`` that no quiet stretch parts from it."""
    places = np.flatnonzero(loud)
    if not loud[top]:
        return top, top
    groups = np.split(places, np.flatnonzero(np.diff(places) > 2 * around) + 1)
    group = next(group for group in groups if group[0] <= top <= group[-1])
    return int(group[0]), int(group[-1])


def _spread(risen: FloatArray) -> float:
    """Return the standard deviation of most samples."""
    return 1.4826 * float(np.median(np.abs(risen - np.median(risen))))


def _reach(risen: FloatArray, noise: float) -> tuple[int, int]:
    """First and last sample at the level of a second touch."""
    touching = np.flatnonzero(risen > _hit_level(risen, noise))
    return int(touching[0]), int(touching[-1])


def _hit_level(risen: FloatArray, noise: float) -> float:
    return float(max(SECOND_HIT * risen.max(), _ABOVE_NOISE * noise))


def _touches(risen: FloatArray, noise: float) -> int:
    """How often the force rises to the level, having fallen to half of it before."""
    level = _hit_level(risen, noise)
    state = np.where(risen >= level, 1, np.where(risen < 0.5 * level, -1, 0))
    held = state[state != 0]
    return int(np.count_nonzero(np.diff(held) > 0) + (held[0] > 0))


def _interpolated(risen: FloatArray, begin: int, end: int) -> FloatArray:
    """From ``begin`` on, ``_FINE`` points a sample; mirrored, so that the ends meet."""
    piece = risen[begin:end]
    both = np.concatenate([piece, piece[::-1]])
    fine: FloatArray = resample(both, len(both) * _FINE)
    return fine[: (len(piece) - 1) * _FINE + 1]


def _above(fine: FloatArray, level: float) -> tuple[tuple[float, float], FloatArray]:
    """Where the touch of the peak crosses a level, in points, and the slopes there, per point."""
    top = int(np.argmax(fine))
    up = top - int(np.argmax(fine[top::-1] < level))
    down = top + int(np.argmax(fine[top:] < level))
    rise, fall = fine[up + 1] - fine[up], fine[down - 1] - fine[down]
    crossings = (up + (level - fine[up]) / rise, down - (level - fine[down]) / fall)
    return (float(crossings[0]), float(crossings[1])), np.array([rise, fall])
