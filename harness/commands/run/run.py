"""``touchstone run``: an experiment on a bench, from the plan to the report."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from harness.bench.experiments import DEFAULT_EXPERIMENT, experiment_names
from harness.commands import options
from harness.commands.output import print_result, print_stop

RUNNABLE = experiment_names()


class Spacing(StrEnum):
    """How far apart contacts are."""

    CLOSE = "close"
    SPREAD = "spread"


class Yaw(StrEnum):
    """Whether the estimator knows the object's yaw."""

    KNOWN = "known"
    UNKNOWN = "unknown"


def run(
    experiment: Annotated[
        str | None,
        typer.Argument(
            help=f"What to run: {', '.join(RUNNABLE)}; {DEFAULT_EXPERIMENT} if left out.",
            metavar="NAME",
            callback=options.check_experiment,
        ),
    ] = None,
    station: options.StationOrOwn = None,
    scene: options.SceneOption = None,
    object_: options.Object = None,
    material: options.Material = None,
    units: options.Units = None,
    up_axis: options.UpAxis = None,
    wall: options.Wall = None,
    objectfile: options.ObjectFileOption = None,
    seed: options.Seed = None,
    gap: options.GapOption = None,
    bench: options.BenchOption = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A key of the experiment's table in the scene, as contacts=4; again for more.",
            metavar="KEY=VALUE",
        ),
    ] = None,
    contacts: Annotated[int | None, typer.Option(help="How many contacts.", min=1, max=100)] = None,
    presses: Annotated[
        int | None, typer.Option(help="How many presses of an object of unknown shape.", min=0, max=100)
    ] = None,
    spacing: Annotated[
        Spacing | None, typer.Option(help="close: within 25 mm of the last; spread: over the object.")
    ] = None,
    yaw: Annotated[Yaw | None, typer.Option(help="Whether the estimator knows the object's yaw.")] = None,
    sense: Annotated[
        str | None,
        typer.Option(
            help="touch: press only; both: strike each place too, and listen; or any of vision, audio and "
            "touch with commas between."
        ),
    ] = None,
    range_: Annotated[
        tuple[str, str] | None,
        typer.Option(
            "--range",
            help="The longest side that an object of unknown size may have, as 5cm 30cm.",
            metavar="LOW HIGH",
        ),
    ] = None,
    level: options.LevelOption = None,
    budget: options.Budget = None,
    error: options.ErrorWanted = None,
    out: Annotated[
        Path | None, typer.Option(help="The run's folder; a dated one under runs/ if left out.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            help="Continue this run folder at its first missing contact.", callback=options.check_run
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Run an experiment on a bench, or resume a run with --resume.

    The motion is rehearsed in the twin before anything moves. Each contact is on the disk before the
    next begins. The first Ctrl-C ends the run after the contact; the second stops the arm.

    Try: touchstone run contact-localization --station mock --scene scenes/mug_touch.toml
    """
    options.require_folders(("--out", out))
    from harness import api
    from harness.basics.quantities import LENGTH, TIME
    from harness.commands.run.watcher import TerminalWatcher
    from harness.tasks.runs import RunStopped
    from harness.tasks.scenes import SceneOptions

    keys = {"contacts": contacts, "presses": presses, "spacing": spacing, "yaw": yaw}
    wanted = SceneOptions(
        *(scene, object_, material, units, wall, objectfile, sense, range_, keys, tuple(set_ or ())),
        up_axis=up_axis,
    )
    try:
        made = api.run(
            experiment,
            wanted,
            station,
            levels=level or (),
            budget=options.positive("--budget", budget, TIME),
            error=options.positive("--error", error, LENGTH),
            seed=seed,
            gap=gap,
            bench=bench,
            out=out,
            resume=resume,
            watcher=TerminalWatcher(json),
        )
    except RunStopped as stop:
        return print_stop(stop, stop.folder, json)
    print_result(made, json)
    return 0
