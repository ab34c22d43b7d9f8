"""``touchstone tables``: what a paper would print, measured on the mocked bench."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit, run_progress, warn
from harness.commands.run.conditions import WhereOption, levels_of

if TYPE_CHECKING:
    from harness.basics.metrics import Interval
    from harness.experiment.measuring import MeasuredColumn
    from harness.experiment.tables import Key, TableRow


def tables(
    context: typer.Context,
    seeds: Annotated[int, typer.Option(help="Runs of each object and condition.", min=1, max=1000)] = 10,
    first_seed: Annotated[int, typer.Option(help="The first of them; below 1000 is for development.")] = 2000,
    data: Annotated[
        Path | None, typer.Option(help="Folder of the real meshes. Default: TOUCHSTONE_DATA.")
    ] = None,
    only: Annotated[list[str] | None, typer.Option(help="Only this object; may be given again.")] = None,
    spacing: Annotated[list[str] | None, typer.Option(help="close or spread; both if left out.")] = None,
    gap: Annotated[
        list[str] | None,
        typer.Option(help="default, none, another shipped one or a file; the first two if left out."),
    ] = None,
    yaw: Annotated[list[str] | None, typer.Option(help="known or unknown; both if left out.")] = None,
    where: WhereOption = None,
    sound: Annotated[
        bool | None, typer.Option(help="Whether every place is struck too, with the rows that hear it.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A key of the experiment's table in every scene, as contacts=4; again for more.",
            metavar="KEY=VALUE",
        ),
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes.", min=1)] = 2,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the runs; a stopped table resumes there. runs/tables/NAME if left out."),
    ] = None,
    recordings: Annotated[
        Path | None,
        typer.Option(help="Folder that keeps the runs themselves; those there are answered, not performed."),
    ] = None,
    json: options.Json = False,
) -> int:
    """Error over objects, seeds and methods; stops and resumes at will.

    Every run is planned, rehearsed and performed on the mocked bench in process, then answered by every
    method. With --recordings each run's folder is kept too: touchstone replay reads one, and another table
    with the same folder answers them again.

    Errors are in millimetres, with 90 % bootstrap intervals; gross is the share of failures: above 20 mm of a
    contact, above 10 mm of a shape, above a tenth of a size. A refused answer counts as one without readings;
    beside it the mean of those answered. Region is the share of runs whose 90 % region or interval holds the
    truth.

    Try: touchstone tables contact-localization --seeds 2 --only mug
    """
    options.require_folders(("--out", out), ("--recordings", recordings))
    from harness.basics.errors import WrongUse
    from harness.basics.files.lock_file import hold_folder
    from harness.basics.files.named_file import nearest
    from harness.bench.gap import load_gap
    from harness.commands.scenes import with_assignments
    from harness.experiment.lookup import named
    from harness.experiment.measuring import table_of
    from harness.experiment.subjects import find_data_folder, objects
    from harness.experiment.tables import by_object, key_of, measure, require_same_keys, rows

    kind = named(context.info_name or "")
    measured = table_of(kind)
    out = out or Path("runs/tables") / kind.name
    folder = data or find_data_folder()
    scenes = objects(folder, measured.subjects)
    absent = [name for name in measured.subjects if name not in scenes]
    if absent:
        warn(f"left out, no mesh of it in {folder} (--data or TOUCHSTONE_DATA names it): {', '.join(absent)}")
    for name in only or []:
        if name not in scenes:
            raise WrongUse(f"no object {name!r} in this table; {nearest(name, scenes)}")
    scenes = with_assignments(scenes, kind.section, set_ or [])
    for name in gap or []:
        load_gap(name)
    sense = None if sound is None else ["both" if sound else "touch"]
    given = {"spacing": spacing, "yaw": yaw, "sense": sense}
    chosen = {
        **levels_of(measured.conditions, given, where or [], tabled=True),
        "gap": gap or [kind.gap or "default", "none"],
    }
    wanted = measured.cells(only or list(scenes), range(first_seed, first_seed + seeds), chosen)
    results: dict[Any, Any] = {}
    with hold_folder(out), run_progress(len(wanted)) as advance:
        require_same_keys(out, set_ or [])
        for cell, result in measure(kind, wanted, scenes, out, workers, recordings):
            results[cell] = result
            if "failed" in result:
                warn(f"{cell.name}: {result['failed']}")
            advance()
    table = rows(kind, results)
    failed = sum("failed" in result for result in results.values())
    conditions = sorted({key_of(cell) for cell, result in results.items() if "rows" in result})
    values = ["error_m", *(column.key for column in measured.columns if column.by_object)]
    if json:
        objects_ = [
            {**dict(key), **{f"mean_{value}": by_object(results, key, value) for value in values}}
            for key in conditions
        ]
        trees = [asdict(row) for row in table]
        rows_ = [{**tree.pop("conditions"), **tree.pop("means"), **tree} for tree in trees]
        emit({"schema": 1, "runs": len(results), "failed": failed, "rows": rows_, "by_object": objects_})
        return 0
    print_table(table, measured.columns)
    for key in conditions:
        for value in values if measured.columns else ():
            print_by_object(key, value, by_object(results, key, value), [row.method for row in table])
    if measured.published:
        said = "; ".join(
            f"{name}: {', '.join(f'{v:g}' for v in quoted)}" for name, quoted in measured.published.items()
        )
        ANSWERS.print(f"the paper (ObjectFolder 2.0, other objects, mean error in cm): {said}", markup=False)
    if failed:
        warn(f"{failed} of {len(results)} runs could not be planned or performed; they are not in the table")
    return 0


_HEADINGS = ("method", "median", "mean", "gross", "refused", "answered", "modulo symmetry", "region", "s")
_GAPS = {"default": "on", "none": "off"}
"""Of gaps, in a title."""

_SCALES = {"mm": 1e3, "%": 100.0}


def print_table(table: Sequence["TableRow"], columns: Sequence["MeasuredColumn"] = ()) -> None:
    """A table a condition: errors; then the experiment's other means, where it has any."""
    for condition in sorted({tuple(row.conditions.items()) for row in table}):
        chosen = [row for row in table if tuple(row.conditions.items()) == condition]
        title = f"mock: {_said(condition)}; {chosen[0].runs} runs"
        _print(f"{title}; mm [5 to 95 %]", _HEADINGS, [_cells(row) for row in chosen])
        if columns:
            headings = ["method", *(f"{column.heading}, {column.unit}" for column in columns)]
            means = [
                [f"{_SCALES[c.unit] * row.means[c.key]:.1f}" if c.key in row.means else "" for c in columns]
                for row in chosen
            ]
            lines = [[row.method, *shown] for row, shown in zip(chosen, means, strict=True)]
            _print(f"{title}; means", headings, lines)


