"""From a run's readings to its answer, at any accuracy; neither the bench nor the truth is needed."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

from numba.core.event import install_recorder

from experiments.contact_localization.accuracy.dials import SIMULATED, accuracy_at, needs_images, needs_sound
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.dials import (
    BLOCK,
    METHOD,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
    Senses,
)
from experiments.contact_localization.posterior.estimate import Estimate, locate
from experiments.contact_localization.posterior.noise import noise_at
from experiments.contact_localization.section import Localization
from experiments.contact_localization.touch.touch import Contact, contact_of
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MeshRefused, WrongUse
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.bench.bench_errors import BenchErrors
from harness.effects.accuracy import Accuracy, Level, Setting
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.solving import Solved
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import Observation, in_time, observe_step
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.sim.optics.inverse import heights_or_refusal

T = TypeVar("T")


PROGRAM = "contact-localization"


ESTIMATOR = "experiments.contact_localization.posterior.estimate"
"""The module whose sources, with all they import, decide whether a curve still holds."""


_LOOKED_BY = (SPACING, ROUNDS, SAMPLES, BLOCK)
"""How finely readings are looked at; which senses are asked, and how they are simulated, is another thing."""


@dataclass(frozen=True, eq=False)
class Readings:
    """A run's readings, brought as far as settings share: the height maps of its images."""

    observations: tuple[Observation, ...]  #: of the contacts.
    heights: tuple[FloatArray, ...]  #: a height map for each; none where no setting looks at images.
    model: Model  #: the object and the sensor.
    prior: Prior  #: of its orientation.
    seed: int  #: of the draws.
    shared: tuple[float, float]  #: s of CPU time and on the clock that the height maps took.
    refused_pictures: Mapping[int, str] = field(default_factory=dict)
    """why a contact's picture is not used, by its number from 0; its height map is zero."""

    @property
    def pictured(self) -> bool:
        """Whether not every picture is refused."""
        return not self.refused_pictures or len(self.refused_pictures) < len(self.observations)

    @property
    def struck(self) -> bool:
        """Whether any contact was."""
        return any(observation.strike is not None for observation in self.observations)

    @property
    def heard(self) -> bool:
        """Whether any contact was struck, and the object has modes to compare its sound with."""
        return self.struck and not self.model.sound_refusal

    def under(self, model: Model) -> "Readings":
        """The same readings, to be compared with another model of the object."""
        return replace(self, model=model)

    def first(self, count: int) -> "Readings":
        """Those of the first contacts alone."""
        share = count / len(self.observations)
        return replace(
            self,
            observations=self.observations[:count],
            heights=self.heights[:count],
            refused_pictures={k: why for k, why in self.refused_pictures.items() if k < count},
            shared=(share * self.shared[0], share * self.shared[1]),
        )


@dataclass(frozen=True, eq=False)
class Models:
    """The models of one object, one for each choice of the simulation's dials; each is made on first use."""

    make: Callable[[Accuracy], Model]  #: of the accuracy that chooses the simulation.
    start: Setting = field(default_factory=dict)
    """levels of the simulation that a setting turns from: those of the object's ObjectFile."""
    _made: dict[tuple[Level, ...], Model] = field(init=False, default_factory=dict, repr=False)

    def at(self, setting: Setting) -> Model:
        """The model that a setting compares with; without sound the dials of modes count for nothing."""
        turned = SIMULATED if needs_sound(setting) else (TOUCH,)
        levels = {**self.start, **{knob.name: setting[knob.name] for knob in turned if knob.name in setting}}
        accuracy = accuracy_at(levels)
        chosen = tuple(accuracy[knob.name] for knob in SIMULATED)
        if chosen not in self._made:
            self._made[chosen] = self.make(accuracy)
        return self._made[chosen]

    def all(self) -> Mapping[tuple[Level, ...], Model]:
        """Those made so far, by the levels of ``SIMULATED``."""
        return dict(self._made)


def read(
    observations: Sequence[Observation], model: Model, prior: Prior, seed: int, images: bool = True
) -> Readings:
    """Do, and time, what settings share.

    Args:
        observations: of the contacts.
        model: the object and the sensor.
        prior: of the object's orientation.
        seed: of the draws.
        images: whether any setting looks at the images.
    """
    cpu, wall = time.process_time(), time.perf_counter()
    maps = [heights_or_refusal(each.images, model.calibration) for each in observations] if images else []
    taken = time.process_time() - cpu, time.perf_counter() - wall
    heights = tuple(heights for heights, _ in maps)
    refused_pictures = {contact: refusal for contact, (_, refusal) in enumerate(maps) if refusal}
    return Readings(tuple(observations), heights, model, prior, seed, taken, refused_pictures)


def loaded(timed: Callable[[], T]) -> T:
    """What times itself, once more where a kernel was compiled or loaded meanwhile: nothing counts that."""
    with install_recorder("numba:compiler_lock") as loads:
        found = timed()
    return timed() if loads.buffer else found


