"""``touchstone catalogue status`` and ``page``: what a build has made so far."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result

BuiltFolder = Annotated[Path, typer.Argument(help="The --out folder of a build.", metavar="FOLDER")]


def status(folder: BuiltFolder, json: options.Json = False) -> int:
    """Say of every object of a build whether it is built, how well, and if not why.

    A build may be running meanwhile. Exit code 0 where all objects are built, else 1.

    Try: touchstone catalogue status built
    """
    from harness.tasks.catalogue import catalogue_status

    found = catalogue_status(folder)
    print_result(found, json)
    return 0 if set(found.counts) <= {"built"} else 1


def page(
    folder: BuiltFolder,
    out: Annotated[
        Path | None, typer.Option(help="The page; FOLDER/catalogue.html if left out.", metavar="FILE.html")
    ] = None,
    json: options.Json = False,
) -> int:
    """Write one page of all objects of a build: a picture, modes and quality of each, and what failed.

    The page refers to nothing outside itself.

    Try: touchstone catalogue page built
    """
    from harness.tasks.catalogue import draw_catalogue

    options.require_files(("--out", out, ".html"))
    print_result(draw_catalogue(folder, out), json)
    return 0
