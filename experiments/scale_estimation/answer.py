"""From a run's readings to the size of its object, by each sense and by all."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import Belief, fused
from experiments.scale_estimation.sound.hearing import Hearing, by_sound
from experiments.scale_estimation.sound.peaks import Peaks, load_kernels
from experiments.scale_estimation.touch.fit import Patch, free_line, patch_of
from experiments.scale_estimation.touch.touch import Touch, by_touch
from experiments.scale_estimation.unseen.answer import (
    ShapelessAnswer,
    outline_alone,
    strikes_alone,
    together_without_shape,
    ways_alone,
)
from experiments.scale_estimation.unseen.contact_set import GelWay
from experiments.scale_estimation.unseen.network import shipped
from experiments.scale_estimation.vision.vision import SeenStand, Sight, by_sight, stands_seen
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, FitRefused, MeshRefused, PictureRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.bench.acquisition import Strike
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.experiment.experiment import Scored
from harness.experiment.object_modes import carried_by
from harness.picture.outline import SeenOutline, read_outline
from harness.recording.observation import Observation, picture_left_out
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.sim.optics.inverse import GelReader
from harness.skills.exploring.exploration import SKIPPED
from harness.strikes.peaks import analyse
from harness.strikes.spectra import Analysis

STARTS = Knob(
    "scale.starts",
    (1, 4, 12, 40),
    "",
    "number",
    12,
    "best places of the contacts' first scan that are refined",
)
"""Matters where the shape is known; an answer about an unknown shape has no dial of its own."""

KNOBS: tuple[Knob[Level], ...] = (STARTS, *knobs_of(EFFECTS))


SENSES = ("vision", "audio", "touch")

OUTSIDE = 0.5
"""Probability beyond which a size is said to lie outside the range that was asked about."""


Said = Sight | Hearing | Touch | ShapelessAnswer


@dataclass(frozen=True, eq=False)
class SizeAnswer:
    """What a run says of a size."""

    by_sense: Mapping[str, Said | FitRefused]  #: the answer of each sense that was asked, or why it has none.
    fused: Belief  #: all that answered, together; what is known without any where none did.
    seconds: Mapping[str, float]  #: s of each sense's estimate, from readings to belief.
    contacts: int  #: that touched something.
    strikes: int  #: that may be used.

    @property
    def sight(self) -> Sight | None:
        """The answer by sight."""
        found = self.by_sense.get("vision")
        return found if isinstance(found, Sight) else None

    @property
    def touch(self) -> Touch | None:
        """The answer by touch."""
        found = self.by_sense.get("touch")
        return found if isinstance(found, Touch) else None

    @property
    def hearing(self) -> Hearing | None:
        """The answer by sound."""
        found = self.by_sense.get("audio")
        return found if isinstance(found, Hearing) else None


@dataclass(eq=False)
class ScaleAnswering:
    """Readings to answer: each step's pictures, contact and strike are read once."""

    run: RunFiles
    accuracy: Accuracy
    model: ObjectModel = field(init=False)

    def __post_init__(self) -> None:
        run = self.run
        self.model = ObjectModel(run.mesh, run.scene, run.station, carried_by(run))
        self.outline: SeenOutline | FitRefused | None = None
        self.patches: list[Patch] = []
        self.free: list[FloatArray] = []
        self.met: list[bool] = []
        self.ways: list[GelWay] = []
        self.left_out: list[str] = []
        self.refused_pictures: list[str] = []
        self.strikes: list[Strike] = []
        self._read = dict.fromkeys(SENSES, 0.0)
        self._peaks: tuple[int, Peaks | None] = (0, None)

    def load(self) -> None:
        """Make what depends on the object alone and load the kernels, while the arm moves."""
        sensors = self.run.scene.sensors
        _ = self.run.gel_reader
        if not self.shape_known:
            for sense, asked in (("sound", sensors.sound), ("touch", sensors.touch)):
                if asked:
                    shipped(sense)
            return
        if sensors.touch:
            _ = self.model.stand.tree, self.model.stand.places
        if sensors.camera:
            with suppress(WrongUse):  # a station without a camera: said by the answer
                _ = self.model.view.corners
        if sensors.sound:
            load_kernels()
            with suppress(MeshRefused):  # said by the answer: sight and touch need no elements
                self.model.ringing(self.accuracy)

    @property
    def shape_known(self) -> bool:
        """Whether the scene's mesh is the object's."""
        return self.run.scene.section(Scale).shape == "known"

    def read(self, record: StepRecord) -> None:
        """Take in a step's readings."""
        began = time.perf_counter()
        if record.step.kind == SKIPPED:
            self.left_out.append(str(record.step.parameters["why"]))
            return
        try:
            silhouette = self.run.silhouette(record)
            outline = None if silhouette is None else read_outline(silhouette)
        except DataRefused as refusal:
            self.outline = FitRefused(str(refusal))
            return
        if outline is not None:
            self.outline = outline
            self._count("vision", began)
        if "gel.image" in record.readings:
            self._read_contact(record)

    def _read_contact(self, record: StepRecord) -> None:
        run, began = self.run, time.perf_counter()
        seen = run.observe(record)
        if seen.strike is not None:
            self.strikes.append(seen.strike)
            self._count("audio", began)
        began = time.perf_counter() - run.gel_reader.read(seen.images).seconds[1]
        try:
            patch = patch_of_contact(seen, run.gel_reader, run.station.gel.sensor.pitch)
        except PictureRefused as refusal:  # whether the gel met anything is not known either
            self.refused_pictures.append(picture_left_out(record.step.index, refusal))
            return
        if patch is not None:
            self.patches.append(patch)
        length = float(record.step.parameters["search_m"])
        self.met.append(patch is not None)
        self.ways.append(GelWay.made(seen.base_from_gel, self.model.place, patch))
        self.free.append(free_line(seen.base_from_gel, length, patch is not None))
        self._count("touch", began)

    def _count(self, sense: str, began: float) -> None:
        self._read[sense] += time.perf_counter() - began

    def answer(self) -> SizeAnswer:
        """By each sense that the scene asks for, and by all that answer.

        Raises:
            WrongUse: no step was read.
        """
        return self.answered(self.shape_known)

    def answered(self, shape_known: bool) -> SizeAnswer:
        """The same with the shape, or without it whatever the scene says.

        Raises:
            WrongUse: the scene asks for no sense.
        """
        model = self.model
        known: dict[str, Callable[[], Said]] = {
            "vision": lambda: by_sight(model.view, self._seen(), model.nominal, model.sizes),
            "audio": self._by_sound,
            "touch": self._by_touch,
        }
        estimators = known if shape_known else self.without_shape()
        sensors = self.run.scene.sensors
        wanted = {"vision": sensors.camera, "audio": sensors.sound, "touch": sensors.touch}
        found: dict[str, Said | FitRefused] = {}
        seconds = {}
        for sense in SENSES:
            if wanted[sense]:
                began = time.perf_counter()
                found[sense] = self._tried(estimators[sense])
                seconds[sense] = self._read[sense] + time.perf_counter() - began
        if not found:
            raise WrongUse("the scene asks for no sense; set sensors.camera, sensors.sound or sensors.touch")
        beliefs = {sense: one.belief for sense, one in found.items() if not isinstance(one, FitRefused)}
        if not beliefs:
            together = Belief.ignorant(model.sizes)
        else:
            together = fused(list(beliefs.values())) if shape_known else together_without_shape(beliefs)
        usable = sum(not strike.fault for strike in self.strikes)
        return SizeAnswer(found, together, seconds, len(self.patches), usable)

    def peaks(self) -> Peaks | None:
        """The resonances of all strikes so far; None where none was made, or none may be used."""
        if self._peaks[0] != len(self.strikes):
            self._peaks = len(self.strikes), peaks_of(self.strikes)
        return self._peaks[1]

    def stands_seen(self) -> tuple[SeenStand, ...]:
        """How the object may stand by the look; none where it was not seen."""
        seen = self.outline
        return stands_seen(self.model.view, seen) if isinstance(seen, SeenOutline) else ()

    @staticmethod
    def _tried(way: Callable[[], Said]) -> Said | FitRefused:
        try:
            return way()
        except FitRefused as refusal:
            return refusal
        except MeshRefused as refusal:
            return FitRefused(str(refusal))

    def without_shape(self) -> dict[str, Callable[[], Said]]:
        """How each sense answers of an object whose shape nobody knows.

        Nothing of the scene's mesh is used but its range of sizes, and of its material what the scene states.
        """
        model = self.model
        material = MATERIALS[model.scene.object.material]
        return {
            "vision": lambda: outline_alone(self._seen(), model.station.camera, model.place, model.sizes),
            "audio": lambda: strikes_alone(
                () if self.peaks() is None else self.strikes, material, model.sizes
            ),
            "touch": self._by_ways,
        }

    def _seen(self) -> SeenOutline:
        if isinstance(self.outline, FitRefused):
            raise self.outline
        if self.outline is None:
            raise FitRefused("the camera has not looked yet")
        return self.outline

    def _by_sound(self) -> Hearing:
        peaks = self.peaks()
        if peaks is None:
            raise FitRefused(
                "nothing was heard: no strike was made, or none rang; strike a place of the object"
            )
        model = self.model
        return by_sound(peaks, model.materials(self.accuracy), model.nominal, model.sizes)

    def _by_touch(self) -> Touch:
        if not self.patches:
            raise self._no_picture(self.met) or FitRefused("the gel touched nothing yet")
        model, starts = self.model, int(self.accuracy[STARTS.name])
        return by_touch(model.stand, self.patches, model.nominal, model.sizes, starts, self.free)

    def _by_ways(self) -> ShapelessAnswer:
        refusal = self._no_picture(self.ways)
        if refusal is not None:
            raise refusal
        return ways_alone(self.ways, self.model.sizes, self.model.same_place)

    def _no_picture(self, read: Sequence[object]) -> FitRefused | None:
        """Why touch has no answer where pictures were taken and none of them was read."""
        if read or not self.refused_pictures:
            return None
        return FitRefused(f"no contact's picture may be used; {self.refused_pictures[0]}")


