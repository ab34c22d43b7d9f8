"""Measure what an experiment's accuracy costs: runs performed once, answered at every setting."""

import datetime as dt
import gc
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from harness.basics.errors import FitRefused, TouchstoneError
from harness.basics.files.json_file import JsonObject
from harness.basics.whole_file import write_text_whole
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.cost.curve import Curve, Point, Sample
from harness.cost.file import sample_from, sample_json
from harness.cost.provenance import code, machine
from harness.effects.accuracy import Level, Setting
from harness.experiment.experiment import AnyExperiment
from harness.experiment.in_process import RunCell
from harness.experiment.measuring import Measurement, measurement_of, perform_cells, workers_of
from harness.experiment.solving import Solver
from harness.recording.run_folder import RunFiles

_SCHEMA = 2
"""Of a run's file; one of another schema is measured again."""

_ROUND = 24
"""Runs performed side by side, then answered one at a time while nothing else runs."""


AnswerList = Sequence[tuple[int, Setting]]
"""The answers that are measured on each run: the number of its first steps, and the setting."""


def measure(
    measured: Measurement,
    wanted: Sequence[RunCell],
    answers: AnswerList,
    scenes: Mapping[str, SceneFile],
    station: Station,
    folder: Path,
    report: Callable[[str], None],
    workers: int = 1,
) -> Iterator[tuple[RunCell, list[Point]]]:
    """Perform and answer every run that has no current file; one file per run.

    Args:
        measured: measurement of the experiment.
        wanted: the runs.
        answers: steps and setting of each answer.
        scenes: scenes by object.
        station: a mocked station.
        folder: folder of the files; those of another machine or of other code are measured again.
        report: function that receives the reason for each run that cannot be planned, performed or answered.
        workers: number of processes that perform runs; this process measures the answers while they are idle.

    Yields:
        Each run with its points, of one sample each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stamp = {
        "schema": _SCHEMA,
        "machine": machine(),
        "sha256": code(measured.estimator)["sha256"],
        "work": {"asked": [[count, dict(setting)] for count, setting in answers]},
    }
    with workers_of(workers) as pool:
        for first in range(0, len(wanted), _ROUND):
            cells = wanted[first : first + _ROUND]
            known = {cell: _load_points(folder / f"{cell.name}.json", stamp) for cell in cells}
            missing = [cell for cell, points in known.items() if points is None]
            name = measured.experiment.name
            with perform_cells(name, missing, scenes, station, pool, report) as runs:
                for cell in cells:
                    points = known[cell]
                    if points is None:
                        files = runs.pop(cell, None)  # its pictures are released once it is answered
                        points = [] if files is None else _measure(measured, cell, files, answers, report)
                        tree = {**stamp, "points": [_point_json(point) for point in points]}
                        write_text_whole(folder / f"{cell.name}.json", json.dumps(tree, allow_nan=False))
                    yield cell, points


def _measure(
    measured: Measurement, cell: RunCell, files: RunFiles, answers: AnswerList, report: Callable[[str], None]
) -> list[Point]:
    points = []
    try:
        solver = measured.solver(files, cell)
        for count, setting in answers:
            if count <= files.recording.committed:
                condition: dict[str, Level] = {**cell.conditions, measured.experiment.plural: count}
                sample = measure_sample(cell, solver.first(count), setting)
                points.append(Point(measured.setting_name(setting), setting, condition, (sample,)))
    except TouchstoneError as error:
        report(f"{cell.name} was not answered: {error}")
        return []
    return points


def measure_sample(cell: RunCell, run: Solver, setting: Setting) -> Sample:
    """Measure the error and the seconds of an answer.

    Raises:
        FitRefused: nothing explains the readings, and the experiment counts no error for that.
    """
    shared, _ = run.read(setting)
    with _uncollected():
        solved = run.solve(setting)
    if solved.error is None:
        raise FitRefused(solved.refusal or f"{cell.name} has no true values to compare with")
    numbers = shared, solved.cpu, solved.wall, run.work(setting)
    return Sample(cell.name, run.object, solved.error, solved.radius, *numbers)


@contextmanager
def _uncollected() -> Iterator[None]:
    """Disable garbage collection, as the standard library's ``timeit`` does.

    In a process with dozens of runs in memory a collection takes 0.1 s and more.
    """
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()


def _point_json(point: Point) -> JsonObject:
    return {
        "name": point.name,
        "levels": dict(point.levels),
        "condition": dict(point.condition),
        "sample": sample_json(point.samples[0]),
    }


def gather_curve(
    experiment: AnyExperiment, points: Sequence[Point], title: str, notes: Sequence[str] = ()
) -> Curve:
    """Merge the points of many runs into one curve."""
    merged: dict[tuple[object, ...], tuple[Point, dict[str, Sample]]] = {}
    for point in points:
        key = tuple(sorted(point.levels.items())), tuple(sorted(point.condition.items()))
        _, samples = merged.setdefault(key, (point, {}))
        for sample in point.samples:
            samples.setdefault(sample.run, sample)
    return Curve(
        program=experiment.name,
        points=tuple(replace(first, samples=tuple(own.values())) for first, own in merged.values()),
        machine=machine(),
        code=code(measurement_of(experiment).estimator),
        made=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        title=title,
        notes=(f"load of the machine at the end: {os.getloadavg()[0]:.1f}", *notes),
    )


def join_curves(experiment: AnyExperiment, old: Curve, new: Curve) -> Curve:
    """Merge new measurements with old ones of the same machine and code; the new ones have priority."""
    merged = gather_curve(experiment, [*new.points, *old.points], new.title)
    return replace(merged, made=new.made, notes=new.notes)


def _load_points(path: Path, stamp: JsonObject) -> list[Point] | None:
    """Return the points of a run measured before, by this machine, this code and for the same answers."""
    if not path.exists():
        return None
    tree = json.loads(path.read_text(encoding="utf-8"))
    if any(tree.get(name) != value for name, value in stamp.items()):
        return None
    return [
        Point(str(one["name"]), one["levels"], one["condition"], (sample_from(one["sample"]),))
        for one in tree["points"]
    ]
