"""``touchstone tables``: what a paper would print, measured on the mocked bench."""

import os
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit, run_progress, warn
from harness.commands.run.conditions import WhereOption, levels_of


def tables(
    context: typer.Context,
    seeds: Annotated[int, typer.Option(help="Runs of each object and condition.", min=1, max=1000)] = 10,
    first_seed: Annotated[int, typer.Option(help="The first of them; below 1000 is for development.")] = 2000,
    data: Annotated[
        Path | None, typer.Option(help="Folder of the real meshes; TOUCHSTONE_DATA or ../shared/data.")
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

    Errors are in millimetres, with 90 % bootstrap intervals; gross is the share above 20 mm. A refused answer
    counts as one without readings; beside it the mean of those answered. Region is the share of runs
    whose 90 % region or interval holds the truth.

    Try: touchstone tables contact-localization --seeds 2 --only mug
    """
    from harness.basics.errors import WrongUse
    from harness.basics.toml_file import nearest
    from harness.bench.gap import load_gap
    from harness.commands.scenes import with_assignments
    from harness.experiment.lookup import named
    from harness.experiment.subjects import objects
    from harness.experiment.tables import by_object, key_of, measure, measurement_of, require_same_keys, rows

    kind = named(context.info_name or "")
    measured = measurement_of(kind)
    out = out or Path("runs/tables") / kind.name
    folder = data or _data_folder()
    if folder is None:
        warn("real meshes not found (--data, TOUCHSTONE_DATA or ../shared/data): built-in objects only")
    scenes = objects(folder)
    for name in only or []:
        if name not in scenes:
            raise WrongUse(f"no object {name!r} in this table; {nearest(name, scenes)}")
    scenes = with_assignments(scenes, kind.section, set_ or [])
    require_same_keys(out, set_ or [])
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
    with run_progress(len(wanted)) as advance:
        for cell, result in measure(kind, wanted, scenes, out, workers, recordings):
            results[cell] = result
            if "failed" in result:
                warn(f"{cell.name}: {result['failed']}")
            advance()
    table = rows(kind, results)
    failed = sum("failed" in result for result in results.values())
    if json:
        objects_ = [
            {**dict(key), "mean_error_m": by_object(results, key)}
            for key in sorted({key_of(cell) for cell, result in results.items() if "rows" in result})
        ]
        rows_ = [_plain(row) for row in table]
        emit({"schema": 1, "runs": len(results), "failed": failed, "rows": rows_, "by_object": objects_})
        return 0
    _print(table, measured.published)
    if failed:
        warn(f"{failed} of {len(results)} runs could not be planned or performed; they are not in the table")
    return 0


def _data_folder() -> Path | None:
    named = os.environ.get("TOUCHSTONE_DATA")
    candidates = [Path(named)] if named else [Path.cwd().parent / "shared" / "data"]
    return next((path for path in candidates if (path / "meshes").is_dir()), None)


_HEADINGS = ("method", "median", "mean", "gross", "refused", "answered", "modulo symmetry", "region", "s")
_GAPS = {"default": "on", "none": "off"}
"""Of gaps, in a title."""


def _plain(row: Any) -> dict[str, Any]:
    tree = asdict(row)
    return {**tree.pop("conditions"), **tree}


def _print(table: list[Any], published: Any) -> None:
    conditions = sorted({tuple(row.conditions.items()) for row in table})
    for condition in conditions:
        chosen = [row for row in table if tuple(row.conditions.items()) == condition]
        said = ", ".join(f"{name} {_GAPS.get(level, level)}" for name, level in condition)
        drawn = Table(title=f"mock: {said}; {chosen[0].runs} runs; mm [5 to 95 %]")
        lines = [_cells(row) for row in chosen]
        shown = [k for k in range(len(_HEADINGS)) if any(line[k] for line in lines)]
        for k in shown:
            drawn.add_column(_HEADINGS[k], no_wrap=True)
        for line in lines:
            drawn.add_row(*(line[k] for k in shown))
        ANSWERS.print(drawn)
    if published:
        said = "; ".join(
            f"{name}: {', '.join(f'{v:g}' for v in values)}" for name, values in published.items()
        )
        ANSWERS.print(f"the paper (ObjectFolder 2.0, other objects, mean error in cm): {said}", markup=False)


def _cells(row: Any) -> list[str]:
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


def _interval(interval: Any, scale: float, digits: int) -> str:
    value, low, high = (scale * number for number in (interval.value, interval.low, interval.high))
    return f"{value:.{digits}f} \\[{low:.{digits}f} {high:.{digits}f}]"