def print_by_object(
    condition: "Key", value: str, means: Mapping[str, Mapping[str, float]], methods: Iterable[str]
) -> None:
    """The mean of each method on each object, under one condition, in mm.

    Args:
        condition: of the runs.
        value: what it is the mean of.
        means: m, by object and method; a method that an object has not is left open there.
        methods: in the order of the table.
    """
    title = f"mock: {_said(condition)}; mean {value} of each object, in mm"
    drawn = Table(title=title, box=None, padding=(0, 1, 0, 0))
    drawn.add_column("method", no_wrap=True)
    for name in means:
        drawn.add_column(name, no_wrap=True, justify="right")
    for method in dict.fromkeys(methods):
        found = [one.get(method) for one in means.values()]
        if any(one is not None for one in found):
            drawn.add_row(method, *("" if one is None else f"{1e3 * one:.1f}" for one in found))
    ANSWERS.print(drawn)


def _said(condition: "Key") -> str:
    return ", ".join(f"{name} {_GAPS.get(level, level)}" for name, level in condition)


def _print(title: str, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """The columns that have anything in them."""
    drawn = Table(title=title)
    shown = [k for k in range(len(headings)) if any(line[k] for line in lines)]
    for k in shown:
        drawn.add_column(headings[k], no_wrap=True)
    for line in lines:
        drawn.add_row(*(line[k] for k in shown))
    ANSWERS.print(drawn)


def _cells(row: "TableRow") -> list[str]:
    median, mean, gross = row.raw
    symmetric = "" if row.symmetric is None else (
        f"{1e3 * row.symmetric[0].value:.1f} / {1e3 * row.symmetric[1].value:.1f} / "
        f"{100 * row.symmetric[2].value:.0f} %"
    )  # fmt: skip
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


def _interval(interval: "Interval", scale: float, digits: int) -> str:
    value, low, high = (scale * number for number in (interval.value, interval.low, interval.high))
    return f"{value:.{digits}f} \\[{low:.{digits}f} {high:.{digits}f}]"
