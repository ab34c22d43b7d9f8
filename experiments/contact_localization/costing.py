"""Measure what the estimate's accuracy costs: runs performed once, answered at every setting."""

import datetime as dt
import json
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.baselines import mean_random_error
from experiments.contact_localization.dials import KNOBS, levels_of, setting_name
from experiments.contact_localization.estimate import Estimate, locate
from experiments.contact_localization.hypotheses import Contact, Noise
from experiments.contact_localization.levels import Levels
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation, contact_of, height_map
from experiments.contact_localization.table_cell import Cell, PerformedRun, believed, perform_cell, scene_of
from harness.accuracy import Accuracy, Level
from harness.arrays import FloatArray
from harness.cost import Curve, Point, Sample
from harness.cost_file import sample_from, sample_json
from harness.cost_provenance import code, machine
from harness.errors import FitRefused, TouchstoneError
from harness.mesh import Mesh
from harness.recording import write_text_whole
from harness.scene import SceneFile
from harness.sim.scene_object import known_object
from harness.station_file import Station
from harness.store import digest

PROGRAM = "contact-localization"
ESTIMATOR = "experiments.contact_localization.estimate"
"""The module whose sources, with all they import, decide whether a curve still holds."""

Setting = Mapping[str, Level]


@dataclass(frozen=True, eq=False)
class Readings:
    """A run's readings, brought as far as every setting shares: the height maps of its images.

    Attributes:
        observations: of the contacts.
        heights: a height map for each.
        model: the object and the sensor.
        prior: of its orientation.
        seed: of the draws.
        shared: s of CPU time and on the clock that the height maps took.
    """

    observations: tuple[Observation, ...]
    heights: tuple[FloatArray, ...]
    model: Model
    prior: Prior
    seed: int
    shared: tuple[float, float]

    def first(self, count: int) -> "Readings":
        """Those of the first contacts alone."""
        share = count / len(self.observations)
        return replace(
            self,
            observations=self.observations[:count],
            heights=self.heights[:count],
            shared=(share * self.shared[0], share * self.shared[1]),
        )


@dataclass(frozen=True, eq=False)
class Solved:
    """An answer and what it took beyond what is shared.

    Attributes:
        estimate: None where the fit was refused.
        cpu: s of CPU time.
        wall: s on the clock.
        refusal: why, where it was refused.
    """

    estimate: Estimate | None
    cpu: float
    wall: float
    refusal: str | None = None


def read(observations: Sequence[Observation], model: Model, prior: Prior, seed: int) -> Readings:
    """Do, and time, what all settings share."""
    cpu, wall = time.process_time(), time.perf_counter()
    heights = tuple(height_map(observation, model) for observation in observations)
    taken = time.process_time() - cpu, time.perf_counter() - wall
    return Readings(tuple(observations), heights, model, prior, seed, taken)


def prepare(model: Model, setting: Setting) -> None:
    """Make what depends on the object alone, before any reading is needed: its samples."""
    _ = model.surface(_levels(setting).spacing).tree


def solve(readings: Readings, setting: Setting) -> Solved:
    """Answer at one setting, timed; call ``prepare`` before."""
    levels, noise = _levels(setting), Noise()
    cpu, wall = time.process_time(), time.perf_counter()
    estimate, refusal = None, None
    try:
        contacts = _contacts(readings, levels, noise)
        estimate = locate(contacts, readings.model, readings.prior, levels, noise, seed=readings.seed)[-1]
    except FitRefused as error:
        refusal = str(error)
    return Solved(estimate, time.process_time() - cpu, time.perf_counter() - wall, refusal)


def _levels(setting: Setting) -> Levels:
    return levels_of(Accuracy.default(KNOBS).with_(setting))


def _contacts(readings: Readings, levels: Levels, noise: Noise) -> list[Contact]:
    pitch = readings.model.sensor.pitch
    return [
        contact_of(observation.base_from_gel, heights, pitch, levels.block, noise.touch)
        for observation, heights in zip(readings.observations, readings.heights, strict=True)
    ]


def object_key(name: str, mesh: Mesh) -> str:
    """A name that two different objects do not share."""
    return f"{name}-{digest([mesh.vertices, mesh.faces])[:8]}"


@dataclass(frozen=True, eq=False)
class Case:
    """A performed run with its truth, to be answered at any setting."""

    cell: Cell
    run: PerformedRun
    object: str

    @cached_property
    def readings(self) -> Readings:
        """As every setting takes them; timed on its second reading, when kernels are loaded."""
        prior = believed(self.run, self.cell.yaw)
        given = self.run.observations, self.run.model, prior, self.run.seed
        read(*given)
        return read(*given)

    def sample(self, setting: Setting, contacts: int) -> Sample:
        """One setting from the first contacts: the error of the last of them, and the seconds."""
        readings, true = self.readings.first(contacts), self.run.true_points[contacts - 1]
        prepare(self.run.model, setting)
        solved = solve(readings, setting)
        if solved.estimate is None:
            error, radius = mean_random_error(self.run.model.mesh, true), None
        else:
            error = float(np.linalg.norm(solved.estimate.position_in_object - true))
            radius = solved.estimate.credible90
        return Sample(self.cell.name, self.object, error, radius, readings.shared[0], solved.cpu, solved.wall)


