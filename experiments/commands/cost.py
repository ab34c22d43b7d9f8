"""``touchstone cost``: what accuracy costs, measured on this machine."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit, warn


def contact_localization(
    seeds: Annotated[int, typer.Option(help="Runs of each object.", min=1, max=1000)] = 10,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 3000,
    only: Annotated[
        list[str] | None, typer.Option(help="Only this built-in object; may be given again.")
    ] = None,
    scene: options.SceneOption = None,
    spacing: Annotated[list[str] | None, typer.Option(help="close or spread; both if left out.")] = None,
    yaw: Annotated[list[str] | None, typer.Option(help="known or unknown; known if left out.")] = None,
    sense: Annotated[
        str,
        typer.Option(help="touch: pressed only; both: struck too, and answered by touch, sound and both."),
    ] = "both",
    gap: Annotated[str, typer.Option(help="Reality gap of the mocked bench: default or none.")] = "default",
    contacts: Annotated[
        list[int] | None, typer.Option(help="Contacts used; 2, 4 and 6 if left out.", min=1)
    ] = None,
    thorough: Annotated[
        bool, typer.Option("--thorough", help="Every dial turned from the cheapest, default and finest.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder of runs and page; what is stopped resumes there.")] = Path(
        "runs/cost/contact-localization"
    ),
    json: options.Json = False,
) -> int:
    """Error against seconds of the estimate; `run --budget` and `run --error` go by it.

    Every run is performed once on the mocked bench in process; its readings are answered at every
    setting of the dials, and at a few from the first 2 and 4 contacts. Runs are performed side by side;
    then one process answers, one answer at a time: leave the machine alone meanwhile. The curve is kept
    for this machine and this code, beside those of other conditions; with --scene the object of a scene
    is measured, and budgets for it go by its own seconds.

    Try: touchstone cost contact-localization --seeds 2 --only mug --contacts 6
    """
    from experiments.contact_localization.accuracy.cases import preparations
    from experiments.contact_localization.accuracy.costing import Work, gathered, joined, measure
    from experiments.contact_localization.accuracy.dials import METHOD, SENSES, settings, settings_by_count
    from experiments.contact_localization.accuracy.solving import ESTIMATOR, PROGRAM
    from experiments.contact_localization.accuracy.table_cell import cells
    from harness.basics.errors import DataRefused
    from harness.bench.station_file import load_station, station_path
    from harness.cost.file import curve_path, load, save
    from harness.cost.provenance import code, machine, stale
    from harness.report.cost_page import write_cost_page

    scenes = _scenes(only, scene)
    sound = _known("--sense", [sense], ("touch", "both")) == ["both"]
    wanted = cells(
        list(scenes),
        range(first_seed, first_seed + seeds),
        _known("--spacing", spacing or ["close", "spread"], ("close", "spread")),
        _known("--gap", [gap], ("default", "none")),
        _known("--yaw", yaw or ["known"], ("known", "unknown")),
        sound,
    )
    work = Work(
        tuple(wanted),
        tuple(settings(thorough, sound, all(each.object.objectfile is not None for each in scenes.values()))),
        tuple(sorted(set(contacts or (2, 4, 6)))),
        tuple(settings_by_count(sound)),
    )
    station = load_station(station_path("mock"))
    points: list[Any] = []
    models: dict[str, Any] = {}
    with _bar() as bar:
        task = bar.add_task("runs", total=len(wanted))
        for _, found in measure(work, scenes, station, out / "cells", warn, _cores(), models):
            points += found
            bar.advance(task)
    if not points:
        raise DataRefused("no run could be performed; the reasons stand above")
    curve = gathered(points, "What a contact's place costs", preparations(models))
    path = curve_path(PROGRAM)
    if path.exists():
        old = load(path)
        if not stale(old, machine(), code(ESTIMATOR)):
            curve = joined(old, curve)
    save(curve, path)
    save(curve, out / "curve.json")
    page = write_cost_page(curve, (), (SENSES.name, METHOD.name), "contacts", out)
    result = _result(curve, path, page)
    if json:
        emit(result)
        return 0
    _print(curve)
    ANSWERS.print(f"curve: {path}", markup=False)
    ANSWERS.print(f"page: {page}", markup=False)
    return 0


def _cores() -> int:
    import os
    import sys

    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _bar() -> Progress:
    columns = (
        TextColumn("runs"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=CONSOLE, transient=True)


def _scenes(only: list[str] | None, scene: Path | None) -> dict[str, Any]:
    from experiments.contact_localization.accuracy.table import objects
    from harness.basics.errors import WrongUse
    from harness.basics.toml_file import nearest
    from harness.bench.scene import load_scene

    if scene is not None:
        if only:
            raise WrongUse("--only names built-in objects and --scene a scene; give one of them")
        loaded = load_scene(scene)
        return {loaded.object.name: loaded}
    scenes = objects(None)
    for name in only or []:
        if name not in scenes:
            raise WrongUse(f"no built-in object {name!r}; {nearest(name, scenes)}")
    return {name: scenes[name] for name in only or scenes}


def _known(option: str, given: list[str], levels: tuple[str, ...]) -> list[str]:
    from harness.basics.errors import WrongUse
    from harness.basics.toml_file import nearest

    for level in given:
        if level not in levels:
            raise WrongUse(f"{option} {level!r} is not known; {nearest(level, levels)}")
    return given


def _result(curve: Any, path: Path, page: Path) -> dict[str, Any]:
    from harness.cost.curve import front

    conditions = []
    for condition in curve.conditions():
        points = curve.where(condition)
        best = {point.name for point in front(points)}
        conditions.append(
            {
                "condition": condition,
                "runs": max(len(point.samples) for point in points),
                "settings": [_setting(point, point.name in best) for point in points],
            }
        )
    return {
        "schema": 1,
        "program": curve.program,
        "mock": True,
        "made": curve.made,
        "machine": dict(curve.machine),
        "code": dict(curve.code),
        "conditions": conditions,
        "curve": str(path),
        "report": str(page),
    }


def _setting(point: Any, on_front: bool) -> dict[str, Any]:
    return {
        "levels": dict(point.levels),
        "front": on_front,
        "error_m": point.error.value,
        "error_low_m": point.error.low,
        "error_high_m": point.error.high,
        "median_error_m": point.median_error.value,
        "mean_error_m": float(point.errors.mean()),
        "seconds": point.seconds.value,
        "seconds_low": point.seconds.low,
        "seconds_high": point.seconds.high,
    }


def _print(curve: Any) -> None:
    from harness.cost.curve import front

    for condition in curve.conditions():
        points = curve.where(condition)
        said = ", ".join(f"{name} {value}" for name, value in condition.items())
        runs = max(len(point.samples) for point in points)
        drawn = Table(title=f"mock: {said}; {runs} runs; the front of {len(points)} settings")
        for heading in ("setting", "error, mm [5 to 95 %]", "mean, mm", "CPU, s [5 to 95 %]"):
            drawn.add_column(heading, no_wrap=True)
        for point in front(points):
            error, seconds = point.error, point.seconds
            drawn.add_row(
                point.name,
                f"{1e3 * error.value:.2f} \\[{1e3 * error.low:.2f} {1e3 * error.high:.2f}]",
                f"{1e3 * float(point.errors.mean()):.2f}",
                f"{seconds.value:.3f} \\[{seconds.low:.3f} {seconds.high:.3f}]",
            )
        ANSWERS.print(drawn)
