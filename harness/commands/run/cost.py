"""``touchstone cost``: what accuracy costs, measured on this machine."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result, run_progress, warn


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
    where: options.WhereOption = None,
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
    from harness.tasks.measuring import measure_cost

    measured = measure_cost(
        context.info_name or "",
        range(first_seed, first_seed + seeds),
        run_progress,
        warn,
        only or (),
        scene,
        {"spacing": spacing, "yaw": yaw, "sense": None if sense is None else [sense]},
        where or (),
        gap,
        contacts or (),
        thorough,
        out,
    )
    print_result(measured, json)
    return 0
