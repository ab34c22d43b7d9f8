"""``touchstone catalogue check``: what intake finds of every object, before anything is built."""

from typing import Annotated

import typer

from harness.commands import options
from harness.commands.catalogue import chosen
from harness.commands.output import print_result, share_progress


def check(
    catalogue: chosen.CatalogueFileArgument,
    meshes: chosen.Meshes = None,
    material: chosen.Materials = None,
    senses: chosen.Senses = "audio,touch",
    rows_only: Annotated[
        bool, typer.Option("--rows-only", help="Look at the catalogue's rows, and open no mesh.")
    ] = False,
    json: options.Json = False,
) -> int:
    """Report on every object: units, scale label against the mesh, openings, thin walls, implied mass.

    Nothing is written. A row that cannot be built is excluded with its reason, and does not stop the others.
    A scale label decides the unit of a mesh that does not state one. Exit code 0 where at least one object
    can be built, else 1.

    Try: touchstone catalogue check objects.csv --meshes meshes --material ceramic
    """
    from harness.tasks.catalogue import check_catalogue

    with share_progress(quiet=rows_only) as report:
        checked = check_catalogue(catalogue, meshes, material or (), senses, rows_only, report)
    print_result(checked, json)
    return 0 if checked.buildable else 1
