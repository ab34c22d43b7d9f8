"""The channels that a captured strike is recorded in, and what their counts say by themselves."""

from dataclasses import asdict, dataclass

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.clipping import is_clipped
from harness.basics.rest_level import coarse_rest
from harness.bench.device import Channel, Reading

FORCE = "hammer.force"
PRESSURE = "microphone.pressure"
CLOCK = "hammer.clock"
FLAGS = "hammer.flags"

FLAG_FIELDS = ("onset", "overload", "double_hit", "silent", "threshold")
"""Of a sample of ``hammer.flags``: the first sample of force at the threshold (-1 where silent), three
truths (0 or 1), and counts above rest."""

CLOCK_FIELDS = ("sample", "residual")
"""Of a sample of ``hammer.clock``: a scan's number, counted from the first of the capture (negative before
it), and s by which its arrival at the host, which is the sample's time, was later than the fit."""

SECOND_HIT = 0.05
"""Of the greatest force: a second rise to this spoils the force spectrum by more than it may (5 %)."""

_NOISE_WIDTHS = 8.0
SHORTEST_REST = 32
GUARD = 8
_SIGMA_PER_DEVIATION = 1.4826


BLOCK = 500
"""Samples in a recorded block."""


@dataclass(frozen=True)
class CaptureForm:
    """What is known of a box besides its counts."""

    nominal_rate: float  #: Hz, of each channel.
    threshold: float  #: counts above rest, at which a strike begins.
    full_scale: int  #: greatest count.


def block_channel(name: str, block: int, nominal_rate: float) -> Channel:
    """The channel of raw blocks of ``block`` counts; ``nominal_rate`` in Hz, of one channel."""
    return Channel(name, "count", (block,), "int32", "", nominal_rate)


@dataclass(frozen=True)
class Flags:
    """Whether a strike can be used."""

    onset: int  #: first sample of force at the threshold; 0 where silent.
    overload: bool  #: either channel read full scale or has flat tops below it: the true peak is not known.
    double_hit: bool  #: the hammer touched twice.
    silent: bool  #: the force never reached the threshold.


def readings_of_capture(
    counts: AnyArray,
    starts: tuple[float, float],
    rate: float,
    form: CaptureForm,
    arrivals: AnyArray,
    residuals: AnyArray,
) -> tuple[Reading, ...]:
    """The recorded form of a capture.

    Args:
        counts: ``(t, 2)`` of force and pressure, ``t`` a multiple of ``BLOCK``.
        starts: s on the bench clock, of the first sample of each.
        rate: Hz on the bench clock, of each.
        form: what is known of the box.
        arrivals: ``(n, 2)`` number of a sample (counted from the first of ``counts``), and s on the bench
            clock at which it arrived, of what the clock was fitted to.
        residuals: ``(n,)`` s by which those were later than the fit.
    """
    flags = judge(counts[:, 0], counts[:, 1], form.threshold, form.full_scale, form.full_scale, rate)
    onset = -1 if flags.silent else flags.onset
    said = {**asdict(flags), "onset": onset, "threshold": form.threshold}
    return (
        _blocks(FORCE, counts[:, 0], starts[0], rate, form.nominal_rate),
        _blocks(PRESSURE, counts[:, 1], starts[1], rate, form.nominal_rate),
        Reading(
            Channel(CLOCK, "1", (len(CLOCK_FIELDS),), "float64"),
            arrivals[:, 1],
            np.stack([arrivals[:, 0], residuals], axis=1),
        ),
        Reading(
            Channel(FLAGS, "1", (len(FLAG_FIELDS),), "float64"),
            np.array([starts[0] + max(0, onset) / rate]),
            np.array([[float(said[field]) for field in FLAG_FIELDS]]),
        ),
    )


def _blocks(name: str, counts: AnyArray, start: float, rate: float, nominal_rate: float) -> Reading:
    times = start + np.arange(0, len(counts), BLOCK) / rate
    return Reading(block_channel(name, BLOCK, nominal_rate), times, counts.reshape(-1, BLOCK))


def judge(
    force: AnyArray,
    pressure: AnyArray,
    threshold: float,
    full_scale: int,
    microphone_full_scale: int,
    rate: float | None = None,
) -> Flags:
    """Whether a strike can be used, from raw counts.

    Args:
        force: ``(t,)`` counts.
        pressure: ``(t',)`` counts.
        threshold: counts above rest at which a strike begins.
        full_scale: greatest count that the hammer's converter can say; ``-full_scale - 1`` is the least.
        microphone_full_scale: the same of the microphone's converter.
        rate: samples of force per second, for a rest that drifts; None for one level.
    """
    rest = np.median(force) if rate is None else coarse_rest(force, rate)
    risen = np.asarray(force, np.float64) - rest
    reached = np.flatnonzero(risen >= threshold)
    # An amplifier in front of the converter may saturate below full scale: flat tops at any level count.
    flat = is_clipped(force, above_only=True) or is_clipped(pressure)
    overload = bool(
        flat or _at_full_scale(force, full_scale) or _at_full_scale(pressure, microphone_full_scale)
    )
    if not len(reached):
        return Flags(0, overload, False, True)
    onset = int(reached[0])
    # A second hit: the force rises to a level again, having fallen to half of it before.
    quiet = risen[: max(0, onset - GUARD)]
    noise = _SIGMA_PER_DEVIATION * float(np.median(np.abs(quiet))) if len(quiet) >= SHORTEST_REST else 0.0
    level = max(SECOND_HIT * float(risen.max()), _NOISE_WIDTHS * max(noise, 1.0))
    crossings = np.where(risen >= level, 1, np.where(risen < 0.5 * level, -1, 0))
    held = crossings[crossings != 0]
    touches = int(np.count_nonzero(np.diff(held) > 0) + (held[0] > 0)) if len(held) else 1
    return Flags(onset, overload, touches > 1, False)


def _at_full_scale(counts: AnyArray, full_scale: int) -> bool:
    return bool(np.any(counts >= full_scale) or np.any(counts <= -full_scale - 1))
