"""Places that options name: coordinates with or without their unit, or a vertex of the mesh."""

import math
from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import options

if TYPE_CHECKING:
    from harness.basics.mesh import Mesh
    from harness.sim.gel.press_pose import ContactPlace

Coordinates = tuple[str, str, str]
"""Of a point, each a number of metres or a length with its unit."""


VertexOption = Annotated[
    int | None, typer.Option("--vertex", help="Or at a vertex of mesh.ply, counted from 0.", metavar="N")
]
"""Of an ObjectFile's mesh, in place of coordinates."""


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


def pressed_place(mesh: "Mesh", contact: Coordinates | None, vertex: int | None) -> "ContactPlace":
    """Where ``--contact`` or ``--vertex`` says that a mesh is pressed.

    Raises:
        WrongUse: neither or both are given, or a coordinate that is none.
        OutOfDomain: the point is off the surface, or there is no such vertex.
    """
    import numpy as np

    from harness.basics.errors import OutOfDomain, WrongUse
    from harness.sim.gel.press_pose import contact_place

    if contact is not None and vertex is None:
        return contact_place(mesh, np.array(point("--contact", contact)))
    if vertex is not None and contact is None:
        count = len(mesh.vertices)
        if not 0 <= vertex < count:
            raise OutOfDomain(f"there is no vertex {vertex}; the mesh has {count}, say 0 to {count - 1}")
        return contact_place(mesh, mesh.vertices[vertex])
    raise WrongUse("say where it is pressed: either --contact X Y Z, or --vertex N")
