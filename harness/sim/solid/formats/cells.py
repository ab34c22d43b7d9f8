"""Nodes and cells of a file of finite elements, before anything is done to them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused


@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one kind."""

    type: str  #: kind of the cells by meshio's names, e.g. ``"tetra10"``.
    data: IntArray  #: ``(c, k)`` indices of nodes, from 0.


@dataclass(frozen=True, eq=False)
class CellFile:
    """Content of a file of finite elements."""

    points: FloatArray  #: ``(n, 2)`` or ``(n, 3)`` in the file's unit.
    cells: tuple[CellBlock, ...]  #: blocks of cells in the order of the file.
    point_sets: Mapping[str, IntArray] = field(default_factory=dict)
    """indices of nodes by the name of their set."""
    notes: tuple[str, ...] = ()  #: what of the file is used or left out, a sentence each.
    single: bool = False  #: the file holds float32 coordinates.


def node_indices(named: IntArray, numbers: IntArray, order: IntArray, where: str) -> IntArray:
    """Convert the numbers by which a file names its nodes to their indices.

    Args:
        named: numbers that cells or sets name, any shape.
        numbers: ``(n,)`` number of each node.
        order: ``(n,)`` indices that sort ``numbers``.
        where: beginning of the refusal, e.g. "part.inp, line 12: an element names node".

    Raises:
        MeshRefused: a number that no node has.
    """
    ordered = numbers[order]
    at = np.minimum(np.searchsorted(ordered, named), max(len(ordered) - 1, 0))
    missing = named != ordered[at] if len(ordered) else np.ones(named.shape, dtype=np.bool_)
    if missing.any():
        raise MeshRefused(
            f"{where} {named[missing][0]}, which is not there; the file is cut short or damaged, "
            "export it again"
        )
    return np.asarray(order[at], dtype=np.int64)
