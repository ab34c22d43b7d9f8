"""Options that commands on a catalogue share."""

from pathlib import Path
from typing import Annotated

import typer

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
