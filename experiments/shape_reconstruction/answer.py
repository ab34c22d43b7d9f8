"""From a run's readings to the shape of its object: by the picture, by touch, and by both."""

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.contact_points import contact_points
from experiments.shape_reconstruction.evidence import GuardedTouch, SeenMask, ShapeEvidence
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import METHOD, estimated, load_kernels
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import FitRefused, PictureRefused, WrongUse
from harness.basics.geometry import apply, translation
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Scored
from harness.recording.observation import picture_left_out
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.skills.exploring.exploration import SKIPPED, SPEEDS
from harness.skills.press import ContactMotion

HOUSING_DEPTH = 0.12
"""M behind the face of the sensor's housing that are the sensor's."""


@dataclass(eq=False)
class ShapeReadings:
    """The readings of a run's steps so far; each step is read once."""

    run: RunFiles
    touches: list[GuardedTouch] = field(default_factory=list, init=False)
    look: SeenMask | None = field(default=None, init=False)
    refused_pictures: list[str] = field(default_factory=list, init=False)

    def read(self, record: StepRecord) -> None:
        """Take in a step: a look, a press, or one that was not made."""
        silhouette = self.run.silhouette(record)
        if silhouette is not None:
            self.look = _observe_silhouette(self.run, silhouette)
        elif "gel.image" in record.readings:
            try:
                self.touches.append(_guarded_touch(self.run, record))
            except PictureRefused as refusal:  # whether the gel met anything is not known either
                self.refused_pictures.append(picture_left_out(record.step.index, refusal))

    def evidence(self) -> ShapeEvidence:
        """All of it."""
        settings, sensor = self.run.scene.section(ShapeRun), self.run.station.gel.sensor
        return ShapeEvidence(
            touches=tuple(self.touches),
            look=self.look,
            housing=sensor.housing,
            gel_thickness=sensor.gel_thickness,
            housing_depth=HOUSING_DEPTH,
            place_error=settings.place_error,
            support_error=settings.support_error,
            largest=settings.largest,
            errors=self.run.station.errors,
        )


SENSES = ("vision", "touch", "fused")


@dataclass(frozen=True, eq=False)
class ShapeAnswer:
    """What a run says of a shape."""

    evidence: ShapeEvidence  #: all readings.
    fused: ShapeEstimate  #: the surface from all readings.
    by_sense: Mapping[str, ShapeEstimate | FitRefused]
    """the surface from each sense that the scene asks for, and the fused one; or why there is none."""
    seconds: Mapping[str, float]  #: s of each, the reading of its steps included.


@dataclass(eq=False)
class ShapeAnswering:
    """Readings to answer: each step's pictures are read once."""

    run: RunFiles
    accuracy: Accuracy
    readings: ShapeReadings = field(init=False)
    left_out: list[str] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.readings = ShapeReadings(self.run)
        _ = self.run.gel_reader
        load_kernels(str(self.accuracy[METHOD.name]))
        self._read = {"vision": 0.0, "touch": 0.0}

    def read(self, record: StepRecord) -> None:
        """Take in a step's readings."""
        if record.step.kind == SKIPPED:
            self.left_out.append(str(record.step.parameters["why"]))
            return
        inverted = 0.0
        if "gel.image" in record.readings:
            inverted = self.run.gel_reader.read(self.run.observe(record).images).seconds[1]
        began = time.perf_counter() - inverted
        self.readings.read(record)
        self._read["vision" if record.step.kind == "look" else "touch"] += time.perf_counter() - began

    def answer(self) -> ShapeAnswer:
        """By each sense that the scene asks for, and by all.

        Raises:
            WrongUse: the scene asks for no sense.
            FitRefused: all readings together say too little.
        """
        evidence = self.readings.evidence()
        # Readings of each sense that the scene uses.
        sensors, given = self.run.scene.sensors, {}
        if sensors.camera:
            given["vision"] = replace(evidence, touches=())
        if sensors.touch:
            given["touch"] = replace(evidence, look=None)
        if not given:
            raise WrongUse("the scene asks for no sense; set sensors.camera or sensors.touch")
        found: dict[str, ShapeEstimate | FitRefused] = {}
        seconds: dict[str, float] = {}
        for sense, one in given.items():
            found[sense], took = self._tried(one)
            seconds[sense] = self._read[sense] + took
        if len(given) == 1:
            (only,) = given
            found["fused"], seconds["fused"] = found[only], seconds[only]
        else:
            found["fused"], took = self._tried(evidence)
            seconds["fused"] = sum(self._read.values()) + took
        fused = found["fused"]
        if isinstance(fused, FitRefused):
            raise fused
        return ShapeAnswer(evidence, fused, found, seconds)

    def _tried(self, evidence: ShapeEvidence) -> tuple[ShapeEstimate | FitRefused, float]:
        began = time.perf_counter()
        found: ShapeEstimate | FitRefused
        try:
            self._require_readings(evidence)
            found = estimated(str(self.accuracy[METHOD.name]), evidence)
        except FitRefused as refusal:
            found = refusal
        return found, time.perf_counter() - began

    def _require_readings(self, evidence: ShapeEvidence) -> None:
        """Methods that know an average answer from nothing: not where all pictures were refused."""
        if self.readings.refused_pictures and not evidence.touches and evidence.look is None:
            raise FitRefused(f"no reading is left; {self.readings.refused_pictures[0]}")


