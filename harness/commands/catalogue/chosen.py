"""What every command on a catalogue takes: the file, the folder of meshes, materials; read alike by all."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from harness.authoring.catalogue.rows import Catalogue, CatalogueRow, ExcludedRow

CatalogueFileArgument = Annotated[
    Path,
    typer.Argument(
        help="A .toml of [[object]] tables, or CSV; ObjectFolder's objects.csv as published.",
        metavar="CATALOGUE",
    ),
]
Meshes = Annotated[
    Path | None,
    typer.Option(help="Folder of the meshes; the catalogue's own if left out.", metavar="FOLDER"),
]
Materials = Annotated[
    list[str] | None,
    typer.Option("--material", help="Only objects of this material; again for more.", metavar="M"),
]
Folder = Annotated[Path, typer.Option("--out", help="Folder of the build.", metavar="FOLDER")]
Stages = Annotated[
    Path | None,
    typer.Option(
        help="Folder of stages that several builds share; OUT/stages if left out.", metavar="FOLDER"
    ),
]
Senses = Annotated[
    str, typer.Option(help="Some of audio, touch and vision, with commas between them.", metavar="S,S")
]


def read(
    catalogue: Path, meshes: Path | None, materials: list[str] | None
) -> "tuple[Catalogue, list[tuple[CatalogueRow, str]], tuple[ExcludedRow, ...]]":
    """The catalogue of the chosen materials, its rows with their meshes, and those that cannot be built.

    Raises:
        WrongUse: no such catalogue, or a material that is none.
    """
    from harness.authoring.catalogue.rows import of_materials, read_catalogue, with_meshes

    chosen = of_materials(read_catalogue(catalogue), materials or [])
    rows, without = with_meshes(chosen.rows, meshes or catalogue.parent)
    return chosen, rows, (*chosen.excluded, *without)
