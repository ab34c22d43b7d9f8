"""The look of any object that a scene can name: built in, or a mesh file with its colours."""

from pathlib import Path

import numpy as np

from harness.basics.errors import WrongUse
from harness.objects.albedo import print_of, print_places
from harness.objects.builtin import BUILTIN, MATERIALS, build
from harness.sim.light.appearance import CREASE, Appearance, smooth_normals
from harness.sim.light.appearance_read import read_appearance


def appearance_of(
    mesh: str,
    units: str | None,
    scale: float = 1.0,
    edge: float = 1.5e-3,
    crease: float = CREASE,
    up_axis: str | None = None,
) -> Appearance:
    """What an object looks like, in metres, in the object's frame.

    Args:
        mesh: a file, or ``builtin:`` and a name.
        units: of the file's numbers, "m", "cm", "mm" or "in"; None for a built-in object only.
        scale: factor on top of the unit, greater than zero.
        edge: m between vertices of a built-in object; half of what touch and sound take, since outlines
            show corners.
        crease: rad, as of ``appearance.smooth_normals``.
        up_axis: axis of the file that points up, as at intake.

    Raises:
        WrongUse: no such object or unit, or a scale or an edge that is none.
        MeshRefused: a file without a surface.
    """
    if not mesh.startswith(BUILTIN):
        if units is None:
            raise WrongUse(f"{mesh} has colours to be read and its unit is not known; say m, cm, mm or in")
        return read_appearance(Path(mesh), units, scale, crease, up_axis)
    return builtin_appearance(mesh.removeprefix(BUILTIN), scale, edge, crease)


def builtin_appearance(
    name: str, scale: float = 1.0, edge: float = 1.5e-3, crease: float = CREASE
) -> Appearance:
    """A built-in object with the print of its material; arguments and errors as in ``appearance_of``."""
    built = build(name, edge)
    shape = type(built)(built.vertices * scale, built.faces)
    count = len(shape.faces)
    return Appearance(
        shape,
        smooth_normals(shape, crease),
        np.ones((count, 3, 3)),
        print_places(shape),
        np.zeros(count, np.int64),
        (print_of(MATERIALS[name]),),
    )