ScoredShape: TypeAlias = Scored[ShapeAnswering, ShapeAnswer]
"""An answer with what it is compared with."""


def evidence_of(run: RunFiles, records: Iterable[StepRecord]) -> ShapeEvidence:
    """Collect the evidence from steps of a run."""
    readings = ShapeReadings(run)
    for record in records:
        readings.read(record)
    return readings.evidence()


def base_from_stand(run: RunFiles) -> FloatArray:
    """``(4, 4)``: the frame of all evidence, where the scene nominally puts the object on its support."""
    return translation(np.array(run.scene.object.pose.position))


def _guarded_touch(run: RunFiles, record: StepRecord) -> GuardedTouch:
    """Read the contacts of one probe line."""
    settings, seen = run.scene.section(ShapeRun), run.observe(record)
    read = run.gel_reader.read(seen.images)
    read.require_accepted()
    found = contact_points(read.height, read.error, run.station.gel.sensor.pitch)
    stand_from_gel = seen.base_from_gel.copy()
    stand_from_gel[:3, 3] -= base_from_stand(run)[:3, 3]
    nothing = np.zeros((0, 3))
    stand_off = np.asarray(record.step.parameters["base_from_stand_off"]) @ run.station.flange_from_gel
    # From the stand-off to where the gel ended; the arm's noise makes no way shorter than none.
    way = max(0.0, float(stand_off[:3, 2] @ (seen.base_from_gel[:3, 3] - stand_off[:3, 3])))
    longest = ContactMotion.from_parameters(record.step.parameters).longest(SPEEDS)
    return GuardedTouch(
        stand_from_gel=read_only(stand_from_gel),
        way=way,
        points=read_only(nothing if found is None else apply(stand_from_gel, found.points)),
        normals=read_only(nothing if found is None else found.normals @ stand_from_gel[:3, :3].T),
        sigma=float(np.hypot(settings.contact_error, 0.0 if found is None else found.error)),
        normal_sigma=settings.contact_tilt_error,
        index=record.step.index,
        clear=read_only(nothing if found is None else apply(stand_from_gel, found.clear)),
        stopped=way < longest - limits.MIN_EARLY_END,
    )


def _observe_silhouette(run: RunFiles, mask: BoolArray) -> SeenMask | None:
    """Return the silhouette as evidence; None if the object is not in the camera image."""
    camera, settings = run.station.camera, run.scene.section(ShapeRun)
    assert camera is not None  # there are its pictures
    if mask.sum() < limits.MIN_PIXELS:
        return None
    stand_from_camera = camera.base_from_camera.matrix.copy()
    stand_from_camera[:3, 3] -= base_from_stand(run)[:3, 3]
    return SeenMask(
        mask=mask,
        hidden=read_only(np.zeros(mask.shape, np.bool_)),
        stand_from_camera=read_only(stand_from_camera),
        focal_length=camera.focal_length,
        position_error=settings.camera_position_error,
        rotation_error=settings.camera_rotation_error,
        focal_length_error=settings.focal_length_error,
    )
