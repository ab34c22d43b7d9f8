"""What every command that looks at an object's networks is told, described once."""

from typing import Annotated

import typer

Three = tuple[float, float, float]

Camera = Annotated[
    Three | None,
    typer.Option(
        "--camera",
        help="Where the camera is, metres in the object's frame; else where all of it is seen.",
        metavar="X Y Z",
    ),
]
LookAt = Annotated[
    Three | None,
    typer.Option(
        "--look-at", help="What is in the middle, metres; else the middle of the object.", metavar="X Y Z"
    ),
]
Up = Annotated[
    Three | None,
    typer.Option("--up", help="What is up in the picture; else the object's z.", metavar="X Y Z"),
]
Light = Annotated[
    Three | None,
    typer.Option(
        "--light", help="Towards the lamp, object's frame; else over the left shoulder.", metavar="X Y Z"
    ),
]
Threads = Annotated[
    int | None,
    typer.Option("--threads", help="That share the work; as many as cores if left out.", min=1),
]
