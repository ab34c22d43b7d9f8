"""``touchstone demo``: the whole path once, on the mocked bench."""

from pathlib import Path
from typing import Annotated, Any

import typer

from harness.bench.experiments import DEFAULT_EXPERIMENT
from harness.commands import options
from harness.commands.output import CONSOLE
from harness.commands.run.run import RUNNABLE, Spacing, run

_OPTIONS: dict[str, dict[str, Any]] = {
    DEFAULT_EXPERIMENT: {"contacts": 4, "spacing": Spacing.SPREAD, "sense": "both"},
    "scale-estimation": {"contacts": 5},
    "shape-reconstruction": {"presses": 4, "set_": ["choose=active"]},
}
"""Of ``touchstone run``, by experiment: a short run that shows what it does."""


def demo(
    experiment: Annotated[
        str,
        typer.Argument(
            help=f"What to run: {', '.join(RUNNABLE)}.", metavar="NAME", callback=options.check_experiment
        ),
    ] = DEFAULT_EXPERIMENT,
    object_: Annotated[
        str, typer.Option("--object", help="An object of ours: mug, bowl, plate, pitcher, tray, wrench.")
    ] = "mug",
    objectfile: options.ObjectFileOption = None,
    level: options.LevelOption = None,
    bench: options.BenchOption = None,
    seed: options.Seed = 1,
    out: Annotated[Path | None, typer.Option(help="The run's folder.")] = None,
    json: options.Json = False,
) -> int:
    """Run an experiment on the mocked bench from end to end, by every sense that it has.

    A mocked UR5e presses a mocked GelSight on an object a few times; where sound is asked for it strikes
    it with a mocked hammer, and where a picture is, a mocked camera looks first. With --bench wires they
    are at the far ends of their cables (RTDE, HTTP, a serial line), and the drivers are those of a real
    bench; the readings are the same. The estimates are made from the recording alone. What they are
    compared with comes from the ObjectFile of the object that comes with the program: its networks stand for
    finite elements and rasteriser. Where there is none, or with --objectfile, or for an unknown shape,
    the object is a mesh.

    Try: touchstone demo shape-reconstruction
    """
    from harness.bench.scene_objectfile import shipped_objectfiles

    CONSOLE.print(
        "mocked bench: a UR5e, a GelSight and the other instruments that the run reads, with a reality gap"
    )
    folder: Path | None = None
    if objectfile is None and experiment != "shape-reconstruction":
        folder = shipped_objectfiles().get(object_)
    if folder is not None:
        CONSOLE.print(
            f"the object is the ObjectFile {folder}: its networks stand for finite elements and rasteriser. "
            f"`touchstone explain {object_}` says how far off they are",
            markup=False,
        )
    return run(
        experiment,
        object_=f"builtin:{object_}" if folder is None else str(folder),
        objectfile=objectfile,
        level=level,
        bench=bench,
        seed=seed,
        out=out,
        json=json,
        **_OPTIONS.get(experiment, {}),
    )
