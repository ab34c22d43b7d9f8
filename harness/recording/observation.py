"""One contact as it was recorded: images, the arm's pose at rest while they were taken, the strike."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused, RecordingDamaged
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.basics.resampling import resample
from harness.bench.acquisition import AcquisitionCalibration, Strike, of_one_stream, strike_from_readings
from harness.bench.acquisition_channels import FORCE
from harness.bench.device import Reading
from harness.picture.square_pixels import made_square
from harness.recording.step_file import StepRecord

AROUND_IMAGES = 0.1
"""s before the first frame from which the arm, at rest, is averaged too."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One contact as it was recorded."""

    base_from_gel: FloatArray  #: ``(4, 4)`` as the arm reported it while pressed.
    images: ByteArray  #: ``(n, rows, columns, 3)`` uint8, at least one frame taken while pressed.
    strike: Strike | None = None  #: what was heard when the place was struck; None where it was not.

    def __post_init__(self) -> None:
        pose = np.asarray(self.base_from_gel, dtype=np.float64)
        images = np.asarray(self.images)
        if pose.shape != (4, 4) or not np.isfinite(pose).all():
            raise DataRefused(f"a contact's base_from_gel must be a finite (4, 4) transform, not {pose!r}")
        if images.ndim != 4 or images.shape[3] != 3 or len(images) == 0 or images.dtype != np.uint8:
            raise DataRefused(
                f"a contact's images must be uint8 of shape (n, rows, columns, 3) with n >= 1, "
                f"not {images.dtype} of shape {images.shape}"
            )
        object.__setattr__(self, "base_from_gel", read_only(pose.copy()))
        object.__setattr__(self, "images", images)


def in_time(seen: Sequence[Observation]) -> tuple[Observation, ...]:
    """The contacts of one run, the sounds of a microphone on a clock of its own in time with each other."""
    if all(observation.strike is None for observation in seen):
        return tuple(seen)
    strikes = synchronised(of_one_stream([observation.strike for observation in seen]))
    return tuple(
        replace(observation, strike=strike) for observation, strike in zip(seen, strikes, strict=True)
    )


def observe_step(
    record: StepRecord,
    flange_from_gel: FloatArray,
    acquisition: AcquisitionCalibration | None = None,
    aspect: float = 1.0,
) -> Observation:
    """One contact: its images, where the arm was at rest while they were taken, and its strike.

    Args:
        record: of the step.
        flange_from_gel: ``(4, 4)`` of the station.
        acquisition: what the hammer's counts mean; None for a run without sound.
        aspect: a pixel's height over its width, as the gel's calibration says; images are made square by it.

    Raises:
        RecordingDamaged: the step has no images, or no pose of the arm with them.
    """
    images = _needed(record, "gel.image")
    poses = _needed(record, "arm.base_from_flange")
    first, last = images.times[0] - AROUND_IMAGES, images.times[-1]
    during = (poses.times >= first) & (poses.times <= last)
    if not during.any():
        raise RecordingDamaged(
            f"step {record.step.index}: no pose of the arm was recorded within {AROUND_IMAGES} s "
            "of its images"
        )
    struck = acquisition is not None and FORCE in record.readings
    strike = strike_from_readings(record.readings, acquisition) if struck and acquisition else None
    # The median place and the mean attitude of the poses at rest.
    places, quaternions = poses.values[during][:, :3], poses.values[during][:, 3:]
    aligned = quaternions * np.sign(quaternions @ quaternions[0])[:, None]
    middle = transform(rotation_from_quaternion(aligned.mean(axis=0)), np.median(places, axis=0))
    return Observation(middle @ flange_from_gel, made_square(images.values, aspect), strike)


def _needed(record: StepRecord, name: str) -> Reading:
    if name not in record.readings:
        raise RecordingDamaged(f"step {record.step.index} has no {name!r}; it cannot be estimated from")
    return record.readings[name]


def picture_left_out(step: int, why: object) -> str:
    """State in a sentence that the picture of a step, counted from 0, is not used, and why."""
    return f"step {step + 1}: its picture is left out: {why}"


