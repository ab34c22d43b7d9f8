"""From a run folder to its answer; the bench is not needed, and the truth is not looked at."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from experiments.contact_localization.accuracy.solving import (
    Readings,
    loaded,
    located,
    prepare,
    read,
)
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.dials import SENSES, Senses
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MeshRefused, WrongUse
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.effects.accuracy import Accuracy
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import Observation, in_time, observe_step
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord


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
        refused_pictures: why a contact's picture is left out, by its number from 0; its height map is zero.
    """

    observations: tuple[Observation, ...]
    heights: tuple[FloatArray, ...]
    model: Model
    prior: Prior
    last: Estimate
    seconds: float
    sense: Senses = "touch"
    others: Mapping[Senses, Estimate | FitRefused] = field(default_factory=dict)
    refused_pictures: Mapping[int, str] = field(default_factory=dict)

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

    Raises:
        MeshRefused: an estimate by sound alone is wanted, and the object has no modes to compare with.
    """

    def __init__(self, run: RunFiles, accuracy: Accuracy) -> None:
        self.model, self.prior = model_of_run(run, accuracy), prior_of(run)
        self._accuracy, self._run = accuracy, run
        self._seen: list[Observation] = []
        self._heights: list[FloatArray] = []
        self._refused_pictures: dict[int, str] = {}
        self._taken = (0.0, 0.0)
        if self.model.sound_refusal and accuracy.of(SENSES) == "audio":
            raise MeshRefused(f"an estimate by sound alone was asked for, and {self._sound_refusal}")
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
        seen, heights, refused = in_time(self._seen), tuple(self._heights), dict(self._refused_pictures)
        return Readings(seen, heights, self.model, self.prior, seed, self._taken, refused)

    def read(self, record: StepRecord) -> None:
        """Take in a contact; its images are turned into heights here, and nowhere else."""
        station = self._run.station
        aspect = aspect_stated(self._run.calibration.header.made_from)
        seen = observe_step(record, station.flange_from_gel, self._run.acquisition, aspect)
        one = loaded(lambda: read([seen], self.model, self.prior, seed=0))
        if one.refused_pictures:
            self._refused_pictures[len(self._seen)] = one.refused_pictures[0]
        self._seen.append(seen)
        self._heights += one.heights
        self._taken = (self._taken[0] + one.shared[0], self._taken[1] + one.shared[1])

    def answer(self) -> Answer:
        """By the sense that the accuracy names, and by each other one that was recorded.

        Contacts whose picture is refused count by their pose and strike alone; where no picture is left, an
        answer by all senses is one by sound. Where the object's sound cannot be compared, touch answers; the
        other senses are refused with the reason.

        Raises:
            WrongUse: no contact was read; or none was struck, and an answer by sound alone was asked for.
            FitRefused: no place on this object explains the readings, or no picture of them may be used.
        """
        readings = self.readings
        senses: tuple[Senses, ...] = SENSES.levels if readings.struck else ("touch",)
        sense = self._sense_of(readings)
        last = loaded(lambda: self._located(sense, readings)[-1])
        others = {other: self._tried(other, readings) for other in senses if other != sense}
        seconds = sum(last.seconds.values())
        seen, heights = readings.observations, readings.heights
        refused_pictures = readings.refused_pictures
        return Answer(seen, heights, self.model, self.prior, last, seconds, sense, others, refused_pictures)

    def so_far(self) -> Estimate:
        """The estimate by the contacts read so far, which is not judged: more are to come.

        Raises:
            WrongUse: no contact was read; or none was struck, and an answer by sound alone was asked for.
            FitRefused: no place on this object explains the readings, or no picture of them may be used.
        """
        readings = self.readings
        return self._located(self._sense_of(readings), readings, judged=False)[-1]

    def _sense_of(self, readings: Readings) -> Senses:
        """What the answer is by."""
        wanted = self._accuracy.of(SENSES)
        if wanted == "audio" and not readings.struck:
            raise WrongUse("an estimate by sound was asked for, and no contact was struck; ask for touch")
        if not readings.heard:
            return "touch"
        return "audio" if wanted == "both" and not readings.pictured else wanted

    def history(self, last: Estimate, sense: Senses) -> tuple[Estimate | FitRefused, ...]:
        """The estimates by a sense after each contact, the last of which is known.

        Fewer contacts than all are pictures of the way to the answer, and not judged; where they say
        nothing yet, why.
        """
        readings = self.readings
        count = len(readings.observations)
        if count == 1:
            return (last,)
        try:
            return (*self._located(sense, readings.first(count - 1), 1, judged=False), last)
        except (FitRefused, WrongUse):  # the first images show no contact, or were not struck
            early: list[Estimate | FitRefused] = []
            for k in range(1, count):
                try:
                    early += self._located(sense, readings.first(k), judged=False)
                except (FitRefused, WrongUse) as refusal:
                    early.append(FitRefused(str(refusal)))
            return (*early, last)

    @property
    def _sound_refusal(self) -> str:
        """Why only touch answers."""
        return f"sound cannot be compared: {self.model.sound_refusal}"

    def _tried(self, sense: Senses, readings: Readings) -> Estimate | FitRefused:
        if self.model.sound_refusal and sense != "touch":
            return FitRefused(self._sound_refusal)
        try:
            return loaded(lambda: self._located(sense, readings)[-1])
        except FitRefused as refusal:
            return refusal

    def _located(
        self, sense: Senses, readings: Readings, first: int | None = None, judged: bool = True
    ) -> tuple[Estimate, ...]:
        return located(readings, self._accuracy.with_({SENSES.name: sense}), first, judged)


def prior_of(run: RunFiles) -> Prior:
    """The orientation the scene states, or only that it stands upright; never the position."""
    rotation = run.scene.base_from_object(run.mesh)[:3, :3]
    return Prior(rotation, run.scene.section(Localization).yaw, run.station.errors.yaw)


def observe(run: RunFiles) -> tuple[Observation, ...]:
    """The contacts of a run, from its images, arm poses and strikes."""
    flange_from_gel, acquisition = run.station.flange_from_gel, run.acquisition
    aspect = aspect_stated(run.calibration.header.made_from)
    return in_time(
        [observe_step(record, flange_from_gel, acquisition, aspect) for record in run.recording.steps()]
    )
