"""Where the next contact of a scale estimation goes: where it tells most of the size, on a free way.

The arm travels around all the space that the object may take, and enters it on straight lines only, slowly,
stopping at a touch. Lines are chosen on the object as it is believed to stand; where nothing is known yet, or
its shape never is, they lead to where it should be.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.believed import believed
from experiments.scale_estimation.blind_aims import aims_unmet, is_flat
from experiments.scale_estimation.dials import KNOBS
from experiments.scale_estimation.envelope import blind_envelope, seen_envelope
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.on_object import contact_on_object
from experiments.scale_estimation.readings import patch_of_contact
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.strike_met import strike_met
from experiments.scale_estimation.touch.patch import Patch
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MotionRefused, PictureRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.reading import Reading
from harness.experiment.levels import chosen_levels
from harness.picture.outline import SeenOutline
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import observe_step
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step, StepRecord
from harness.skills.exploring.exploration import SKIPPED
from harness.skills.exploring.lines import LineTarget, contact_along, lines_to, unlike_first
from harness.skills.exploring.surroundings import Surroundings, end_of
from harness.skills.exploring.unknown_space import (
    SeenThing,
    aims_of_seen,
    aims_unseen,
    seen_thing,
    unknown_space,
)
from harness.skills.planning import HOME
from harness.skills.strike import POSE, READY, StrikeMotion
from harness.twin.bench import TwinBench
from harness.twin.bench_of import way_between

LARGEST = 0.999
"""Probability that an object of unknown shape is no larger than travels allow for, by its outline."""

_LOW = 0.8
"""Of the height of the smallest object, up to which lines into the unknown end."""


class Explorer:
    """Plans a run's contacts one at a time.

    Args:
        run: the folder.
    """

    def __init__(self, run: RunFiles) -> None:
        self._run = run
        self._asked = run.scene.section(Scale)
        self._drawn = self._asked.shape == "known"
        self._answering = ScaleAnswering(run, chosen_levels(KNOBS, (), run.network_levels))
        self._model: ObjectModel = self._answering.model
        self._read = 0
        self._joints: FloatArray = HOME
        self._struck = 0
        self._contacts = 0
        self._followed: list[FloatArray] = []
        self._skipped = 0
        self._travels: TwinBench | None = None
        self._nothing: TwinBench | None = None
        self._seen: tuple[SeenStand, ...] = ()
        self._thing: SeenThing | None = None

    def way(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """A way around all that the object may take, from where the arm is to the end of a travel."""
        assert self._travels is not None
        return way_between(self._travels, here, planned)

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Whether the steps before one tell the size as well as the scene asks."""
        until = self._asked.until
        if until is None or index == 0:
            return False
        self._take_in(recording, index)
        low, high = self._answering.answer().fused.interval
        return bool(0.5 * (high - low) <= until)

    def skipped(self, recording: Recording, index: int) -> int:
        """How many steps right before one were not made."""
        self._take_in(recording, index)
        return self._skipped

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """The parameters of a contact.

        Args:
            recording: that holds all steps before it.
            index: of its step.

        Raises:
            WrongUse: no free way was found to any place; nothing was moved.
        """
        self._take_in(recording, index)
        here = self._surroundings()
        random = np.random.default_rng((recording.header.seed, index))
        stand = believed(self._answering, self._seen) if self._drawn else None
        if stand is not None:
            strikes = bool(self._seen) and self._strikes_left() > 0
            with suppress(WrongUse, MotionRefused):
                return contact_on_object(here, self._model, self._answering.patches, stand, random, strikes)
        aims, support = self._aims(random), float(self._model.place[2])
        press = float(np.mean(self._asked.depth))
        lines = unlike_first(lines_to(aims, here, support, random), self._followed)
        return contact_along(here, lines, press)

    def strike(self, step: Step, read: Sequence[Reading]) -> StrikeMotion | None:
        """A strike where a contact has just met the object; None where none is left, or none is free.

        Where the object was seen, and its shape is known, strikes are planned on that, with their contacts.
        """
        patch, rotation = self._met(step, read)
        if self._seen or patch is None or self._strikes_left() == 0:
            return None
        here = self._surroundings(end_of(step.parameters))
        return strike_met(here, self._model, patch, rotation)

    def _met(self, step: Step, read: Sequence[Reading]) -> tuple[Patch | None, FloatArray]:
        """What a contact touched, and ``(3, 3)`` the gel's turn in base."""
        run = self._run
        record = StepRecord(step, {reading.channel.name: reading for reading in read}, 0.0)
        aspect = aspect_stated(run.calibration.header.made_from)
        seen = observe_step(record, run.station.flange_from_gel, aspect=aspect)
        patch = None
        with suppress(PictureRefused):  # the answer names it
            patch = patch_of_contact(seen, run.calibration, run.station.gel.sensor.pitch)
        return patch, seen.base_from_gel[:3, :3]

    def _take_in(self, recording: Recording, index: int) -> None:
        for k in range(self._read, index):
            self._take_in_step(recording.step(k))
        self._read = index
        outline = self._answering.outline
        if not isinstance(outline, SeenOutline):
            return
        if self._drawn and not self._seen:
            self._seen = self._answering.stands_seen()
        elif not self._drawn and self._thing is None:
            self._thing = seen_thing(self._model.unknown_stand, outline)

    def _take_in_step(self, record: StepRecord) -> None:
        self._answering.read(record)
        self._skipped = self._skipped + 1 if record.step.kind == SKIPPED else 0
        if record.step.kind != "press":
            return
        self._contacts += 1
        base_from_stand_off = np.asarray(record.step.parameters["base_from_stand_off"])
        self._followed.append(base_from_stand_off @ self._run.station.flange_from_gel)
        self._struck += POSE in record.readings and not self._answering.strikes[-1].fault
        if READY in record.readings:
            self._joints = np.asarray(record.readings[READY].values[-1])
        else:
            parameters = record.step.parameters
            self._joints = end_of(parameters["strike"] if POSE in record.readings else parameters)

    def _surroundings(self, joints: FloatArray | None = None) -> Surroundings:
        if self._travels is None or self._nothing is None:
            model = self._model
            self._travels = model.twin_around(self._space())
            self._nothing = model.twin_around(model.nowhere, has_object=False)
        at = self._joints if joints is None else joints
        return Surroundings(self._run.scene, self._run.station, self._travels, self._nothing, at)

    def _space(self) -> Mesh:
        model, outline = self._model, self._answering.outline
        if not self._drawn:
            seen = outline if isinstance(outline, SeenOutline) else None
            return unknown_space(model.unknown_stand, seen, self._largest())
        return seen_envelope(model, self._seen) if self._seen else blind_envelope(model)

    def _largest(self) -> float:
        """M, of an object of unknown shape: as its outline has it, within the range that was asked about."""
        high = self._model.sizes.high
        try:
            belief = self._answering.without_shape()["vision"]().belief
        except FitRefused:
            return high
        return min(high, belief.below(LARGEST))

    def _aims(self, random: np.random.Generator) -> Iterable[LineTarget]:
        model = self._model
        if self._thing is not None:
            return aims_of_seen(self._thing, float(model.place[2]), self._contacts, random)
        if self._drawn and not self._seen and is_flat(model):
            return aims_unmet(model, self._answering.patches, self._answering.free, random)
        middle = model.place
        if self._seen:
            middle = middle + np.array([*self._seen[0].unknowns[1:3], 0.0])
        height = model.sizes.low
        if self._drawn:
            height = _LOW * float(model.corners[:, 2].max()) * model.sizes.low / model.nominal
        return aims_unseen(middle, model.place_error, height, self._contacts == 0, random)

    def _strikes_left(self) -> int:
        return self._asked.strikes - self._struck if self._run.scene.sensors.sound else 0
