"""What a data-acquisition box read of one strike, and what it means in newtons and pascals.

A capture is recorded as read: whole counts in blocks, each block with the bench-clock time of its
first sample, channel by channel, so that the skew of a multiplexed converter is in the times and
not in the samples. ``strike_from_readings`` makes physics of it: one time axis for both channels,
newtons, pascals, and whether the strike can be used.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import CalibrationRefused, DataRefused, RecordingDamaged
from harness.basics.files.foreign_file import MOST_TEXT, read_bounded
from harness.basics.resampling import resample
from harness.basics.rest_level import fit_rest
from harness.basics.whole_file import write_text_whole
from harness.bench.acquisition_channels import (
    FLAG_FIELDS,
    FLAGS,
    FORCE,
    GUARD,
    PRESSURE,
    SHORTEST_REST,
    judge,
)
from harness.bench.device import Reading
from harness.bench.microphone_take import take_of

_STEADY = 1e-4
_FAR = 6.0


@dataclass(frozen=True, eq=False)
class Record:
    """All blocks of one channel in a row, and the steady clock that their times give."""

    name: str  #: of the channel.
    counts: FloatArray  #: ``(t,)``, whole.
    start: float  #: s on the bench clock, of the first.
    rate: float  #: Hz on the bench clock.

    @property
    def end(self) -> float:
        """Seconds on the bench clock, of the last sample."""
        return self.start + (len(self.counts) - 1) / self.rate

    @classmethod
    def of(cls, readings: Mapping[str, Reading], name: str) -> "Record":
        """The channel called ``name``.

        Raises:
            DataRefused: it is missing, or one block, whose samples have no rate.
            RecordingDamaged: block times that no steady clock gives.
        """
        reading = reading_of(readings, name)
        blocks, block = reading.values.shape
        if blocks < 2:
            raise DataRefused(f"{name} has {blocks} block; two are needed to know the rate of its samples")
        numbers = np.arange(blocks) * block
        origin = reading.times[0]
        period, late = np.polyfit(numbers, reading.times - origin, 1)
        astray = np.abs(reading.times - origin - late - period * numbers).max()
        if not period > 0.0 or astray > _STEADY:
            raise RecordingDamaged(
                f"{name}: block times leave a steady clock by {astray * 1e6:.0f} us; "
                f"at most {_STEADY * 1e6:.0f} us are possible"
            )
        counts = reading.values.ravel().astype(np.float64)
        return cls(name, counts, float(origin + late), 1.0 / float(period))


def reading_of(readings: Mapping[str, Reading], name: str) -> Reading:
    """The reading called ``name``; ``DataRefused`` where there is none."""
    if name not in readings:
        raise DataRefused(f"the step has no channel {name}; it recorded {', '.join(sorted(readings))}")
    return readings[name]


def check_counts(record: Record, full_scale: int) -> None:
    """``DataRefused`` where a count is beyond what a converter of this full scale can say."""
    low, high = record.counts.min(), record.counts.max()
    if low < -full_scale - 1 or high > full_scale:
        raise DataRefused(
            f"{record.name} holds counts from {low:.0f} to {high:.0f}; the calibrated box says "
            f"{-full_scale - 1} to {full_scale}: the calibration is of another box"
        )


def middle(counts: FloatArray) -> float:
    """The mean of what is not far out: neither a loud beginning nor a full scale moves it."""
    away = np.abs(counts - np.median(counts))
    return float(counts[away <= _FAR * max(1.0, float(np.median(away)))].mean())


def rest_of(name: str, rest: float, offset: float, tolerance: float) -> float:
    """Counts at rest as measured, checked against the calibrated offset."""
    if abs(rest - offset) > tolerance:
        raise DataRefused(
            f"{name} rests at {rest:.0f} counts; it was calibrated at {offset:.0f}, within "
            f"{tolerance:.0f}: check that the channels are not swapped, or calibrate again"
        )
    return rest


SCHEMA = 1

_SHIPPED = Path(__file__).parent / "data"
_TEXTS = ("model", "serial", "hammer_serial", "microphone_serial", "date", "made_from")
_SIGNED = ("hammer_offset", "microphone_offset")
DRIFT_SAMPLES = 256
"""Samples before a blow from which a drift of the rest is known well enough to be removed."""

DRIFT_SIGMAS, DRIFT_COUNTS = 6.0, 2.0
"""Deviations of the slope, and counts over the time before the blow, from which the rest drifts."""

_ROUNDING = 0.3
_FULL_SCALES = (2**11 - 1, 2**15 - 1, 2**23 - 1, 2**31 - 1)


@dataclass(frozen=True)
class AcquisitionCalibration:
    """What counts mean: a dated artefact of one box with one hammer and one microphone."""

    model: str  #: of the box, for example ``"DI-2108"``.
    serial: str  #: of the box, as it states it (``info 6``).
    hammer_serial: str  #: of the force cell.
    microphone_serial: str  #: of the microphone.
    date: str  #: ISO 8601, of the calibration.
    made_from: str  #: what it was made from: the certificates, or the recording of a known mass being struck.
    volts_per_count: float  #: V, of the box.
    full_scale_counts: int  #: greatest count that the box can say; ``-full_scale_counts - 1`` is the least.
    hammer_newtons_per_volt: float
    """N/V at the box's input; the cell's sensitivity and its conditioner's gain."""
    hammer_offset: float  #: counts at rest.
    hammer_limit: float  #: N, the greatest force of the calibration; beyond it a strike counts as overload.
    microphone_volts_per_count: float
    """V, of the converter that the microphone is on; the box's own if that."""
    microphone_full_scale_counts: int  #: of that converter.
    microphone_pascals_per_volt: float  #: Pa/V at the converter's input, sensitivity and gain inside.
    microphone_offset: float  #: counts at rest.
    microphone_limit: float  #: Pa, the greatest pressure of the calibration.
    offset_tolerance: float
    """counts by which a rest may differ from its offset; less than half of the two offsets' difference, or a
    swap of the channels could not be told. Counts of the box: of a microphone's own converter it is the same
    share of full scale."""
    residual: float  #: relative, of the fit or as the certificates state it.

    def __post_init__(self) -> None:
        values = asdict(self)
        for name in _TEXTS:
            if not isinstance(values[name], str) or not values[name]:
                raise CalibrationRefused(f"calibration: {name} = {values[name]!r}; it must be a text")
        for name in (field.name for field in fields(self) if field.name not in _TEXTS):
            _check_number(name, values[name])
        for name in ("full_scale_counts", "microphone_full_scale_counts"):
            if values[name] not in _FULL_SCALES:
                raise CalibrationRefused(
                    f"calibration: {name} = {values[name]}; a converter has one of {_FULL_SCALES}"
                )

    @classmethod
    def load(cls, path: Path) -> "AcquisitionCalibration":
        """An artefact as ``save`` writes it.

        Raises:
            WrongUse: there is no such file, or none that may be read.
            CalibrationRefused: it is too large, has a key too few or too many, a number that is not
                finite or of the wrong sign, or was changed after it was made.
        """
        try:
            tree = json.loads(read_bounded(path, "a calibration", MOST_TEXT, CalibrationRefused))
        except (ValueError, RecursionError) as error:
            raise CalibrationRefused(f"{path}: not a calibration of an acquisition box: no JSON") from error
        if not isinstance(tree, dict) or tree.get("schema") != SCHEMA:
            raise CalibrationRefused(f"{path}: not schema {SCHEMA} of an acquisition box's calibration")
        values = {name: value for name, value in tree.items() if name not in ("schema", "hash")}
        expected = {field.name for field in fields(cls)}
        if set(values) != expected:
            raise CalibrationRefused(f"{path}: wrong or missing keys: {sorted(set(values) ^ expected)}")
        made = cls(**values)
        if tree.get("hash") != made.hash:
            raise CalibrationRefused(
                f"{path}: its contents hash to {made.hash}, not {tree.get('hash')!r}; make it again"
            )
        return made

    def save(self, path: Path) -> None:
        """Write the artefact with its schema and hash."""
        text = json.dumps({"schema": SCHEMA, **asdict(self), "hash": self.hash}, indent=1)
        write_text_whole(path, text + "\n")

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the contents, 16 digits of it."""
        text = json.dumps(asdict(self), sort_keys=True, allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def without_microphone(self) -> "AcquisitionCalibration":
        """Of the box alone, its input 1 being shorted, because the microphone is on a sound card."""
        return replace(self, microphone_offset=0.0, microphone_full_scale_counts=self.full_scale_counts)

    @property
    def newtons_per_count(self) -> float:
        """N."""
        return self.volts_per_count * self.hammer_newtons_per_volt

    @property
    def pascals_per_count(self) -> float:
        """Pa."""
        return self.microphone_volts_per_count * self.microphone_pascals_per_volt


def shipped_acquisition(name: str) -> AcquisitionCalibration:
    """An artefact that comes with the package, by its name; ``CalibrationRefused`` where there is none."""
    return AcquisitionCalibration.load(_SHIPPED / f"{name}.json")


def _check_number(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CalibrationRefused(f"calibration: {name} = {value!r}; it must be a finite number")
    if name not in _SIGNED and not value > 0:
        raise CalibrationRefused(f"calibration: {name} = {value!r}; it must be above zero")


@dataclass(frozen=True, eq=False)
class Strike:
    """One captured strike, on one time axis."""

    rate: float  #: Hz, of both channels, fitted on the bench clock.
    force: FloatArray  #: ``(t,)`` N, compression positive, rest taken off.
    pressure: FloatArray
    """``(t,)`` Pa at the same times as the force, rest taken off; zero where it is ``lost`` and shares no
    moment with the force."""
    onset: int  #: sample at which the force reached the trigger's threshold; 0 where silent.
    start: float  #: s on the bench clock, of sample 0.
    overload: bool
    """full scale was read, a channel has flat tops, or the calibrated range was left: amplitudes are not to
    be trusted. Also where ``lost`` says that the sound is not."""
    double_hit: bool  #: the hammer touched twice.
    silent: bool  #: no force reached the threshold; there is nothing to analyse.
    lost: str = ""
    """why the sound of a microphone on a clock of its own must not be used; empty where it may."""
    jitter: float = 0.0
    """s, standard deviation of the sound's place against the force's, from strike to strike; 0 on one clock.
    A latency common to all strikes is not in it: see ``opened``."""
    opened: float | None = None
    """s on the bench clock, when the microphone's own stream was opened; None on one clock. Between strikes
    of two streams the latency may differ."""

    @property
    def fault(self) -> str:
        """Why the strike must not be used, in words; empty where it may be."""
        if self.silent:
            return "no strike came"
        if self.lost:
            return self.lost
        if self.overload:
            return "a channel was overloaded"
        return "the hammer hit twice" if self.double_hit else ""

    def marked_lost(self, why: str) -> "Strike":
        """The same strike, not to be used for a reason in words."""
        return replace(self, lost=why, overload=True)

    @property
    def times(self) -> FloatArray:
        """``(t,)`` s on the bench clock."""
        return self.start + np.arange(len(self.force)) / self.rate


def strike_from_readings(readings: Mapping[str, Reading], calibration: AcquisitionCalibration) -> Strike:
    """One captured strike in newtons and pascals, both at the times of the force's samples.

    The pressure is resampled, band-limited, to the times of the force: spectra of the two are divided
    by each other, and a skew of 10 us would be 0.6 rad at 10 kHz. What the two records do not
    share in time is left out. A microphone on a clock of its own is late by a latency that nobody
    knows: common to all strikes of its stream, it turns every peak of their transfer functions by the
    same angle, which no estimate reads. What is not common, the wandering of the two clocks against each
    other, `harness.recording.observation` takes out. Takes whose own clock is too uncertain (``jitter``), or
    that lost samples, are marked.

    Args:
        readings: by channel name, as a step's record holds them; other channels are ignored.
        calibration: of the box, the hammer and the microphone.

    Raises:
        DataRefused: a channel is missing, holds counts that the calibrated box cannot say, or rests far
            from its calibrated offset (as it does when the channels are swapped).
        RecordingDamaged: block times that no steady clock gives.
    """
    force, pressure = (Record.of(readings, name) for name in (FORCE, PRESSURE))
    threshold = float(reading_of(readings, FLAGS).values[0][FLAG_FIELDS.index("threshold")])
    scales = calibration.full_scale_counts, calibration.microphone_full_scale_counts
    check_counts(force, scales[0])
    check_counts(pressure, scales[1])
    flags = judge(force.counts, pressure.counts, threshold, *scales, force.rate)
    tolerance = calibration.offset_tolerance
    before = force.counts[: max(0, flags.onset - GUARD)]
    quiet = force.counts if flags.silent else before
    force_rest: FloatArray | float = calibration.hammer_offset
    if len(quiet) >= SHORTEST_REST:
        level, force_rest = _rest_of_force(force, quiet, flags.silent)
        rest_of(FORCE, level, calibration.hammer_offset, tolerance)
    # Sound swings about its rest; all of it tells the rest better than the short, rumbling time before.
    tolerance *= calibration.microphone_full_scale_counts / calibration.full_scale_counts
    pressure_rest = rest_of(PRESSURE, middle(pressure.counts), calibration.microphone_offset, tolerance)
    newtons = (force.counts - force_rest) * calibration.newtons_per_count
    pascals = (pressure.counts - pressure_rest) * calibration.pascals_per_count
    times = force.start + np.arange(len(newtons)) / force.rate
    take = take_of(readings)
    lost = "" if take is None else take.fault
    shared = (times >= pressure.start) & (times <= pressure.end)
    if not np.any(shared) and not lost:
        raise DataRefused(f"{FORCE} and {PRESSURE} have no moment in common; they are of different strikes")
    if not np.any(shared):  # the clock of a take that lost samples may say anything
        shared, pascals = np.ones(len(times), np.bool_), np.zeros(len(pascals))
    first = int(np.argmax(shared))
    heard = np.clip(times[shared], pressure.start, pressure.end) if lost else times[shared]
    beyond = np.abs(newtons).max() > calibration.hammer_limit or (
        np.abs(pascals).max() > calibration.microphone_limit
    )
    return Strike(
        force.rate,
        read_only(newtons[shared]),
        read_only(resample(pascals, pressure.start, pressure.rate, heard, force.rate)),
        0 if flags.silent else max(0, flags.onset - first),
        float(times[first]),
        bool(flags.overload or beyond or lost),
        flags.double_hit,
        flags.silent,
        lost,
        0.0 if take is None else take.uncertainty,
        None if take is None else take.opened,
    )


def _rest_of_force(force: Record, quiet: FloatArray, silent: bool) -> tuple[float, FloatArray | float]:
    """Return the rest next to a blow in counts, and the rest of every sample: a line where it drifts.

    Args:
        force: counts of the force.
        quiet: counts before the blow, or all where nothing was struck.
        silent: whether nothing was struck.
    """
    level, first = float(np.median(quiet)), len(quiet)
    if silent or first < DRIFT_SAMPLES:
        return level, level
    before = np.arange(len(force.counts)) < first
    line = fit_rest(force.counts, before, force.rate, first, min(first + GUARD, len(force.counts) - 1))
    if line is None:
        return level, level
    # The noise of whole counts is at least that of rounding.
    sigma = max(line.noise, _ROUNDING) * float(np.sqrt(line.covariance[1, 1]))
    if abs(line.slope) < DRIFT_SIGMAS * sigma or abs(line.slope) * first / force.rate < DRIFT_COUNTS:
        return level, level
    return line.level, line.at(np.arange(len(force.counts)) / force.rate)


def of_one_stream(strikes: Sequence[Strike | None]) -> tuple[Strike | None, ...]:
    """The strikes of a run, with those marked lost whose sound cannot be compared with most others'.

    A sound card opened anew, as when a run is resumed, may have another latency, which nobody
    knows. Strikes heard by the stream with most usable ones stay as they are.

    Args:
        strikes: in order; None where a place was not struck.
    """
    streams = [strike.opened for strike in strikes if strike is not None and not strike.fault]
    if len(set(streams)) < 2:
        return tuple(strikes)
    most = max(streams, key=streams.count)
    why = "the microphone was opened anew in between: its latency may be another"
    return tuple(
        strike if strike is None or strike.fault or strike.opened == most else strike.marked_lost(why)
        for strike in strikes
    )
