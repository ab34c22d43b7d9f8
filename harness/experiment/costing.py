"""Measure what an experiment's accuracy costs: runs performed once, answered at every setting."""

import datetime as dt
import json
import os
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from harness.basics.errors import TouchstoneError
from harness.basics.files.json_file import JsonObject
from harness.basics.whole_file import write_text_whole
from harness.basics.worker_pool import worker_pool
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.cost.curve import Curve, Point, Sample
from harness.cost.file import sample_from, sample_json
from harness.cost.provenance import code, machine
from harness.effects.accuracy import Level, Setting
from harness.experiment.experiment import AnyExperiment, AnyMeasurement, RunCase, RunCell, Say
from harness.experiment.tables import measurement_of

_SCHEMA = 2
"""Of a run's file; one of another schema is measured again."""

_ROUND = 24
"""Runs performed side by side, then answered one at a time while nothing else runs."""


@dataclass(frozen=True)
class Work:
    """What is to be measured."""

    cells: tuple[RunCell, ...]  #: the runs.
    settings: tuple[Setting, ...]  #: of the dials.
    counts: tuple[int, ...]  #: how many steps are used, each a condition of its own.
    fewer: tuple[Setting, ...] | None = None
    """settings that are measured with fewer steps than the most; None for all of them."""

    @property
    def asked(self) -> tuple[tuple[int, Setting], ...]:
        """The answers a run is asked for: how many steps, and the setting."""
        fewer = self.settings if self.fewer is None else self.fewer
        most = max(self.counts)
        return tuple((n, each) for n in self.counts for each in (self.settings if n == most else fewer))

    @property
    def each(self) -> int:
        """Answers a run is asked for."""
        return len(self.asked)


def measure(
    experiment: AnyExperiment,
    work: Work,
    scenes: Mapping[str, SceneFile],
    station: Station,
    folder: Path,
    say: Say,
    workers: int = 1,
    models: MutableMapping[str, object] | None = None,
) -> Iterator[tuple[RunCell, list[Point]]]:
    """Perform and answer every run that is not on the disk yet; one file a run.

    Args:
        experiment: that the runs are of.
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
    measured, plural = measurement_of(experiment), experiment.plural
    stamp = {"schema": _SCHEMA, "machine": machine(), "sha256": code(measured.estimator)["sha256"]}
    with workers_of(workers) as pool:
        for first in range(0, len(work.cells), _ROUND):
            cells = work.cells[first : first + _ROUND]
            known = {cell: _kept(folder / f"{cell.name}.json", stamp, work) for cell in cells}
            missing = [cell for cell, points in known.items() if points is None]
            cases = dict(measured.performed(missing, scenes, station, pool, models, say))
            for cell in cells:
                points = known[cell]
                if points is None:
                    points = []
                    if cell in cases:
                        case = cases.pop(cell)
                        points = _measured(measured, plural, case, work, say)
                        case.close()
                    tree: dict[str, object] = {**stamp, "work": _work_json(work)}
                    tree["points"] = [
                        {
                            "name": point.name,
                            "levels": dict(point.levels),
                            "condition": dict(point.condition),
                            "sample": sample_json(point.samples[0]),
                        }
                        for point in points
                    ]
                    write_text_whole(folder / f"{cell.name}.json", json.dumps(tree, allow_nan=False))
                yield cell, points


def _measured(measured: AnyMeasurement, plural: str, case: RunCase, work: Work, say: Say) -> list[Point]:
    points = []
    try:
        for count, setting in work.asked:
            if count <= case.steps:
                condition: dict[str, Level] = {**case.cell.conditions, plural: count}
                sample = case.sample(setting, count)
                points.append(Point(measured.setting_name(setting), setting, condition, (sample,)))
    except TouchstoneError as error:
        say(f"{case.cell.name} was not answered: {error}")
        return []
    return points


def workers_of(number: int) -> AbstractContextManager[Executor | None]:
    """A pool of processes, as a context; None in it where this process does all."""
    return worker_pool(number) if number > 1 else nullcontext(None)


def gathered(
    experiment: AnyExperiment, points: Sequence[Point], title: str, notes: Sequence[str] = ()
) -> Curve:
    """One curve of the points of many runs."""
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


def joined(experiment: AnyExperiment, old: Curve, new: Curve) -> Curve:
    """The new measurements beside the old ones of the same machine and code; the new ones win."""
    merged = gathered(experiment, [*new.points, *old.points], new.title)
    return replace(merged, made=new.made, notes=new.notes)


def _kept(path: Path, stamp: JsonObject, work: Work) -> list[Point] | None:
    """The points of a run measured before, by this machine, this code and for the same work."""
    if not path.exists():
        return None
    tree = json.loads(path.read_text(encoding="utf-8"))
    same = all(tree.get(name) == value for name, value in {**stamp, "work": _work_json(work)}.items())
    if not same:
        return None
    return [
        Point(str(one["name"]), one["levels"], one["condition"], (sample_from(one["sample"]),))
        for one in tree["points"]
    ]


def _work_json(work: Work) -> JsonObject:
    return {"asked": [[count, dict(setting)] for count, setting in work.asked]}
