"""A surface filled once: the same tetrahedra whenever the same filling is asked for again.

fTetWild puts the faces of the surface in an order that it draws from the machine's entropy, which no
option of it changes: two fillings of one surface have other cells, and as many only about. Kept by what
they were made from, one machine has one answer.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.basics.store import Store, digest
from harness.sim.solid.modal_kernels import EDGES
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra, tetrahedralize

VERSION = 3
"""Raised with every change of how a surface is filled, so that what is kept is dropped."""

_LONGER = 1.25
"""Of the edge asked for, the edges' root mean square beyond which the surface is filled again."""

_STRICTER = 10.0
"""fTetWild's own default of the energy at which it stops; it takes about twice as long."""

_HALVINGS = 12
"""Of one edge at most: 4096 parts of it, finer than any field here needs."""


@dataclass
class FillingSeconds:
    """What a filling took."""

    wall: float = 0.0  #: s on the clock.
    cpu: float = 0.0  #: s of the processor.


def filled(
    mesh: Mesh,
    edge: float,
    store: Store | None,
    envelope: float | None = None,
    spent: FillingSeconds | None = None,
) -> tuple[Tetrahedra, bool]:
    """The tetrahedra of ``tetrahedralize``, from the store if they are there.

    Args:
        mesh: closed, outward, in metres.
        edge: m, longest edge aimed at.
        store: where they are kept; None to fill.
        envelope: m, how far cells may leave the surface, see ``tetrahedralize``; None for its own.
        spent: is given what filling took; of kept tetrahedra, what it took then.

    Returns:
        The tetrahedra, and whether they were kept.

    Raises:
        WrongUse: an edge or an envelope that cannot be.
        MeshRefused: a surface that cannot be filled.
    """
    own = [] if envelope is None else [float(envelope)]
    key = digest(["filled", VERSION, mesh.vertices, mesh.faces, float(edge), *own])
    kept = store.get(key) if store is not None else None
    if isinstance(kept, Mapping):
        if spent is not None:
            spent.wall, spent.cpu = kept["seconds"].tolist()
        return tetrahedra(kept["nodes"], kept["cells"]), True
    took = FillingSeconds() if spent is None else spent
    begun, worked = time.perf_counter(), time.process_time()
    found = tetrahedralize(mesh, edge, envelope)
    ends = found.nodes[found.cells[:, EDGES]]
    # Fill again if the edges are much longer than requested.
    if float(np.sqrt(((ends[:, :, 0] - ends[:, :, 1]) ** 2).sum(axis=2).mean())) > _LONGER * edge:
        found = tetrahedralize(mesh, edge, envelope, _STRICTER)
    took.wall, took.cpu = time.perf_counter() - begun, time.process_time() - worked
    if store is not None:
        seconds = np.array([took.wall, took.cpu])
        store.put(key, {"nodes": found.nodes, "cells": found.cells, "seconds": seconds})
    return found, False


def with_edges_below(mesh: Mesh, longest: float) -> Mesh:
    """The same surface, its edges halved until none is longer; a watertight surface stays watertight.

    Args:
        mesh: in metres.
        longest: m, of any edge; above zero, and no less than 1/4096 of the longest one there is.

    Returns:
        The mesh itself where all its edges are short enough.

    Raises:
        WrongUse: a length outside of that range.
    """
    ahead = mesh.corners[:, (1, 2, 0)]
    greatest = float(((ahead - mesh.corners) ** 2).sum(axis=2).max() ** 0.5)
    if not longest > greatest * 2.0**-_HALVINGS:
        raise WrongUse(
            f"edges of {greatest:.3g} m cannot be divided into parts of {longest!r} m; give a length above "
            f"{greatest * 2.0**-_HALVINGS:.3g} m"
        )
    if greatest <= longest:
        return mesh
    # Loaded by those alone whose mesh is too coarse.
    from trimesh.remesh import subdivide_to_size

    vertices, faces = subdivide_to_size(  # type: ignore[no-untyped-call]
        mesh.vertices, mesh.faces, longest, max_iter=2 * _HALVINGS
    )
    return Mesh(vertices, faces)
