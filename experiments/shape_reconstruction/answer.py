"""From a run's readings to the shape of its object: by the picture, by touch, and by both."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.methods import METHOD, estimated, load_kernels
from experiments.shape_reconstruction.readings import ShapeReadings
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused, WrongUse
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Scored
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.skills.exploring.exploration import SKIPPED

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
    """Readings to answer: each step's pictures are read once.

    Args:
        run: the folder.
        accuracy: says by which method.
    """

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
        given = self._given(evidence)
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

    def _given(self, evidence: ShapeEvidence) -> dict[str, ShapeEvidence]:
        """What each sense that the scene asks for has read."""
        sensors, given = self.run.scene.sensors, {}
        if sensors.camera:
            given["vision"] = replace(evidence, touches=())
        if sensors.touch:
            given["touch"] = replace(evidence, look=None)
        if not given:
            raise WrongUse("the scene asks for no sense; set sensors.camera or sensors.touch")
        return given

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
