"""Measure what the estimate's accuracy costs: runs performed once, answered at every setting."""

import datetime as dt
import json
import os
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.baselines import mean_random_error
from experiments.contact_localization.dials import SIMULATED, needs_images, setting_name
from experiments.contact_localization.model_of import model_of_scene
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.solving import (
    ESTIMATOR,
    PROGRAM,
    Models,
    Readings,
    Setting,
    Solved,
    object_key,
    prepare,
    solve,
)
from experiments.contact_localization.table_cell import Cell, PerformedRun, believed, perform_cell, scene_of
from experiments.contact_localization.within import Run
from harness.arrays import FloatArray
from harness.cost import Curve, Point, Sample
from harness.cost_file import sample_from, sample_json
from harness.cost_provenance import code, machine
from harness.errors import TouchstoneError
from harness.mesh import Mesh
from harness.recording import write_text_whole
from harness.run_folder import station_calibration
from harness.scene import SceneFile, scene_from_json
from harness.sim.scene_object import known_object
from harness.station_file import Station

_ROUND = 24
"""Runs performed side by side, then answered one at a time while nothing else runs."""


@dataclass(frozen=True, eq=False)
class Case:
    """A performed run with its truth, to be answered at any setting."""

    cell: Cell
    run: Run
    true_points: FloatArray
    mesh: Mesh
    _read: dict[bool, Readings] = field(init=False, default_factory=dict, repr=False)

    def readings(self, setting: Setting) -> Readings:
        """As a setting takes them; timed on their second reading, when kernels are loaded."""
        images = needs_images(setting)
        if images not in self._read:
            self.run.read(setting)
            self._read[images] = self.run.read(setting)
        return self._read[images].under(self.run.models.at(setting))

    def sample(self, setting: Setting, contacts: int) -> Sample:
        """One setting from the first contacts: the error of the last of them, and the seconds."""
        readings = self.readings(setting).first(contacts)
        prepare(readings.model, setting)
        solved = solve(readings, setting)
        radius = None if solved.estimate is None else solved.estimate.credible90
        shared = readings.shared[0] if needs_images(setting) else 0.0
        error = self.error_of(solved, contacts)
        return Sample(self.cell.name, self.run.object, error, radius, shared, solved.cpu, solved.wall)

    def error_of(self, solved: Solved, contacts: int) -> float:
        """m, of the last of the first contacts; a refused answer counts as a random one."""
        true = self.true_points[contacts - 1]
        if solved.estimate is None:
            return mean_random_error(self.mesh, true)
        return float(np.linalg.norm(solved.estimate.position_in_object - true))


def perform(cell: Cell, scene: SceneFile, station: Station, models: MutableMapping[str, Models]) -> Case:
    """Plan and perform a run on the mocked bench in process.

    Args:
        cell: which run.
        scene: of the object.
        station: a mocked one.
        models: by object, taken from and added to: an object's samples are made once for all its runs.
    """
    return _case(cell, _performed(cell, scene, station), scene, station, models)


_Recorded = tuple[tuple[Observation, ...], FloatArray, FloatArray]
"""The observations, ``base_from_object`` and the true points of a performed run."""


def _performed(cell: Cell, scene: SceneFile, station: Station) -> _Recorded:
    turned = scene_of(cell, scene)
    run = perform_cell(cell, turned, station, known_object(turned).mesh)
    return run.observations, run.base_from_object, run.true_points


def _elsewhere(cell: Cell, scene: dict[str, Any], station: Station) -> _Recorded:
    return _performed(cell, scene_from_json(scene, "the cost of accuracy"), station)


def _case(
    cell: Cell,
    recorded: _Recorded,
    scene: SceneFile,
    station: Station,
    models: MutableMapping[str, Models],
) -> Case:
    turned = scene_of(cell, scene)
    mesh = known_object(turned).mesh
    name = object_key(cell.object, mesh)
    calibration = station_calibration(station)
    own = models.setdefault(
        name, Models(lambda accuracy: model_of_scene(turned, station, mesh, calibration, accuracy))
    )
    observations, base_from_object, true_points = recorded
    performed = PerformedRun(observations, own.at({}), base_from_object, true_points, cell.seed)
    asked = Run(observations, own, believed(performed, cell.yaw), cell.seed, name)
    return Case(cell, asked, true_points, mesh)


Say = Callable[[str], None]


@dataclass(frozen=True)
class Work:
    """What is to be measured.

    Attributes:
        cells: the runs.
        settings: of the dials.
        contacts: how many contacts are used, each a condition of its own.
        fewer: settings that are measured with fewer contacts than the most; None for all of them.
    """

    cells: tuple[Cell, ...]
    settings: tuple[Setting, ...]
    contacts: tuple[int, ...]
    fewer: tuple[Setting, ...] | None = None

    @property
    def asked(self) -> tuple[tuple[int, Setting], ...]:
        """The answers a run is asked for: how many contacts, and the setting."""
        fewer = self.settings if self.fewer is None else self.fewer
        most = max(self.contacts)
        return tuple((n, each) for n in self.contacts for each in (self.settings if n == most else fewer))

    @property
    def each(self) -> int:
        """Answers a run is asked for."""
        return len(self.asked)


