"""A table of an experiment: many mocked runs, kept one file each, so that it stops and resumes at will."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.basics.metrics import Interval, bootstrap, mean, median
from harness.basics.whole_file import write_text_whole
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import load_station, station_path
from harness.experiment.experiment import AnyExperiment
from harness.experiment.in_process import RunCell
from harness.experiment.lookup import find_experiment
from harness.experiment.measuring import Measurement, dump_scenes, run_each, table_of, workers_of

KEYS = "scene.keys.json"
"""In a table's folder: what ``--set`` changed in the scene of every run there."""

Key = tuple[tuple[str, str], ...]
"""Conditions by name."""


@dataclass(frozen=True, eq=False)
class TableRow:
    """One method under one condition."""

    conditions: Mapping[str, str]  #: by name.
    method: str  #: which.
    runs: int  #: how many.
    raw: tuple[Interval, Interval, Interval]
    """median, mean and share of gross errors, in the error's own unit."""
    symmetric: tuple[Interval, Interval, Interval] | None
    """the same, modulo the object's symmetry; None for a random point."""
    held: float | None  #: share of runs whose 90 % region holds the truth; None where there is no region.
    seconds: float  #: median of an answer; from all of the run's readings.
    refused: int = 0  #: of the runs, how many were not answered; each counts as the experiment says.
    answered: Interval | None = None  #: mean of the others; None where none was refused, or all were.
    means: Mapping[str, float] = field(default_factory=dict)
    """of the experiment's columns, by key; of those runs that have it."""


def measure(
    experiment: AnyExperiment,
    wanted: Sequence[RunCell],
    scenes: Mapping[str, SceneFile],
    folder: Path,
    workers: int,
    recordings: Path | None = None,
) -> Iterator[tuple[RunCell, JsonObject]]:
    """Perform and answer the runs that have no file yet; yield each result when it is complete.

    Args:
        experiment: the experiment.
        wanted: the runs.
        scenes: scenes by object.
        folder: folder of the results, one JSON file per run.
        workers: number of processes; 1 for this one alone.
        recordings: folder that stores the runs; a run in it is answered and not performed again.
            None to store none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = []
    for cell in wanted:
        path = folder / f"{cell.name}.json"
        if path.exists():
            yield cell, json.loads(path.read_text(encoding="utf-8"))
        else:
            missing.append(cell)
    answer = partial(_run, experiment.name, dump_scenes(scenes), recordings)
    with workers_of(workers) as pool:
        for cell, result in run_each(pool, answer, missing):
            write_text_whole(folder / f"{cell.name}.json", json.dumps(result, allow_nan=False))
            yield cell, result


def _run(name: str, trees: Mapping[str, JsonObject], recordings: Path | None, cell: RunCell) -> JsonObject:
    scene, station = scene_from_json(trees[cell.object], "the table"), load_station(station_path("mock"))
    try:
        return table_of(find_experiment(name)).run_cell(cell, scene, station, recordings)
    except TouchstoneError as error:
        # A run that cannot be planned or performed is reported, and is not a measurement.
        return {"schema": 1, "failed": f"{type(error).__name__}: {error}"}


def require_same_keys(folder: Path, assignments: Sequence[str]) -> None:
    """Refuse a folder whose runs were made with other keys of the scene; note the keys of a new one.

    Args:
        folder: of a table's runs; made if it is not there.
        assignments: ``KEY=VALUE`` each, of every scene of the table.

    Raises:
        WrongUse: runs are there, and their scenes had other keys.
    """
    noted, wanted = folder / KEYS, sorted(assignments)
    if folder.is_dir() and any(folder.glob("*.json")):
        there = json.loads(noted.read_text(encoding="utf-8")) if noted.exists() else []
        if there != wanted:
            raise WrongUse(
                f"the runs in {folder} were made with --set {', '.join(there) or 'nothing'}, and --set "
                f"{', '.join(wanted) or 'nothing'} is asked for now; give another folder with --out"
            )
    elif wanted:
        folder.mkdir(parents=True, exist_ok=True)
        write_text_whole(noted, json.dumps(wanted))


def rows(experiment: AnyExperiment, results: Mapping[RunCell, JsonObject]) -> list[TableRow]:
    """Compute the rows of the runs measured so far.

    Raises:
        WrongUse: no run has been performed.
    """
    performed = {cell: result for cell, result in results.items() if "rows" in result}
    if not performed:
        raise WrongUse("no run of the table has been performed yet")
    measured = table_of(experiment)
    found = {method for result in performed.values() for method in result["rows"]}
    return [
        _row(performed, condition, method, measured)
        for condition in sorted({key_of(cell) for cell in performed})
        for method in measured.methods
        if method in found
    ]


def key_of(cell: RunCell) -> Key:
    """Return the conditions of a run in a form that sorts and compares."""
    return tuple(cell.conditions.items())


def by_object(
    results: Mapping[RunCell, JsonObject], condition: Key, value: str = "error_m"
) -> dict[str, dict[str, float]]:
    """Compute the mean in m of every method on every object, of the error or of another value.

    Args:
        results: results of the runs.
        condition: result of ``key_of``; runs of other conditions are left out.
        value: key of a row; a method without it on an object is left out.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for cell, result in results.items():
        if "rows" in result and key_of(cell) == condition:
            for method, row in result["rows"].items():
                if value in row:
                    found.setdefault(cell.object, {}).setdefault(method, []).append(row[value])
    return {name: {m: float(np.mean(e)) for m, e in methods.items()} for name, methods in found.items()}


def _row(
    performed: Mapping[RunCell, JsonObject], condition: Key, method: str, measured: Measurement
) -> TableRow:
    found = [
        result["rows"][method]
        for cell, result in performed.items()
        if key_of(cell) == condition and method in result["rows"]
    ]
    held = [bool(one["in_region90"]) for one in found if "in_region90" in one]
    raw = np.array([one["error_m"] for one in found])
    symmetric = [one.get("error_symmetric_m") for one in found]
    answered = raw[["refused" not in one for one in found]]
    columns = {c.key: [float(one[c.key]) for one in found if c.key in one] for c in measured.columns}
    return TableRow(
        dict(condition),
        method,
        len(found),
        _statistics(raw, measured.gross, [one["gross"] for one in found if "gross" in one]),
        None if None in symmetric else _statistics(np.array(symmetric), measured.gross),
        float(np.mean(held)) if held and method in measured.regions else None,
        float(np.median([one["seconds"] for one in found])),
        len(raw) - len(answered),
        bootstrap(answered, mean) if 0 < len(answered) < len(raw) else None,
        {key: float(np.mean(numbers)) for key, numbers in columns.items() if numbers},
    )


def _statistics(
    errors: FloatArray, gross: float, marked: Sequence[bool] = ()
) -> tuple[Interval, Interval, Interval]:
    """Median, mean and share of gross errors: those that their runs mark, or those beyond ``gross`` m."""
    is_gross = np.array(marked) if len(marked) == len(errors) else errors > gross
    share = bootstrap(is_gross.astype(np.float64), mean)
    return bootstrap(errors, median), bootstrap(errors, mean), share
