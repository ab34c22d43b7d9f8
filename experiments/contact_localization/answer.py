"""From a run folder to its answer; the bench is not needed, and the truth is not looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from experiments.contact_localization.accuracy.solving import (
    Readings,
    loaded,
    located,
    prepare,
    timed_height_map,
)
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.posterior.dials import SENSES, Senses
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, RecordingDamaged, WrongUse
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.basics.symmetry import SymmetryGroup, find_symmetries
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
    """What the recording says of its last contact.

    Attributes:
        observations: the contacts as recorded.
        heights: ``(rows, columns)`` metres of indentation of each contact, from its images.
        model: the object and the sensor.
        prior: what was believed of the object's orientation.
        last: the answer.
        seconds: of the answer, from images to region; the surface's samples are made once before, and kernels
            are loaded.
        sense: what ``last`` is by.
        others: the answer by each other sense, or why that sense refused the object.
    """

    observations: tuple[Observation, ...]
    heights: tuple[FloatArray, ...]
    model: Model
    prior: Prior
    last: Estimate
    seconds: float
    sense: Senses = "touch"
    others: Mapping[Senses, Estimate | FitRefused] = field(default_factory=dict)

    @property
    def by_sense(self) -> dict[Senses, Estimate | FitRefused]:
        """The answer by every sense that was recorded: touch, audio, both."""
        found: dict[Senses, Estimate | FitRefused] = {**self.others, self.sense: self.last}
        return {sense: found[sense] for sense in SENSES.levels if sense in found}


class ContactAnswering:
    """Readings to answer: each contact's images are read once, for the answer and all that follows it.

    Args:
        run: the folder.
        accuracy: of the estimate, and of the modes that a sound is compared with.
    """

    def __init__(self, run: RunFiles, accuracy: Accuracy) -> None:
        self.model, self.prior = model_of_run(run, accuracy), prior_of(run)
        self._accuracy, self._run = accuracy, run
        self._seen: list[Observation] = []
        self._heights: list[FloatArray] = []
        self._taken = (0.0, 0.0)
        prepare(self.model, accuracy)
        _ = self.symmetry

    @cached_property
    def symmetry(self) -> SymmetryGroup:
        """Of the object."""
        return find_symmetries(self.model.mesh)

    @property
    def readings(self) -> Readings:
        """The contacts read so far, in time with each other.

        Raises:
            WrongUse: no contact was read.
        """
        if not self._seen:
            raise WrongUse("no contact was read; a run needs at least one")
        seed = self._run.recording.header.seed
        heights = tuple(self._heights)
        return Readings(in_time(self._seen), heights, self.model, self.prior, seed, self._taken)

    def read(self, record: StepRecord) -> None:
        """Take in a contact; its images are turned into heights here, and nowhere else."""
        station = self._run.station
        aspect = aspect_stated(self._run.calibration.header.made_from)
        seen = observe_step(record, station.flange_from_gel, self._run.acquisition, aspect)
        heights, cpu, wall = loaded(lambda: timed_height_map(seen, self.model))
        self._seen.append(seen)
        self._heights.append(heights)
        self._taken = (self._taken[0] + cpu, self._taken[1] + wall)

    def answer(self) -> Answer:
        """By the sense that the accuracy names, and by each other one that was recorded.

        Raises:
            WrongUse: no contact was read; or none was struck, and an answer by sound alone was asked for.
            FitRefused: no place on this object explains the readings.
        """
        readings = self.readings
        wanted = self._accuracy.of(SENSES)
        if wanted == "audio" and not readings.heard:
            raise WrongUse("an estimate by sound was asked for, and no contact was struck; ask for touch")
        senses: tuple[Senses, ...] = SENSES.levels if readings.heard else ("touch",)
        sense = wanted if readings.heard else "touch"
        last = loaded(lambda: self._by(sense, readings))
        others = {other: self._tried(other, readings) for other in senses if other != sense}
        seconds = sum(last.seconds.values())
        seen, heights = readings.observations, readings.heights
        return Answer(seen, heights, self.model, self.prior, last, seconds, sense, others)

    def history(self, last: Estimate, sense: Senses) -> tuple[Estimate, ...]:
        """The estimates by a sense after each contact, the last of which is known."""
        readings = self.readings
        count = len(readings.observations)
        if count == 1:
            return (last,)
        return (*self._located(sense, readings.first(count - 1), 1), last)

    def _by(self, sense: Senses, readings: Readings) -> Estimate:
        return self._located(sense, readings, None)[-1]

    def _tried(self, sense: Senses, readings: Readings) -> Estimate | FitRefused:
        try:
            return loaded(lambda: self._by(sense, readings))
        except FitRefused as refusal:
            return refusal

    def _located(self, sense: Senses, readings: Readings, first: int | None) -> tuple[Estimate, ...]:
        return located(readings, self._accuracy.with_({SENSES.name: sense}), first)


def prior_of(run: RunFiles) -> Prior:
    """The orientation the scene states, or only that it stands upright; never the position."""
    rotation = run.scene.base_from_object(run.mesh)[:3, :3]
    return Prior(rotation, run.scene.section(Localization).yaw)


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
