"""From a run folder to its answer; the bench is not needed, and the truth is not looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numba.core.event import install_recorder

from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.posterior.estimate import Estimate, each_estimate, estimate
from experiments.contact_localization.posterior.levels import Levels, Senses
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, RecordingDamaged, WrongUse
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.bench.acquisition import AcquisitionCalibration, of_one_stream, strike_from_readings
from harness.bench.acquisition_channels import FORCE
from harness.bench.reading import Reading
from harness.effects.accuracy import Accuracy
from harness.picture.square_pixels import aspect_stated, made_square
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.recording.synchronise import synchronised

AROUND_IMAGES = 0.1
"""s before the first frame from which the arm, at rest, is averaged too."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What the recording says.

    Attributes:
        observations: the contacts as recorded.
        model: the object and the sensor.
        prior: what was believed of the object's orientation.
        estimates: after each contact; the last is the answer.
        seconds: of the last answer, from images to region; the surface's samples are made once before, and
            kernels are loaded.
        sense: what ``estimates`` are by.
        others: the last answer by each other sense, or why that sense refused the object.
    """

    observations: tuple[Observation, ...]
    model: Model
    prior: Prior
    estimates: tuple[Estimate, ...]
    seconds: float
    sense: Senses = "touch"
    others: Mapping[Senses, Estimate | FitRefused] = field(default_factory=dict)

    @property
    def last(self) -> Estimate:
        """The answer."""
        return self.estimates[-1]

    @property
    def by_sense(self) -> dict[Senses, Estimate | FitRefused]:
        """The last answer by every sense that was recorded: touch, audio, both."""
        found: dict[Senses, Estimate | FitRefused] = {**self.others, self.sense: self.last}
        return {sense: found[sense] for sense in _SENSES if sense in found}


_SENSES: tuple[Senses, ...] = ("touch", "audio", "both")


def answer(
    run: RunFiles, levels: Levels, every_contact: bool = True, accuracy: Accuracy | None = None
) -> Answer:
    """Estimate from a recording.

    Args:
        run: the folder.
        levels: of the estimator's dials.
        every_contact: whether the estimates after each contact are wanted too.
        accuracy: of the modes that a sound is compared with; None for the default levels.

    Raises:
        WrongUse: the run holds no contact yet.
        FitRefused: no place on this object explains the readings.
    """
    observations = observe(run)
    if not observations:
        raise WrongUse(f"{run.recording.folder} holds no contact yet; go on with `touchstone run --resume`")
    model, prior, seed = model_of_run(run, accuracy), prior_of(run), run.recording.header.seed
    first = 1 if every_contact else len(observations)
    senses: tuple[Senses, ...] = _SENSES if any(o.strike is not None for o in observations) else ("touch",)
    sense = levels.senses if levels.senses in senses else "touch"
    if levels.senses == "audio" and sense == "touch":
        raise WrongUse("an estimate by sound was asked for, and no contact was struck; ask for touch")

    def by(one: Senses) -> Estimate | FitRefused:
        return _tried(observations, model, prior, replace(levels, senses=one), seed)

    with install_recorder("numba:compiler_lock") as loads:
        estimates = each_estimate(
            observations, model, prior, replace(levels, senses=sense), seed=seed, first=first
        )
        others = {other: by(other) for other in senses if other != sense}
    if loads.buffer:  # a kernel was compiled or loaded meanwhile: no answer costs that
        estimates = (*estimates[:-1], _in_the_time_of(by(sense), estimates[-1]))
        others = {
            other: found if isinstance(found, FitRefused) else _in_the_time_of(by(other), found)
            for other, found in others.items()
        }
    seconds = sum(estimates[-1].seconds.values())
    return Answer(observations, model, prior, estimates, seconds, sense, others)


def _tried(
    observations: tuple[Observation, ...], model: Model, prior: Prior, levels: Levels, seed: int
) -> Estimate | FitRefused:
    try:
        return estimate(observations, model, prior, levels, seed=seed)
    except FitRefused as refusal:
        return refusal


def _in_the_time_of(again: Estimate | FitRefused, found: Estimate) -> Estimate:
    """An answer with the seconds that the same one took when it was asked for again."""
    return found if isinstance(again, FitRefused) else replace(found, seconds=again.seconds)


def prior_of(run: RunFiles) -> Prior:
    """The orientation the scene states, or only that it stands upright; never the position."""
    rotation = run.scene.base_from_object(run.mesh)[:3, :3]
    return Prior(rotation, run.scene.localization.yaw)


def observe(run: RunFiles) -> tuple[Observation, ...]:
    """The contacts of a run, from its images, arm poses and strikes."""
    flange_from_gel, acquisition = run.station.flange_from_gel, run.acquisition
    aspect = aspect_stated(run.calibration.header.made_from)
    return in_time(
        [observe_step(record, flange_from_gel, acquisition, aspect) for record in run.recording.steps()]
    )


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