def prepare(model: Model, setting: Setting) -> None:
    """Make what depends on the object alone, before any reading is needed: its samples and gains."""
    spacing = accuracy_at(setting).of(SPACING)
    _ = model.surface(spacing).tree
    if model.modes is not None and needs_sound(setting):
        model.gains(spacing)


def solve(readings: Readings, setting: Setting) -> Solved:
    """Answer at one setting, timed; call ``prepare`` before."""
    accuracy = accuracy_at(setting)
    cpu, wall = time.process_time(), time.perf_counter()
    estimate, refusal = None, None
    try:
        estimate = located(readings, accuracy)[-1]
    except FitRefused as error:
        refusal = str(error)
    taken = time.process_time() - cpu, time.perf_counter() - wall
    return Solved(estimate, None if estimate is None else estimate.credible90, *taken, refusal)


def located(
    readings: Readings, accuracy: Accuracy, first: int | None = None, judged: bool = True
) -> tuple[Estimate, ...]:
    """The estimates after each contact from the ``first`` on; after the last alone where None.

    Where the last one's residuals are larger than the bench's stated errors allow, it is estimated again
    under errors so much larger, and says so. What fits no place at other levels than the default's is
    estimated again at these: a refusal may not hang on how finely one looked.

    Args:
        readings: of the run.
        accuracy: of the estimates.
        first: contacts of the first estimate.
        judged: whether readings that fit no place are refused, or estimated all the same.

    Raises:
        FitRefused: no place on this object explains the readings, no image shows a contact, or no picture
            of them may be used.
    """
    errors, began = readings.model.errors, time.perf_counter()
    try:
        found = _located_at(errors, readings, accuracy, first, judged)
    except FitRefused:
        usual = accuracy.with_({knob.name: knob.default for knob in _LOOKED_BY})
        if usual.levels == accuracy.levels:
            raise
        lost = time.perf_counter() - began
        found = located(readings, usual, first, judged)
        last = found[-1]
        # What the refused attempt took counts with the last one's judging.
        seconds = {**last.seconds, "judge": last.seconds.get("judge", 0.0) + lost}
        doubt = "at the levels asked for no place explained the readings; at the default levels this one does"
        return (*found[:-1], replace(last, seconds=seconds, doubts=(*last.doubts, doubt)))
    factor = found[-1].times_stated if judged and accuracy.of(METHOD) == "grid" else 1.0
    if factor == 1.0:
        return found
    less_sure = replace(readings, prior=readings.prior.times(factor))
    wider = _located_at(errors.times(factor), less_sure, accuracy)[-1]
    # The seconds are those of both answers but for the images.
    before = {stage: took for stage, took in found[-1].seconds.items() if stage != "images"}
    seconds = {stage: took + before.get(stage, 0.0) for stage, took in wider.seconds.items()}
    doubt = (
        f"the readings are {factor:.1f} times further off than the station's [errors] allow, by the fit's "
        "own residuals: the region is that of errors so large; check the bench, or state them"
    )
    return (*found[:-1], replace(wider, seconds=seconds, doubts=(*wider.doubts, doubt)))


def _located_at(
    errors: BenchErrors,
    readings: Readings,
    accuracy: Accuracy,
    first: int | None = None,
    judged: bool = True,
) -> tuple[Estimate, ...]:
    noise, images = noise_at(errors), needs_images(accuracy)
    if images and not readings.pictured:
        raise FitRefused(f"no contact's picture may be used; of contact 1: {readings.refused_pictures[0]}")
    pitch, block = readings.model.sensor.pitch, accuracy.of(BLOCK)
    contacts = [Contact(observation.base_from_gel) for observation in readings.observations]
    for index, heights in enumerate(readings.heights if images else ()):
        if index not in readings.refused_pictures:
            pose = contacts[index].base_from_gel
            contacts[index] = contact_of(pose, heights, pitch, block, noise.touch)
    strikes = [observation.strike for observation in readings.observations] if readings.heard else []
    seconds = readings.shared[1] if images else 0.0
    model, prior, seed = readings.model, readings.prior, readings.seed
    return locate(contacts, model, prior, accuracy, noise, seed, first, seconds, strikes, judged)


@dataclass(frozen=True, eq=False)
class Answer:
    """What the recording says of its last contact."""

    observations: tuple[Observation, ...]  #: the contacts as recorded.
    heights: tuple[FloatArray, ...]
    """``(rows, columns)`` metres of indentation of each contact, from its images."""
    model: Model  #: the object and the sensor.
    prior: Prior  #: what was believed of the object's orientation.
    last: Estimate  #: the answer.
    seconds: float
    """of the answer, from images to region; the surface's samples are made once before, and kernels are
    loaded."""
    sense: Senses = "touch"  #: what ``last`` is by.
    others: Mapping[Senses, Estimate | FitRefused] = field(default_factory=dict)
    """the answer by each other sense, or why that sense refused the object."""
    refused_pictures: Mapping[int, str] = field(default_factory=dict)
    """why a contact's picture is left out, by its number from 0; its height map is zero."""

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
