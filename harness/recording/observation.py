"""One contact as it was recorded: images, the arm's pose at rest while they were taken, the strike."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused, RecordingDamaged
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.bench.acquisition import AcquisitionCalibration, Strike, of_one_stream, strike_from_readings
from harness.bench.acquisition_channels import FORCE
from harness.bench.reading import Reading
from harness.picture.square_pixels import made_square
from harness.recording.step_file import StepRecord
from harness.recording.synchronise import synchronised

AROUND_IMAGES = 0.1
"""s before the first frame from which the arm, at rest, is averaged too."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One contact as it was recorded.

    Attributes:
        base_from_gel: ``(4, 4)`` as the arm reported it while pressed.
        images: ``(n, rows, columns, 3)`` uint8, at least one frame taken while pressed.
        strike: what was heard when the place was struck; None where it was not.
    """

    base_from_gel: FloatArray
    images: ByteArray
    strike: Strike | None = None

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
    return Observation(
        _middle(poses.values[during]) @ flange_from_gel, made_square(images.values, aspect), strike
    )


def _middle(poses: FloatArray) -> FloatArray:
    """``(4, 4)``: the median place and the mean attitude of ``(n, 7)`` poses at rest."""
    quaternions = poses[:, 3:]
    aligned = quaternions * np.sign(quaternions @ quaternions[0])[:, None]
    return transform(rotation_from_quaternion(aligned.mean(axis=0)), np.median(poses[:, :3], axis=0))


def _needed(record: StepRecord, name: str) -> Reading:
    if name not in record.readings:
        raise RecordingDamaged(f"step {record.step.index} has no {name!r}; it cannot be estimated from")
    return record.readings[name]


def picture_left_out(step: int, why: object) -> str:
    """For people: the gel's picture of a step, from 0, has no part in what is computed.

    Args:
        step: of the run.
        why: the refusal.
    """
    return f"step {step + 1}: its picture is left out: {why}"
