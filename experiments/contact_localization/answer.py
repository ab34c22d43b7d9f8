"""From a run folder to its answer; the bench is not needed, and the truth is not looked at."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.estimate import Estimate, each_estimate
from experiments.contact_localization.levels import Levels
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation
from harness.arrays import FloatArray
from harness.errors import RecordingDamaged, WrongUse
from harness.geometry import rotation_from_quaternion, transform
from harness.reading import Reading
from harness.run_folder import RunFiles
from harness.step_file import StepRecord

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
        seconds: of the last answer, from images to region; the surface's samples are made once before.
    """

    observations: tuple[Observation, ...]
    model: Model
    prior: Prior
    estimates: tuple[Estimate, ...]
    seconds: float

    @property
    def last(self) -> Estimate:
        """The answer."""
        return self.estimates[-1]


def answer(run: RunFiles, levels: Levels, every_contact: bool = True) -> Answer:
    """Estimate from a recording.

    Args:
        run: the folder.
        levels: of the estimator's dials.
        every_contact: whether the estimates after each contact are wanted too.

    Raises:
        WrongUse: the run holds no contact yet.
        FitRefused: no place on this object explains the readings.
    """
    observations = observe(run)
    if not observations:
        raise WrongUse(f"{run.recording.folder} holds no contact yet; go on with `touchstone run --resume`")
    model = Model(run.mesh, run.station.gel.sensor, run.calibration)
    prior = prior_of(run)
    first = 1 if every_contact else len(observations)
    estimates = each_estimate(observations, model, prior, levels, seed=run.recording.header.seed, first=first)
    return Answer(observations, model, prior, estimates, sum(estimates[-1].seconds.values()))


def prior_of(run: RunFiles) -> Prior:
    """The orientation the scene states, or only that it stands upright; never the position."""
    rotation = run.scene.base_from_object(run.mesh)[:3, :3]
    return Prior(rotation, run.scene.localization.yaw)


def observe(run: RunFiles) -> tuple[Observation, ...]:
    """The contacts of a run, from its images and arm poses."""
    flange_from_gel = run.station.flange_from_gel
    return tuple(observe_step(record, flange_from_gel) for record in run.recording.steps())


def observe_step(record: StepRecord, flange_from_gel: FloatArray) -> Observation:
    """One contact: its images, and where the arm was at rest while they were taken.

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
    return Observation(_middle(poses.values[during]) @ flange_from_gel, images.values)


def _middle(poses: FloatArray) -> FloatArray:
    """``(4, 4)``: the median place and the mean attitude of ``(n, 7)`` poses at rest."""
    quaternions = poses[:, 3:]
    aligned = quaternions * np.sign(quaternions @ quaternions[0])[:, None]
    return transform(rotation_from_quaternion(aligned.mean(axis=0)), np.median(poses[:, :3], axis=0))


def _needed(record: StepRecord, name: str) -> Reading:
    if name not in record.readings:
        raise RecordingDamaged(f"step {record.step.index} has no {name!r}; it cannot be estimated from")
    return record.readings[name]
