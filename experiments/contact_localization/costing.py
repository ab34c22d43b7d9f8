"""Measure what the estimate's accuracy costs: runs performed once, answered at every setting."""

import datetime as dt
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.baselines import mean_random_error
from experiments.contact_localization.dials import setting_name
from experiments.contact_localization.model import Model
from experiments.contact_localization.solving import (
    ESTIMATOR,
    PROGRAM,
    Readings,
    Setting,
    object_key,
    prepare,
    read,
    solve,
)
from experiments.contact_localization.table_cell import Cell, PerformedRun, believed, perform_cell, scene_of
from harness.cost import Curve, Point, Sample
from harness.cost_file import sample_from, sample_json
from harness.cost_provenance import code, machine
from harness.errors import TouchstoneError
from harness.recording import write_text_whole
from harness.scene import SceneFile
from harness.sim.scene_object import known_object
from harness.station_file import Station


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


def perform(cell: Cell, scene: SceneFile, station: Station, models: dict[str, Model]) -> Case:
    """Plan and perform a run on the mocked bench in process.

    Args:
        cell: which run.
        scene: of the object.
        station: a mocked one.
        models: by object, taken from and added to: an object's samples are made once for all its runs.
    """
    turned = scene_of(cell, scene)
    mesh = known_object(turned).mesh
    name = object_key(cell.object, mesh)
    run = perform_cell(cell, turned, station, mesh)
    return Case(cell, replace(run, model=models.setdefault(name, run.model)), name)


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
    models: dict[str, Model] = {}
    stamp = {"machine": machine(), "sha256": code(ESTIMATOR)["sha256"]}
    for cell in work.cells:
        path = folder / f"{cell.name}.json"
        points = _kept(path, stamp, work)
        if points is None:
            try:
                points = _measured(perform(cell, scenes[cell.object], station, models), work)
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
