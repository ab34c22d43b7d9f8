"""``touchstone compare``: a recording against an ObjectFile, the reference simulation and the twin."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result


def compare(
    run: options.RunFolder,
    objectfile: Annotated[
        Path | None,
        typer.Option(
            "--objectfile",
            help="ObjectFile of another object to compare with instead of the run's own: its folder, or "
            "the name of one that comes with the program.",
            metavar="FOLDER",
            callback=options.find_objectfile,
        ),
    ] = None,
    reference: Annotated[
        bool,
        typer.Option("--reference", help="Compare with the reference simulation too, beside the networks."),
    ] = False,
    json: options.Json = False,
) -> int:
    """Hold a run's readings against a model of its object; no bench is opened, and no answer is needed.

    The model stands where the scene says. For each sense it prints one verdict: fits, does not fit, or not
    comparable and why. A reading does not fit where it is farther from the model than the stated errors of
    place, tool, gel and sound allow; a right model is refused in one run of a hundred.

    To try: touchstone compare runs/... --objectfile objects/bowl
    """
    from harness import api

    print_result(api.compare(run, objectfile, reference), json)
    return 0