def measure(
    work: Work,
    scenes: Mapping[str, SceneFile],
    station: Station,
    folder: Path,
    say: Say,
    workers: int = 1,
    models: MutableMapping[str, Models] | None = None,
) -> Iterator[tuple[Cell, list[Point]]]:
    """Perform and answer every run that is not on the disk yet; one file a run.

    Args:
        work: the runs and settings.
        scenes: by object.
        station: a mocked one.
        folder: of the files; those of another machine or of other code are measured again.
        say: told of a run that cannot be planned or performed, and left out.
        workers: processes that perform runs; answers are timed in this one, while the others rest.
        models: by object, taken from and added to.

    Yields:
        Each run with its points, of one sample each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    models = {} if models is None else models
    stamp = {"machine": machine(), "sha256": code(ESTIMATOR)["sha256"]}
    with workers_of(workers) as pool:
        for first in range(0, len(work.cells), _ROUND):
            cells = work.cells[first : first + _ROUND]
            known = {cell: _kept(folder / f"{cell.name}.json", stamp, work) for cell in cells}
            missing = [cell for cell, points in known.items() if points is None]
            cases = performed(missing, scenes, station, pool, models, say)
            for cell in cells:
                points = known[cell]
                if points is None:
                    points = _measured(cases.pop(cell), work, say) if cell in cases else []
                    tree = {"schema": 1, **stamp, "work": _work_json(work)}
                    tree["points"] = [_one_json(p) for p in points]
                    write_text_whole(folder / f"{cell.name}.json", json.dumps(tree, allow_nan=False))
                yield cell, points


def workers_of(number: int) -> Any:
    """A pool of processes, as a context; None in it where this process does all."""
    spawn = get_context("spawn")
    return ProcessPoolExecutor(number, mp_context=spawn) if number > 1 else nullcontext(None)


def performed(
    cells: Sequence[Cell],
    scenes: Mapping[str, SceneFile],
    station: Station,
    pool: Executor | None,
    models: MutableMapping[str, Models],
    say: Say,
) -> dict[Cell, Case]:
    """Perform runs, side by side where there is a pool; returns when all are done."""
    begun: dict[Cell, Future[_Recorded]] = {}
    if pool is not None:
        trees = {name: scene.model_dump(mode="json", by_alias=True) for name, scene in scenes.items()}
        begun = {cell: pool.submit(_elsewhere, cell, trees[cell.object], station) for cell in cells}
    cases = {}
    for cell in cells:
        scene = scenes[cell.object]
        try:
            if pool is None:
                cases[cell] = perform(cell, scene, station, models)
            else:
                cases[cell] = _case(cell, begun[cell].result(), scene, station, models)
        except TouchstoneError as error:
            say(f"{cell.name} was not performed: {error}")
    return cases


def _measured(case: Case, work: Work, say: Say) -> list[Point]:
    condition = {"spacing": case.cell.spacing, "gap": case.cell.gap, "yaw": case.cell.yaw}
    asked = [(count, setting) for count, setting in work.asked if count <= len(case.run.observations)]
    points = []
    try:
        warm(case, [setting for _, setting in asked])
        for count, setting in asked:
            sample = case.sample(setting, count)
            points.append(Point(setting_name(setting), setting, {**condition, "contacts": count}, (sample,)))
    except TouchstoneError as error:
        say(f"{case.cell.name} was not answered: {error}")
        return []
    return points


def warm(case: Case, settings: Sequence[Setting]) -> None:
    """Load the kernels of every kind of setting, before the clock counts."""
    kinds = {tuple(setting.get(name) for name in _KIND): setting for setting in reversed(settings)}
    for setting in kinds.values():
        case.sample(setting, 1)


_KIND = ("localization.senses", "localization.method")


def preparations(models: Mapping[str, Models]) -> tuple[str, ...]:
    """What the simulation's levels cost once an object, in a sentence each; nothing for touch alone."""
    took: dict[str, list[float]] = {}
    for own in models.values():
        for levels, model in own.all().items():
            if model.modes is not None:
                dials = zip(SIMULATED, levels, strict=True)
                name = ", ".join(f"{knob.name} {level}" for knob, level in dials)
                took.setdefault(name, []).append(sum(model.modes.seconds.values()))
    return tuple(
        f"the modes at {name} took {min(each):.1f} to {max(each):.1f} s an object when they were found; "
        "no setting's seconds count them"
        for name, each in sorted(took.items())
    )


def gathered(points: Sequence[Point], title: str, notes: Sequence[str] = ()) -> Curve:
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
        notes=(f"load of the machine at the end: {os.getloadavg()[0]:.1f}", *notes),
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
    return {"asked": [[count, dict(setting)] for count, setting in work.asked]}


def _one_json(point: Point) -> dict[str, Any]:
    return {
        "name": point.name,
        "levels": dict(point.levels),
        "condition": dict(point.condition),
        "sample": sample_json(point.samples[0]),
    }


def _one_from(tree: Mapping[str, Any]) -> Point:
    return Point(str(tree["name"]), tree["levels"], tree["condition"], (sample_from(tree["sample"]),))
