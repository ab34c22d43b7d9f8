"""One recorded run, answered at any setting of the dials, with the seconds each answer takes."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from numba.core.event import install_recorder

from experiments.contact_localization.accuracy.dials import SIMULATED, accuracy_at, needs_images, needs_sound
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.dials import BLOCK, METHOD, ROUNDS, SAMPLES, SPACING
from experiments.contact_localization.posterior.estimate import Estimate, locate
from experiments.contact_localization.posterior.noise import noise_at
from experiments.contact_localization.touch.touch import Contact, contact_of
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.bench.bench_errors import BenchErrors
from harness.effects.accuracy import Accuracy, Level, Setting
from harness.effects.touch_file_effects import SHAPES as TOUCH
from harness.experiment.solving import Solved
from harness.recording.observation import Observation
from harness.sim.optics.inverse import heights_or_refusal

T = TypeVar("T")


PROGRAM = "contact-localization"


ESTIMATOR = "experiments.contact_localization.posterior.estimate"
"""The module whose sources, with all they import, decide whether a curve still holds."""


_LOOKED_BY = (SPACING, ROUNDS, SAMPLES, BLOCK)
"""How finely readings are looked at; which senses are asked, and how they are simulated, is another thing."""


@dataclass(frozen=True, eq=False)
class Readings:
    """A run's readings, brought as far as settings share: the height maps of its images.

    Attributes:
        observations: of the contacts.
        heights: a height map for each; none where no setting looks at images.
        model: the object and the sensor.
        prior: of its orientation.
        seed: of the draws.
        shared: s of CPU time and on the clock that the height maps took.
        refused_pictures: why a contact's picture is not used, by its number from 0; its height map is zero.
    """

    observations: tuple[Observation, ...]
    heights: tuple[FloatArray, ...]
    model: Model
    prior: Prior
    seed: int
    shared: tuple[float, float]
    refused_pictures: Mapping[int, str] = field(default_factory=dict)

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
    """The models of one object, one for each choice of the simulation's dials; each is made on first use.

    Attributes:
        make: of the accuracy that chooses the simulation.
        start: levels of the simulation that a setting turns from: those of the object's ObjectFile.
    """

    make: Callable[[Accuracy], Model]
    start: Setting = field(default_factory=dict)
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
        return _looked_again(located(readings, usual, first, judged), lost)
    factor = found[-1].times_stated if judged and accuracy.of(METHOD) == "grid" else 1.0
    if factor == 1.0:
        return found
    less_sure = replace(readings, prior=readings.prior.times(factor))
    wider = _located_at(errors.times(factor), less_sure, accuracy)[-1]
    return (*found[:-1], _widened(found[-1], wider, factor))


def _looked_again(found: tuple[Estimate, ...], lost: float) -> tuple[Estimate, ...]:
    """Estimates at the default levels, the s that the others took counted with the last one's judging."""
    last = found[-1]
    seconds = {**last.seconds, "judge": last.seconds.get("judge", 0.0) + lost}
    doubt = "at the levels asked for no place explained the readings; at the default levels this one does"
    return (*found[:-1], replace(last, seconds=seconds, doubts=(*last.doubts, doubt)))


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


def _widened(stated: Estimate, wider: Estimate, factor: float) -> Estimate:
    """The answer under errors larger than stated; its seconds are those of both but for the images."""
    before = {stage: took for stage, took in stated.seconds.items() if stage != "images"}
    seconds = {stage: took + before.get(stage, 0.0) for stage, took in wider.seconds.items()}
    doubt = (
        f"the readings are {factor:.1f} times further off than the station's [errors] allow, by the fit's "
        "own residuals: the region is that of errors so large; check the bench, or state them"
    )
    return replace(wider, seconds=seconds, doubts=(*wider.doubts, doubt))
