"""Pieces of a mesh file as its format defines them, with their colours, and the limits of a file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused

Axis = Literal["x", "y", "z"]

MAX_TRIANGLES = 2_000_000
"""Triangles of a file after all its instances are placed: intake of more takes over 2 GB of memory."""

MAX_VERTICES = 3 * MAX_TRIANGLES
"""Vertices of a file whose triangles share none."""

MAX_PLACED = 20_000
"""Instances of a piece in a file: each costs some 0.1 ms, however few triangles it has."""

MAX_NODES = 200_000
"""Nodes visited in a scene graph, whose instances of instances can multiply without end."""


@dataclass(frozen=True, eq=False)
class TextureFile:
    """An encoded picture that a file names."""

    name: str  #: as the file states it.
    read: Callable[[], bytes]
    """returns its bytes; raises ``MeshRefused`` for a name outside the file's folder."""


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one material, placed in the file's frame."""

    vertices: FloatArray  #: ``(n, 3)`` in the file's unit.
    faces: IntArray  #: ``(m, 3)`` indices of vertices.
    tints: FloatArray | None = None
    """``(m, 3, 3)`` linear red, green, blue of each face's corners; None where the file states none."""
    places: FloatArray | None = None
    """``(m, 3, 2)`` (u, v) of each face's corners, v upwards; None without a texture."""
    picture: TextureFile | None = None  #: texture that multiplies the tints; None without one.


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh file's pieces, and what it declares."""

    parts: tuple[MeshPart, ...]  #: at least one, with at least one triangle together.
    metres: float | None = None
    """length of the file's unit in metres; None where neither file nor format states it."""
    up_axis: Axis | None = None  #: axis that points up; None where neither file nor format states it.
    notes: tuple[str, ...] = ()  #: content of the file that is not used, a sentence each.
    colour_notes: tuple[str, ...] = ()  #: the same about colours.


def merge_parts(parts: tuple[MeshPart, ...]) -> tuple[FloatArray, IntArray]:
    """Join the pieces: ``(n, 3)`` vertices and ``(m, 3)`` faces of all of them."""
    before = np.cumsum([0, *(len(part.vertices) for part in parts)])[:-1]
    faces = [part.faces + first for part, first in zip(parts, before, strict=True)]
    return (
        np.vstack([np.zeros((0, 3)), *(part.vertices for part in parts)]),
        np.vstack([np.zeros((0, 3), np.int64), *faces]),
    )


def require_triangles(count: int, name: str) -> None:
    """Raise ``MeshRefused`` if the file called ``name`` holds more than ``MAX_TRIANGLES`` triangles."""
    if count > MAX_TRIANGLES:
        raise MeshRefused(
            f"{name} holds {count:,} triangles with all its instances; at most {MAX_TRIANGLES:,} are read, "
            "reduce it"
        )


def require_placed(count: int, name: str) -> None:
    """Raise ``MeshRefused`` if the file called ``name`` places more than ``MAX_PLACED`` pieces."""
    if count > MAX_PLACED:
        raise MeshRefused(
            f"{name} places {count:,} pieces with all its instances; at most {MAX_PLACED:,} are read"
        )


def transform_part(part: MeshPart, matrix: FloatArray) -> MeshPart:
    """Place a piece by a ``(4, 4)`` affine matrix; a mirroring one turns the faces round."""
    vertices = part.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) >= 0.0:
        return MeshPart(vertices, part.faces, part.tints, part.places, part.picture)
    tints = None if part.tints is None else part.tints[:, ::-1]
    places = None if part.places is None else part.places[:, ::-1]
    return MeshPart(vertices, part.faces[:, ::-1], tints, places, part.picture)
