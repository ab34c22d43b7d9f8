"""A painted surface that a page's reader turns by dragging: few faces, as base64 of small integers."""

import base64
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray
from harness.report.figures.fewer_faces import fewer_faces
from harness.report.figures.shape import KnownSurface, painted_colours

MOST_FACES = 14_000
"""Of a surface on a canvas, which paints them one by one."""

_STEPS = 32_000


@dataclass(frozen=True)
class TurnedSurface:
    """Arrays in base64, little endian; the surface's middle is their origin, z is up.

    Attributes:
        places: int16, three a vertex, in equal steps.
        faces: uint16, the three vertices of each.
        colours: uint8, red, green and blue of each vertex.
        marks: int16, three of each contact, in the same steps.
    """

    places: str
    faces: str
    colours: str
    marks: str


def turned_surface(shown: KnownSurface, most_faces: int = MOST_FACES) -> TurnedSurface:
    """A surface in the colours of its still picture.

    Args:
        shown: the surface, how well it is known, and its contacts.
        most_faces: that are kept; a surface of more is coarsened.
    """
    mesh, deviation = fewer_faces(shown.mesh, shown.deviation, most_faces)
    middle = mesh.bounds.mean(axis=0)
    step = max(float(np.abs(mesh.vertices - middle).max()), 1e-9) / _STEPS
    marks = np.clip((shown.contacts.reshape(-1, 3) - middle) / step, -_STEPS, _STEPS)
    colours = 255.0 * painted_colours(shown, deviation)
    return TurnedSurface(
        places=_base64(np.rint((mesh.vertices - middle) / step), "<i2"),
        faces=_base64(mesh.faces, "<u2"),
        colours=_base64(np.rint(colours), "u1"),
        marks=_base64(np.rint(marks), "<i2"),
    )


def _base64(values: AnyArray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode("ascii")
