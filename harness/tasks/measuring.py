"""Measure an experiment's errors and seconds over objects, methods and settings, on the mocked bench."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from pathlib import Path

from harness.basics.cores import own_cores
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.basics.files.lock_file import hold_briefly, hold_folder
from harness.basics.files.named_file import nearest
from harness.basics.metrics import Interval
from harness.basics.result import HIDDEN, JSON_ONLY, JsonValue, Result, TextTable, json_value
from harness.basics.whole_file import make_folder
from harness.bench.gap import load_gap
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station_file import load_station, station_path
from harness.cost.curve import Curve, Point, front
from harness.cost.file import curve_path, load, save, summary
from harness.cost.provenance import code, machine, stale
from harness.experiment.costing import gather_curve, join_curves
from harness.experiment.costing import measure as measure_costs
from harness.experiment.in_process import RunCell
from harness.experiment.lookup import find_experiment
from harness.experiment.measuring import MeasuredColumn, Measurement, measurement_of, table_of
from harness.experiment.subjects import find_data_folder, objects
from harness.experiment.tables import (
    Key,
    TableRow,
    by_object,
    key_of,
    measure,
    require_same_keys,
    rows,
)
from harness.report.cost_page import write_cost_page
from harness.tasks.scenes import with_assignments

Progress = Callable[[int], AbstractContextManager[Callable[[], None]]]
"""Entered with the number of runs; the context yields what is called after each."""


def _levels(
    measured: Measurement,
    given: Mapping[str, Sequence[str] | None],
    where: Sequence[str],
    tabled: bool = False,
) -> dict[str, list[str]]:
    """Return the levels of every condition to measure, by default the usual ones.

    Raises:
        WrongUse: a condition that the experiment does not have, or an unknown level.
    """
    known = {condition.name: condition for condition in measured.conditions}
    requested: dict[str, list[str]] = {name: list(levels) for name, levels in given.items() if levels}
    for text in where:
        name, equals, level = text.partition("=")
        if not equals:
            raise WrongUse(f"--where {text}: write NAME=LEVEL, as spacing=close")
        requested.setdefault(name, []).append(level)
    for name, levels in requested.items():
        if name not in known:
            raise WrongUse(f"--{name}: not a condition of this experiment; {nearest(name, known)}")
        for level in levels:
            if level not in known[name].levels:
                raise WrongUse(f"--{name} {level!r} is not known; {nearest(level, known[name].levels)}")
    return {
        name: requested.get(name, list((condition.tabled if tabled else ()) or condition.usual))
        for name, condition in known.items()
    }


@dataclass(frozen=True, eq=False)
class MeasuredCost(Result):
    """Errors and seconds of an experiment at every setting of its knobs."""

    program: str = field(metadata=JSON_ONLY)
    mock: bool = field(metadata=JSON_ONLY)
    made: str = field(metadata=JSON_ONLY)
    machine: Mapping[str, str | int] = field(metadata=JSON_ONLY)
    code: Mapping[str, str] = field(metadata=JSON_ONLY)
    conditions: tuple[JsonObject, ...] = field(metadata=JSON_ONLY)  #: each with its settings.
    curve: Path  #: file of the curve.
    report: Path  #: HTML page.
    found: Curve = field(metadata=HIDDEN)

    def tables(self) -> Iterable[TextTable]:
        """Yield a table of the Pareto front of each condition."""
        for condition in self.found.conditions():
            points = self.found.where(condition)
            named = ", ".join(f"{name} {value}" for name, value in condition.items())
            title = f"mock: {named}; {_runs(points)} runs; the front of {len(points)} settings"
            headings = ["setting", "error, mm [5 to 95 %]", "mean, mm", "CPU, s [5 to 95 %]"]
            yield (
                title,
                headings,
                [
                    [
                        point.name,
                        _interval(point.error, 1e3, 2),
                        f"{1e3 * float(point.errors.mean()):.2f}",
                        _interval(point.seconds, 1.0, 3),
                    ]
                    for point in front(points)
                ],
            )


def _runs(points: Sequence[Point]) -> int:
    return max(len(point.samples) for point in points)


def measure_cost(
    experiment: str,
    seeds: range,
    progress: Progress,
    warn: Callable[[str], None],
    only: Sequence[str] = (),
    scene: Path | None = None,
    levels: Mapping[str, Sequence[str] | None] | None = None,
    where: Sequence[str] = (),
    gap: str = "default",
    steps: Sequence[int] = (),
    thorough: bool = False,
    out: Path | None = None,
) -> MeasuredCost:
    """Measure the error and the seconds of an experiment at every setting of its knobs.

    Every run is performed once on the mocked bench and answered at every setting. The curve is stored for
    this machine and this code, and used by budgets of later runs.

    The arguments are the options of ``touchstone cost``; ``levels`` are of conditions by name, ``progress``
    and ``warn`` receive what it reports.

    Raises:
        WrongUse: an unknown object, condition, level or gap.
        DataRefused: no run could be performed.
    """
    kind = find_experiment(experiment)
    measured = measurement_of(kind)
    out = out or Path("runs/cost") / kind.name
    scenes = _scenes(only, scene)
    if gap not in ("default", "none"):
        raise WrongUse(f"--gap {gap!r} is not known; {nearest(gap, ('default', 'none'))}")
    chosen = {**_levels(measured, levels or {}, where), "gap": [gap]}
    wanted = measured.cells(list(scenes), seeds, chosen)
    answers = measured.list_answers(thorough, chosen, scenes, sorted(set(steps or measured.counts)))
    station, points = load_station(station_path("mock")), list[Point]()
    with hold_folder(out), progress(len(wanted)) as advance:
        for _, found in measure_costs(
            measured, wanted, answers, scenes, station, out / "cells", warn, own_cores()
        ):
            points += found
            advance()
    if not points:
        raise DataRefused("no run could be performed; the reasons stand above")
    title = f"What {kind.title[:1].lower()}{kind.title[1:]} costs"
    curve, path = gather_curve(kind, points, title, measured.notes()), curve_path(kind.name)
    make_folder(path.parent)
    with hold_briefly(path.with_suffix(".lock")):  # another measurement may join its points meanwhile
        if path.exists():
            old = load(path)
            if not stale(old, machine(), code(measured.estimator)):
                curve = join_curves(kind, old, curve)
        save(curve, path)
    save(curve, out / "curve.json")
    styled = tuple(knob.name for knob in kind.own_knobs if knob.kind == "method")  # marks differ by these
    page = write_cost_page(curve, (), styled, kind.plural, out)
    conditions = []
    for condition in curve.conditions():
        points = list(curve.where(condition))
        best = {point.name for point in front(points)}
        settings = [summary(point, point.name in best) for point in points]
        conditions.append({"condition": condition, "runs": _runs(points), "settings": settings})
    known = curve.program, True, curve.made, dict(curve.machine), dict(curve.code)
    return MeasuredCost(*known, tuple(conditions), path, page, curve)


def _scenes(only: Sequence[str], scene: Path | None) -> dict[str, SceneFile]:
    if scene is not None:
        if only:
            raise WrongUse("--only names built-in objects and --scene a scene; give one of them")
        loaded = load_scene(scene)
        return {loaded.object.name: loaded}
    scenes = objects(None)
    for name in only:
        if name not in scenes:
            raise WrongUse(f"no built-in object {name!r}; {nearest(name, scenes)}")
    return {name: scenes[name] for name in only or scenes}


_HEADINGS = ["method", "median", "mean", "gross", "refused", "answered", "modulo symmetry", "region", "s"]
_GAPS = {"default": "on", "none": "off"}
"""Names of gaps in a title."""

_SCALES = {"mm": 1e3, "%": 100.0}


@dataclass(frozen=True, eq=False)
class MeasuredTable(Result):
    """Errors of an experiment over objects, seeds and methods."""

    runs: int
    failed: int  #: runs that could not be planned or performed.
    found: Sequence[TableRow] = field(metadata=HIDDEN)  #: a method under a condition each.
    columns: Sequence[MeasuredColumn] = field(metadata=HIDDEN)  #: further means of the experiment.
    means: Mapping[Key, Mapping[str, Mapping[str, Mapping[str, float]]]] = field(metadata=HIDDEN)
    """mean values in m by condition, value, object and method."""
    published: Mapping[str, Sequence[float]] = field(metadata=HIDDEN)  #: errors that the paper states, in cm.
    notes: tuple[str, ...] = field(metadata=HIDDEN)

    def as_json(self) -> dict[str, JsonValue]:
        """Return rows by method and means by object, each with the keys of its condition."""
        by_objects = [
            {**dict(key), **{f"mean_{value}": found for value, found in values.items()}}
            for key, values in self.means.items()
        ]
        trees = [asdict(row) for row in self.found]
        lines = [{**tree.pop("conditions"), **tree.pop("means"), **tree} for tree in trees]
        counts = {"schema": self.schema, "runs": self.runs, "failed": self.failed}
        return {**counts, "rows": json_value(lines), "by_object": json_value(by_objects)}

    def tables(self) -> Iterable[TextTable]:
        """Yield errors and further means by method, then means by object, of each condition."""
        for condition in sorted({tuple(row.conditions.items()) for row in self.found}):
            chosen = [row for row in self.found if tuple(row.conditions.items()) == condition]
            title = f"mock: {_format_condition(condition)}; {chosen[0].runs} runs"
            cells = [_cells(row) for row in chosen]
            shown = [k for k in range(len(_HEADINGS)) if any(line[k] for line in cells)]
            headings = [_HEADINGS[k] for k in shown]
            yield f"{title}; mm [5 to 95 %]", headings, [[line[k] for k in shown] for line in cells]
            if self.columns:
                yield (
                    f"{title}; means",
                    ["method", *(f"{column.heading}, {column.unit}" for column in self.columns)],
                    [
                        [
                            row.method,
                            *(
                                f"{_SCALES[c.unit] * row.means[c.key]:.1f}" if c.key in row.means else ""
                                for c in self.columns
                            ),
                        ]
                        for row in chosen
                    ],
                )
        methods = list(dict.fromkeys(row.method for row in self.found))
        for condition, values in self.means.items() if self.columns else ():
            for value, found in values.items():
                lines = [
                    [
                        method,
                        *(f"{1e3 * each[method]:.1f}" if method in each else "" for each in found.values()),
                    ]
                    for method in methods
                ]
                title = f"mock: {_format_condition(condition)}; mean {value} of each object, in mm"
                yield title, ["method", *found], [line for line in lines if any(line[1:])]

    def summary(self) -> tuple[str, ...]:
        """State the errors in the paper."""
        named = "; ".join(
            f"{name}: {', '.join(f'{v:g}' for v in values)}" for name, values in self.published.items()
        )
        source = "the paper (ObjectFolder 2.0, other objects, mean error in cm)"
        return (f"{source}: {named}",) if named else ()


def measure_table(
    experiment: str,
    seeds: range,
    progress: Progress,
    warn: Callable[[str], None],
    data: Path | None = None,
    only: Sequence[str] = (),
    levels: Mapping[str, Sequence[str] | None] | None = None,
    where: Sequence[str] = (),
    gaps: Sequence[str] = (),
    assignments: Sequence[str] = (),
    workers: int = 2,
    out: Path | None = None,
    recordings: Path | None = None,
) -> MeasuredTable:
    """Measure the errors of an experiment over objects, seeds and methods.

    Every run is planned, rehearsed and performed on the mocked bench, then answered by every method.

    The arguments are the options of ``touchstone tables``; ``levels`` are of conditions by name, ``progress``
    and ``warn`` receive what it reports.

    Raises:
        WrongUse: an unknown object, condition, level, gap or key; or no run could be performed.
    """
    kind = find_experiment(experiment)
    measured = table_of(kind)
    out = out or Path("runs/tables") / kind.name
    folder = data or find_data_folder()
    scenes = objects(folder, measured.subjects)
    absent = [name for name in measured.subjects if name not in scenes]
    if absent:
        warn(f"left out, no mesh of it in {folder} (--data or TOUCHSTONE_DATA names it): {', '.join(absent)}")
    for name in only:
        if name not in scenes:
            raise WrongUse(f"no object {name!r} in this table; {nearest(name, scenes)}")
    scenes = with_assignments(scenes, kind.section, assignments)
    for name in gaps:
        load_gap(name)
    chosen = _levels(measured, levels or {}, where, tabled=True)
    chosen["gap"] = list(gaps) or [kind.gap or "default", "none"]
    wanted = measured.cells(only or list(scenes), seeds, chosen)
    results: dict[RunCell, JsonObject] = {}
    with hold_folder(out), progress(len(wanted)) as advance:
        require_same_keys(out, assignments)
        for cell, result in measure(kind, wanted, scenes, out, workers, recordings):
            results[cell] = result
            if "failed" in result:
                warn(f"{cell.name}: {result['failed']}")
            advance()
    failed = sum("failed" in result for result in results.values())
    conditions = sorted({key_of(cell) for cell, result in results.items() if "rows" in result})
    values = ["error_m", *(column.key for column in measured.columns if column.by_object)]
    note = f"{failed} of {len(results)} runs could not be planned or performed; they are not in the table"
    return MeasuredTable(
        runs=len(results),
        failed=failed,
        found=rows(kind, results),
        columns=measured.columns,
        means={key: {value: by_object(results, key, value) for value in values} for key in conditions},
        published=measured.published,
        notes=(note,) if failed else (),
    )


def _format_condition(condition: Key) -> str:
    return ", ".join(f"{name} {_GAPS.get(level, level)}" for name, level in condition)


def _cells(row: TableRow) -> list[str]:
    median, mean, gross = row.raw
    symmetric = ""
    if row.symmetric is not None:
        middle, average, share = (interval.value for interval in row.symmetric)
        symmetric = f"{1e3 * middle:.1f} / {1e3 * average:.1f} / {100 * share:.0f} %"
    return [
        row.method,
        _interval(median, 1e3, 1),
        _interval(mean, 1e3, 1),
        _interval(gross, 100, 0) + " %",
        str(row.refused or ""),
        "" if row.answered is None else _interval(row.answered, 1e3, 1),
        symmetric,
        "" if row.held is None else f"{100 * row.held:.0f} %",
        f"{row.seconds:.2f}",
    ]


def _interval(interval: Interval, scale: float, digits: int) -> str:
    value, low, high = (scale * number for number in (interval.value, interval.low, interval.high))
    return f"{value:.{digits}f} [{low:.{digits}f} {high:.{digits}f}]"