BARE_IMAGE, IMAGE = "camera.bare", "camera.image"
"""Channels: the bench without the object, and with it."""


def look_pictures(record: StepRecord) -> tuple[ByteArray, ByteArray] | None:
    """``(rows, columns, 3)`` RGB with the object and without it; None where the step was no look.

    Each is the median of its frames, which has less of the camera's noise.
    """
    if IMAGE not in record.readings or BARE_IMAGE not in record.readings:
        return None
    return _median(record.readings[IMAGE].values), _median(record.readings[BARE_IMAGE].values)


def _median(frames: ByteArray) -> ByteArray:
    if len(frames) == 3:  # the middle one of each pixel, fifty times as fast as a partition of it
        a, b, c = np.asarray(frames)
        return np.asarray(np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))
    return np.asarray(np.median(frames, axis=0)).astype(np.uint8)


ComplexArray = npt.NDArray[np.complex128]

REACH = 0.4e-3
"""s to either side in which a strike is looked for: four times what clocks were seen to wander."""

COHERENT = 0.8
"""Share of a strike's power in common with the others whose phases one delay must explain."""

UNAMBIGUOUS = 0.05
"""By which that share must be greater than at any other delay that is not next to it."""

_STEP = 2e-6
_TRIED = read_only(np.arange(-REACH, REACH + 0.5 * _STEP, _STEP))
_NEXT = 40e-6
_ROUNDS = 3
_DURATION, _BEFORE, _PULSE = 0.3, 1e-3, 4e-3
_DECAY = 20.0
_LOWEST = 300.0
_FLOOR = 0.05
_SILENT = 1e-300
_UNPLACED = "its sound cannot be brought into time with that of the other strikes"


def synchronised(strikes: Sequence[Strike | None]) -> tuple[Strike | None, ...]:
    """The strikes, those on clocks of their own moved so that their sounds are in time with each other.

    Two instruments' clocks are fitted to the bench clock each for itself, and from strike to strike the
    fits wander against each other: by microseconds where both state when they sampled, by some 0.1 ms where
    one is known only by when its samples arrive. A wandering of ``d`` turns the transfer function of a
    strike by ``2 pi f d``. The strikes themselves tell it: near a resonance the transfer functions of two
    strikes are in the ratio of two real gains, so that the square of their cross spectrum has no phase
    of its own but ``4 pi f d``, at all resonances with one ``d``. The signs of the gains, in which the
    place is, are squared away and stay as they were. What is common to all strikes stays unknown.

    The ratio is not real where two modes share a frequency, as on a body of revolution: there fewer phases
    fit one delay, another one fits nearly as well, and the strike is marked instead of moved.

    Args:
        strikes: of one object, heard by one microphone at rest; None where a place was not struck.

    Returns:
        In order. Strikes on one clock, and those that must not be used anyway, are as they were. One whose
        place among the others cannot be told is marked lost.
    """
    own = [k for k, one in enumerate(strikes) if one is not None and one.opened is not None and not one.fault]
    if len(own) < 2:
        return tuple(strikes)
    chosen = {k: strike for k in own if (strike := strikes[k]) is not None}
    delays = _delays(list(chosen.values()))
    moved = {}
    for (k, strike), delay in zip(chosen.items(), delays, strict=True):
        if delay is None:
            moved[k] = strike.marked_lost(_UNPLACED)
            continue
        # The sound is moved to ``delay`` s earlier; the ends keep what there is.
        last = (len(strike.pressure) - 1) / strike.rate
        times = np.clip(np.arange(len(strike.pressure)) / strike.rate + delay, 0.0, last)
        pressure = resample(strike.pressure, 0.0, strike.rate, times, strike.rate)
        moved[k] = replace(strike, pressure=read_only(pressure))
    return tuple(moved.get(k, strike) for k, strike in enumerate(strikes))


