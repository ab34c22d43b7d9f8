"""Places that options name: coordinates with or without their unit, or a vertex of the mesh."""

import math
from typing import Annotated

import typer

from harness.commands import options

Coordinates = tuple[str, str, str]
"""Of a point, each a number of metres or a length with its unit."""


VertexOption = Annotated[
    int | None, typer.Option("--vertex", help="Or at a vertex of the mesh, counted from 0.", metavar="N")
]
"""Place of a mesh, instead of coordinates."""


def point(option: str, texts: Coordinates) -> tuple[float, float, float]:
    """``x, y, z`` in m of an option's three texts.

    Raises:
        WrongUse: naming the option, where one is neither a finite number nor a length.
    """
    x, y, z = (_coordinate(option, text) for text in texts)
    return x, y, z


def _coordinate(option: str, text: str) -> float:
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH

    try:
        value = float(text)
    except ValueError:
        return options.quantity(option, text, LENGTH)
    if not math.isfinite(value):
        raise WrongUse(f"{option} {text}: give a finite number of metres, or a length with its unit, as 40mm")
    return value