def perform(cell: Cell, scene: SceneFile, station: Station) -> Case:
    """Plan and perform a run on the mocked bench in process."""
    turned = scene_of(cell, scene)
    mesh = known_object(turned).mesh
    return Case(cell, perform_cell(cell, turned, station, mesh), object_key(cell.object, mesh))


Say = Callable[[str], None]


@dataclass(frozen=True)
class Work:
    """What is to be measured.

    Attributes:
        cells: the runs.
        settings: of the dials.
        contacts: how many contacts are used, each a condition of its own.
    """

    cells: tuple[Cell, ...]
    settings: tuple[Setting, ...]
    contacts: tuple[int, ...]

    @property
    def each(self) -> int:
        """Answers a run is asked for."""
        return len(self.settings) * len(self.contacts)


def measure(
    work: Work, scenes: Mapping[str, SceneFile], station: Station, folder: Path, say: Say
) -> Iterator[tuple[Cell, list[Point]]]:
    """Perform and answer every run that is not on the disk yet; one file a run.

    Args:
        work: the runs and settings.
        scenes: by object.
        station: a mocked one.
        folder: of the files; those of another machine or of other code are measured again.
        say: told of a run that cannot be planned or performed, and left out.

    Yields:
        Each run with its points, of one sample each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stamp = {"machine": machine(), "sha256": code(ESTIMATOR)["sha256"]}
    for cell in work.cells:
        path = folder / f"{cell.name}.json"
        points = _kept(path, stamp, work)
        if points is None:
            try:
                points = _measured(perform(cell, scenes[cell.object], station), work)
            except TouchstoneError as error:
                say(f"{cell.name} was not performed: {error}")
                points = []
            tree = {"schema": 1, **stamp, "work": _work_json(work), "points": [_one_json(p) for p in points]}
            write_text_whole(path, json.dumps(tree, allow_nan=False))
        yield cell, points


def _measured(case: Case, work: Work) -> list[Point]:
    condition = {"spacing": case.cell.spacing, "gap": case.cell.gap, "yaw": case.cell.yaw}
    counts = [count for count in work.contacts if count <= len(case.run.observations)]
    for setting in (work.settings[0], work.settings[-1]):
        case.sample(setting, 1)  # kernels are loaded, and pages are warm, before the clock counts
    return [
        Point(
            setting_name(setting), setting, {**condition, "contacts": count}, (case.sample(setting, count),)
        )
        for count in counts
        for setting in work.settings
    ]


def gathered(points: Sequence[Point], title: str) -> Curve:
    """One curve of the points of many runs."""
    merged: dict[tuple[Any, ...], list[Point]] = {}
    for point in points:
        merged.setdefault(_key(point), []).append(point)
    return Curve(
        program=PROGRAM,
        points=tuple(_joined(same) for same in merged.values()),
        machine=machine(),
        code=code(ESTIMATOR),
        made=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        title=title,
        notes=(f"load of the machine at the end: {os.getloadavg()[0]:.1f}",),
    )


def joined(old: Curve, new: Curve) -> Curve:
    """The new measurements beside the old ones of the same machine and code; the new ones win."""
    merged = gathered([*new.points, *old.points], new.title)
    return replace(merged, made=new.made, notes=new.notes)


def _key(point: Point) -> tuple[Any, ...]:
    return tuple(sorted(point.levels.items())), tuple(sorted(point.condition.items()))


def _joined(same: Sequence[Point]) -> Point:
    samples: dict[str, Sample] = {}
    for point in same:
        for sample in point.samples:
            samples.setdefault(sample.run, sample)
    return replace(same[0], samples=tuple(samples.values()))


def _kept(path: Path, stamp: Mapping[str, Any], work: Work) -> list[Point] | None:
    """The points of a run measured before, by this machine, this code and for the same work."""
    if not path.exists():
        return None
    tree = json.loads(path.read_text(encoding="utf-8"))
    same = all(tree.get(name) == value for name, value in {**stamp, "work": _work_json(work)}.items())
    return [_one_from(point) for point in tree["points"]] if same else None


def _work_json(work: Work) -> dict[str, Any]:
    return {"settings": [dict(setting) for setting in work.settings], "contacts": list(work.contacts)}


def _one_json(point: Point) -> dict[str, Any]:
    return {
        "name": point.name,
        "levels": dict(point.levels),
        "condition": dict(point.condition),
        "sample": sample_json(point.samples[0]),
    }


def _one_from(tree: Mapping[str, Any]) -> Point:
    return Point(str(tree["name"]), tree["levels"], tree["condition"], (sample_from(tree["sample"]),))
