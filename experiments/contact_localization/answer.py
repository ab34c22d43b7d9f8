"""From a run's readings to its answer, at any accuracy; neither the bench nor the truth is needed."""

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np

from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import (
    BLOCK,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
    Estimate,
    Senses,
    locate,
)
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.posterior.policy import Readings, estimate_contacts, read
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import SIMULATED, accuracy_at, needs_sound
from experiments.contact_localization.touch.touch import contact_of
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, FitRefused, MeshRefused, WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.bench.acquisition import Strike
from harness.effects.accuracy import Accuracy, Level, Setting
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.experiment import Scored
from harness.experiment.solving import Solved
from harness.recording.observation import Observation, in_time
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.sim.modal.modes import Modes

PROGRAM = "contact-localization"


ESTIMATOR = "experiments.contact_localization.posterior.estimate"
"""The module whose sources, with all they import, decide whether a curve still holds."""


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


def prepare(model: Model, setting: Setting) -> None:
    """Make what depends on the object alone, its samples and gains, and load the kernels of an estimate."""
    spacing = accuracy_at(setting).of(SPACING)
    _ = model.surface(spacing).tree
    if model.modes is not None and needs_sound(setting):
        model.gains(spacing)
    load_kernels(model, setting)


_KERNELS: set[tuple[Level, ...]] = set()
"""Methods, senses and object models whose kernels this process has loaded."""


def load_kernels(model: Model, setting: Setting) -> None:
    """Compile or load the kernels of an estimate, so that the seconds of no answer count it.

    A synthetic run of two presses, and of two strikes if the object has modes, is estimated once.

    Args:
        model: the object and the sensor.
        setting: method, senses and spacing of the estimates.
    """
    small = {ROUNDS.name: 1, SAMPLES.name: SAMPLES.levels[0], PARTICLES.name: PARTICLES.levels[0]}
    accuracy = accuracy_at({**setting, **small})
    kind = accuracy.of(METHOD), accuracy.of(SENSES), model.seen is None, model.modes is None
    if kind in _KERNELS or (accuracy.of(SENSES) != "touch" and model.modes is None):
        return
    _KERNELS.add(kind)
    sensor, noise, surface = model.sensor, noise_at(model.errors), model.surface(accuracy.of(SPACING))
    top = int(np.argmax(surface.points[:, 2]))
    chosen = [top, int(surface.neighbours[top, -1])]
    rows, columns = np.indices((sensor.rows, sensor.columns))
    far = np.hypot(rows - 0.5 * sensor.rows, columns - 0.5 * sensor.columns) / sensor.rows
    bump = 1.0e-3 * np.maximum(0.0, 1.0 - (4.0 * far) ** 2)
    poses = [transform(frame_facing(-surface.normals[k], 0.0), surface.points[k]) for k in chosen]
    contacts = [contact_of(pose, bump, sensor.pitch, accuracy.of(BLOCK), noise.touch) for pose in poses]
    strikes = () if model.modes is None else synthetic_strikes(model.modes, surface.points[chosen])
    for judged in (False, True):
        with suppress(DataRefused):
            locate(contacts, model, Prior(np.eye(3)), accuracy, noise, strikes=strikes, judged=judged)


def synthetic_strikes(modes: Modes, points: FloatArray) -> tuple[Strike, ...]:
    """Let the first modes of an object ring after a blow at each of ``(k, 3)`` points in m."""
    rate, onset, count = 50_000.0, 1000, 16
    times = np.arange(round(0.4 * rate)) / rate
    force = np.zeros(len(times))
    force[onset : onset + 10] = 20.0 * np.sin(np.pi * np.arange(10) / 10)
    ringing = np.exp(-25.0 * times) * np.sin(2.0 * np.pi * modes.frequencies[:count, None] * times)
    gains = modes.gains(points, np.tile([0.0, 0.0, -1.0], (len(points), 1)))[:, :count]
    noise = np.random.default_rng(0).normal(0.0, 1.0e-6, len(times))
    pressures = [noise + np.roll(gain @ ringing, onset) for gain in gains]
    return tuple(
        Strike(rate, force, pressure, onset, 0.0, overload=False, double_hit=False, silent=False)
        for pressure in pressures
    )


def solve(readings: Readings, setting: Setting) -> Solved[Estimate]:
    """Answer at one setting, timed; call ``prepare`` before."""
    accuracy = accuracy_at(setting)
    cpu, wall = time.process_time(), time.perf_counter()
    estimate, refusal = None, None
    try:
        estimate = estimate_contacts(readings, accuracy)[-1]
    except FitRefused as error:
        refusal = str(error)
    taken = time.process_time() - cpu, time.perf_counter() - wall
    return Solved(estimate, None if estimate is None else estimate.credible90, *taken, refusal)


@dataclass(frozen=True, eq=False)
class Answer:
    """What the recording says of its last contact."""

    readings: Readings  #: the readings that it is made from.
    last: Estimate  #: the answer.
    seconds: float
    """of the answer, from images to region; the surface's samples are made once before, and kernels are
    loaded."""
    sense: Senses = "touch"  #: what ``last`` is by.
    others: Mapping[Senses, Estimate | FitRefused] = field(default_factory=dict)
    """the answer by each other sense, or why that sense refused the object."""

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
        _ = run.gel_reader
        self._accuracy, self._run = accuracy, run
        self._seen: list[Observation] = []
        self._readings: Readings | None = None
        if self.model.sound_refusal and accuracy.of(SENSES) == "audio":
            raise MeshRefused(f"an estimate by sound alone was asked for, and {self._sound_refusal}")
        for sense in SENSES.levels:
            prepare(self.model, {**accuracy, SENSES.name: sense})
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
        if self._readings is None:
            seen, seed = in_time(self._seen), self._run.recording.header.seed
            self._readings = read(seen, self._run.gel_reader, self.model, self.prior, seed)
        return self._readings

    def read(self, record: StepRecord) -> None:
        """Take in a contact; its picture is inverted while the arm rests."""
        self._seen.append(self._run.observe(record))
        self._run.gel_reader.read(self._seen[-1].images)
        self._readings = None

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
        last = self._located(sense, readings)[-1]
        others = {other: self._tried(other, readings) for other in senses if other != sense}
        seconds = sum(last.seconds.values())
        return Answer(readings, last, seconds, sense, others)

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
            return self._located(sense, readings)[-1]
        except FitRefused as refusal:
            return refusal

    def _located(
        self, sense: Senses, readings: Readings, first: int | None = None, judged: bool = True
    ) -> tuple[Estimate, ...]:
        return estimate_contacts(readings, self._accuracy.with_({SENSES.name: sense}), first, judged)


def prior_of(run: RunFiles) -> Prior:
    """The orientation the scene states, or only that it stands upright; never the position."""
    rotation = run.scene.base_from_object(run.mesh)[:3, :3]
    return Prior(rotation, run.scene.section(Localization).yaw, run.station.errors.yaw)


def observe(run: RunFiles) -> tuple[Observation, ...]:
    """The contacts of a run, from its images, arm poses and strikes."""
    return in_time([run.observe(record) for record in run.recording.steps()])


ScoredContact: TypeAlias = Scored[ContactAnswering, Answer]
"""An answer with what it is compared with."""
