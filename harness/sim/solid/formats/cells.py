"""Nodes and cells of a file of finite elements, before anything is done to them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from harness.basics.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one kind.

    Attributes:
        type: kind of the cells by meshio's names, e.g. ``"tetra10"``.
        data: ``(c, k)`` indices of nodes, from 0.
    """

    type: str
    data: IntArray


@dataclass(frozen=True, eq=False)
class CellFile:
    """Content of a file of finite elements.

    Attributes:
        points: ``(n, 2)`` or ``(n, 3)`` in the file's unit.
        cells: blocks of cells in the order of the file.
        point_sets: indices of nodes by the name of their set.
        notes: what of the file is used or left out, a sentence each.
        single: the file holds float32 coordinates.
    """

    points: FloatArray
    cells: tuple[CellBlock, ...]
    point_sets: Mapping[str, IntArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    single: bool = False
