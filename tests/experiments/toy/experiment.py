"""A toy experiment: how high did the gel stand when it touched? By the arm's last pose alone."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import inverse, rotation_from_quaternion, transform
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, Section
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy, Knob
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.effects.quantities import Quantities
from harness.experiment.experiment import Experiment, Helpers, Planned, Scored
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.skills.planning import ContactRequest, plan_run
from harness.skills.press import PressPerformer
from harness.skills.sites import PressLimits
from harness.twin.bench_of import way_between

CLAIMED = 4e-3
"""m, within which it claims 9 answers of 10: a gel is pressed up to 2 mm behind its first touch."""

STRIDE = Knob("toy.stride", (8, 1), "poses", "number", 1, "every how manieth pose is read")


class Toy(Section):
    """Its table in a scene: how many presses."""

    table: ClassVar[str] = "toy"
    presses: int = 2


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """Contacts all over the object."""
    wanted = ContactRequest(scene.section(Toy).presses, "spread", PressLimits())
    made = plan_run(scene, station, mesh, seed, wanted)
    return Planned(made.parameters(), made.rehearsal, made.bench)


def performer(_run: RunFiles, helpers: Helpers) -> PressPerformer:
    """As any contact is pressed."""
    return PressPerformer(partial(way_between, helpers.twin), plan_key="steps")


@dataclass
class Answering:
    """Where the gel was at each press."""

    run: RunFiles
    accuracy: Accuracy

    def __post_init__(self) -> None:
        self.poses, self.seconds = list[FloatArray](), 0.0

    def read(self, record: StepRecord) -> None:
        """The last pose of a step that was read, as the gel's."""
        start = time.perf_counter()
        pose = record.readings["arm.base_from_flange"].values[:: int(self.accuracy[STRIDE.name])][-1]
        flange = transform(rotation_from_quaternion(pose[3:]), pose[:3])
        self.poses.append(flange @ self.run.station.flange_from_gel)
        self.seconds += time.perf_counter() - start

    def answer(self) -> tuple[float, float]:
        """The height of the last touch, m in base, and the seconds that it took."""
        return float(self.poses[-1][2, 3]), self.seconds


def result(scored: Scored[Answering, tuple[float, float]]) -> dict[str, Any]:
    """Its height, and how far off it is."""
    truth = scored.truth
    error = None if truth is None else abs(scored.found[0] - true_height(scored))
    (height, seconds), sure = scored.found, {"error_m": error, "credible90_m": CLAIMED}
    return {"height_m": height, **sure, "seconds": seconds, "warnings": []}


def true_height(scored: Scored[Answering, tuple[float, float]]) -> float:
    """m in base, of the last true contact."""
    assert scored.truth is not None
    run, last = scored.run, max(scored.truth.points)
    point = np.append(scored.truth.points[last], 1.0)
    return float((run.scene.base_from_object(run.mesh) @ point)[2])


def lines(result: Mapping[str, Any]) -> list[str]:
    """One line."""
    return [f"toy: touched at {1e3 * result['height_m']:.0f} mm"]


def sources(scored: Scored[Answering, tuple[float, float]]) -> Quantities:
    """Where the gel was."""
    run, gels = scored.run, np.array(scored.answering.poses)
    return {"contact_gel_from_object": inverse(gels) @ run.scene.base_from_object(run.mesh)}


EXPERIMENT = Experiment(
    name="toy",
    title="Toy",
    step="press",
    section=Toy,
    knobs=(STRIDE, *knobs_of(EFFECTS)),
    plan=plan,
    performer=performer,
    answering=Answering,
    estimate=Answering.answer,
    result=result,
    lines=lines,
    sources=sources,
    gives=("contact.gel_from_object",),
    count_steps=lambda scene: scene.section(Toy).presses,
)
