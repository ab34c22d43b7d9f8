"""``touchstone tables``: what a paper would print, measured on the mocked bench."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result, run_progress, warn


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
    where: options.WhereOption = None,
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
    from harness.tasks.measuring import measure_table

    measured = measure_table(
        context.info_name or "",
        range(first_seed, first_seed + seeds),
        run_progress,
        warn,
        data,
        only or (),
        {"spacing": spacing, "yaw": yaw, "sense": None if sound is None else ["both" if sound else "touch"]},
        where or (),
        gap or (),
        set_ or (),
        workers,
        out,
        recordings,
    )
    print_result(measured, json)
    return 0
