"""``touchstone cost``: what accuracy costs, measured on this machine."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from harness.basics.cores import own_cores
from harness.commands import options
from harness.commands.output import ANSWERS, emit, run_progress, warn
from harness.commands.run.conditions import WhereOption, levels_of


def cost(
    context: typer.Context,
    seeds: Annotated[int, typer.Option(help="Runs of each object.", min=1, max=1000)] = 10,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 3000,
    only: Annotated[
        list[str] | None, typer.Option(help="Only this built-in object; may be given again.")
    ] = None,
    scene: options.SceneOption = None,
    spacing: Annotated[list[str] | None, typer.Option(help="close or spread; both if left out.")] = None,
    yaw: Annotated[list[str] | None, typer.Option(help="known or unknown; known if left out.")] = None,
    sense: Annotated[
        str | None,
        typer.Option(help="touch: pressed only; both: struck too, and answered by touch, sound and both."),
    ] = None,
    where: WhereOption = None,
    gap: Annotated[str, typer.Option(help="Reality gap of the mocked bench: default or none.")] = "default",
    contacts: Annotated[
        list[int] | None, typer.Option(help="Steps used; of a localization 2, 4 and 6 if left out.", min=1)
    ] = None,
    thorough: Annotated[
        bool, typer.Option("--thorough", help="Every dial turned from the cheapest, default and finest.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of runs and page; what is stopped resumes there. runs/cost/NAME if left out."
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Error against seconds of the estimate; `run --budget` and `run --error` go by it.

    Every run is performed once on the mocked bench in process; its readings are answered at every
    setting of the dials, and at a few from the first steps alone. Runs are performed side by side;
    then one process answers, one answer at a time: leave the machine alone meanwhile. The curve is kept
    for this machine and this code, beside those of other conditions; with --scene the object of a scene
    is measured, and budgets for it go by its own seconds.

    Try: touchstone cost contact-localization --seeds 2 --only mug --contacts 6
    """
    options.require_folders(("--out", out))
    from harness.basics.errors import DataRefused, WrongUse
    from harness.basics.files.lock_file import hold_briefly, hold_folder
    from harness.basics.files.named_file import nearest
    from harness.basics.whole_file import make_folder
    from harness.bench.station_file import load_station, station_path
    from harness.cost.file import curve_path, load, save
    from harness.cost.provenance import code, machine, stale
    from harness.experiment.costing import gather_curve, join_curves, measure
    from harness.experiment.lookup import named
    from harness.experiment.measuring import measurement_of
    from harness.report.cost_page import write_cost_page

    kind = named(context.info_name or "")
    measured = measurement_of(kind)
    out = out or Path("runs/cost") / kind.name
    scenes = _scenes(only, scene)
    if gap not in ("default", "none"):
        raise WrongUse(f"--gap {gap!r} is not known; {nearest(gap, ('default', 'none'))}")
    given = {"spacing": spacing, "yaw": yaw, "sense": None if sense is None else [sense]}
    chosen = {**levels_of(measured.conditions, given, where or []), "gap": [gap]}
    wanted = measured.cells(list(scenes), range(first_seed, first_seed + seeds), chosen)
    asked = measured.asked(thorough, chosen, scenes, sorted(set(contacts or measured.counts)))
    station = load_station(station_path("mock"))
    points: list[Any] = []
    with hold_folder(out), run_progress(len(wanted)) as advance:
        cells = out / "cells"
        for _, found in measure(measured, wanted, asked, scenes, station, cells, warn, own_cores()):
            points += found
            advance()
    if not points:
        raise DataRefused("no run could be performed; the reasons stand above")
    title = f"What {kind.title[:1].lower()}{kind.title[1:]} costs"
    curve = gather_curve(kind, points, title, measured.notes())
    path = curve_path(kind.name)
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
    result = _result(curve, path, page)
    if json:
        emit(result)
        return 0
    _print(curve)
    ANSWERS.print(f"curve: {path}", markup=False)
    ANSWERS.print(f"page: {page}", markup=False)
    return 0


def _scenes(only: list[str] | None, scene: Path | None) -> dict[str, Any]:
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest
    from harness.bench.scene import load_scene
    from harness.experiment.subjects import objects

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


def _result(curve: Any, path: Path, page: Path) -> dict[str, Any]:
    from harness.cost.curve import front
    from harness.cost.file import summary

    conditions = []
    for condition in curve.conditions():
        points = curve.where(condition)
        best = {point.name for point in front(points)}
        conditions.append(
            {
                "condition": condition,
                "runs": max(len(point.samples) for point in points),
                "settings": [summary(point, point.name in best) for point in points],
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