def patch_of_contact(seen: Observation, reader: GelReader, pitch: float) -> Patch | None:
    """Return where a contact met the object; None if the gel touched nothing.

    Args:
        seen: the contact.
        reader: reader of the gel's pictures.
        pitch: m of gel that a pixel shows.

    Raises:
        PictureRefused: its picture is not what the calibration was made of.
    """
    reading = reader.read(seen.images)
    reading.require_accepted()
    return patch_of(reading.height, pitch, seen.base_from_gel)


def peaks_of(strikes: Sequence[Strike]) -> Peaks | None:
    """The resonances of all strikes together; None where none was made, or none may be used.

    Peaks that are two modes at once count too: only where they lie is asked, not which place was struck.
    """
    usable = [strike for strike in strikes if not strike.fault]
    if not usable:
        return None
    settings = Analysis()
    # One strike alone stands for two: nothing is compared between places.
    found = analyse(usable if len(usable) > 1 else usable * 2, settings)
    peaks = sorted((*found.peaks, *found.rejected), key=lambda peak: peak.frequency)
    if not peaks:
        return None
    frequencies = np.array([peak.frequency for peak in peaks])
    levels = found.loudest + np.array([peak.level for peak in peaks])
    decays = np.array([peak.damping for peak in peaks])
    return Peaks(frequencies, levels, found.band, settings.decay, decays)


ScoredSize: TypeAlias = Scored[ScaleAnswering, SizeAnswer]
"""An answer with what it is compared with."""
