"""A surface filled once: the same tetrahedra whenever the same filling is asked for again.

fTetWild puts the faces of the surface in an order that it draws from the machine's entropy, which no
option of it changes: two fillings of one surface have other cells, and as many only about. Kept by what
they were made from, one machine has one answer.
"""

from collections.abc import Mapping

from harness.mesh import Mesh
from harness.sim.tetrahedra import Tetrahedra, tetrahedra, tetrahedralize
from harness.store import Store, digest

VERSION = 1
"""Raised with every change of how a surface is filled, so that what is kept is dropped."""


def filled(mesh: Mesh, edge: float, store: Store | None) -> tuple[Tetrahedra, bool]:
    """The tetrahedra of ``tetrahedralize``, from the store if they are there.

    Args:
        mesh: closed, outward, in metres.
        edge: m, longest edge aimed at.
        store: where they are kept; None to fill.

    Returns:
        The tetrahedra, and whether they were kept.

    Raises:
        WrongUse: an edge that cannot be.
        MeshRefused: a surface that cannot be filled.
    """
    key = digest(["filled", VERSION, mesh.vertices, mesh.faces, float(edge)])
    kept = store.get(key) if store is not None else None
    if isinstance(kept, Mapping):
        return tetrahedra(kept["nodes"], kept["cells"]), True
    found = tetrahedralize(mesh, edge)
    if store is not None:
        store.put(key, {"nodes": found.nodes, "cells": found.cells})
    return found, False