def _delays(strikes: Sequence[Strike]) -> list[float | None]:
    """Seconds by which each is later than the middle of those whose delay is known; None of the others."""
    frequencies, transfer = _transfers(strikes)
    turns = np.exp(4j * np.pi * np.outer(_TRIED, frequencies))
    known = list(range(len(strikes)))
    # Initial estimate: the delay with which each strike fits those before it best.
    delays = np.zeros(len(transfer))
    for k in range(1, len(transfer)):
        fit = _fit(k, delays[: k + 1], transfer[: k + 1], frequencies, turns)
        delays[k] = _TRIED[np.argmax(fit)]
    while len(known) > 1:
        delays, fits = _together(delays, transfer[known], frequencies, turns)
        # Shortfall in coherence or uniqueness of each delay; at most zero for an accepted one.
        doubt = []
        for fit in fits:
            best = int(np.argmax(fit))
            apart = np.abs(_TRIED - _TRIED[best]) > _NEXT
            doubt.append(float(max(COHERENT - fit[best], fit[apart].max() + UNAMBIGUOUS - fit[best])))
        worst = int(np.argmax(doubt))
        if doubt[worst] <= 0.0:
            middle = float(np.median(delays))
            found = dict(zip(known, delays, strict=True))
            return [float(found[k]) - middle if k in found else None for k in range(len(strikes))]
        del known[worst]
        delays = np.delete(delays, worst)
    return [None] * len(strikes)


def _together(
    start: FloatArray, transfer: ComplexArray, frequencies: FloatArray, turns: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """``(k,)`` s by which each strike fits the others best, and ``(k, d)`` how well for every delay tried."""
    delays = start - np.median(start)
    fits = np.zeros((len(transfer), len(_TRIED)))
    for _ in range(_ROUNDS):
        for k in range(len(transfer)):
            fits[k] = _fit(k, delays, transfer, frequencies, turns)
            delays[k] = _TRIED[np.argmax(fits[k])]
    return delays, fits


def _fit(
    k: int, delays: FloatArray, transfer: ComplexArray, frequencies: FloatArray, turns: ComplexArray
) -> FloatArray:
    """Share of the common power of strike ``k`` and the others in phase, for each delay of ``k`` tried."""
    squares = np.zeros(len(frequencies), np.complex128)
    for other in range(len(delays)):
        if other != k:
            cross = transfer[k] * np.conj(transfer[other])
            size = np.abs(cross)
            # Of length |cross|, and of twice its phase; the other's delay is put right.
            doubled = cross**2 / np.where(size > 0.0, size, 1.0)
            squares += doubled * np.exp(-4j * np.pi * frequencies * delays[other])
    power = sum(
        float(np.sum(np.abs(transfer[k] * transfer[other]))) for other in range(len(delays)) if other != k
    )
    fit: FloatArray = (turns @ squares).real / max(power, _SILENT)
    return fit


def _transfers(strikes: Sequence[Strike]) -> tuple[FloatArray, ComplexArray]:
    """``(f,)`` Hz and ``(k, f)`` pressure over force, each of unit power, 0 where nothing is excited."""
    rate = float(np.median([strike.rate for strike in strikes]))
    samples = round(_DURATION * rate)
    window = np.exp(-_DECAY * np.arange(samples) / rate)
    frequencies: FloatArray = np.arange(samples + 1) / (2 * samples) * rate
    found = np.zeros((len(strikes), len(frequencies)), np.complex128)
    for number, strike in enumerate(strikes):
        start = max(0, strike.onset - round(_BEFORE * rate))
        pulse = start + round((_BEFORE + _PULSE) * rate)
        force = np.where(np.arange(len(strike.force)) < pulse, strike.force, 0.0)
        parts = [signal[start : start + samples] for signal in (force, strike.pressure)]
        driven, heard = (np.fft.rfft(part * window[: len(part)], 2 * samples) for part in parts)
        strength = np.abs(driven)
        excited = (strength > _FLOOR * strength.max()) & (frequencies > _LOWEST)
        ratio: ComplexArray = np.where(excited, heard / np.where(excited, driven, 1.0), 0.0)
        found[number] = ratio / max(float(np.linalg.norm(ratio)), _SILENT)
    excited = np.any(found != 0.0, axis=0)
    return frequencies[excited], found[:, excited]
