"""Nodes moved from the flat faces of tetrahedra onto the surface that they stand for.

A flat face cuts the corner of a curved surface, and that error, not the element's, decides the
frequencies of round objects.
"""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.sim.solid.modal_mesh import QuadraticMesh, least_determinant, middles_of
from harness.sim.solid.surface_measure import nearest_on_surface

_REACH_OF_EDGE = 0.25
"""Of the shortest edge at a node: further away the surface is another part of it."""

_LEAST_COSINE = 0.5
_LEAST_SHARE = 0.2
"""Of a cell's straight volume that has to be left everywhere in it, or its nodes go back."""

_TRIALS = 6


def snapped(mesh: QuadraticMesh, surface: Mesh) -> QuadraticMesh:
    """The same cells with the nodes of their surface on ``surface`` where that is safe.

    A node stays where no face of ``surface`` near it looks its way. Where a cell would be bent
    too far, its nodes go half as far, then a quarter, and at last nowhere.

    Args:
        mesh: straight.
        surface: that it was made from.
    """
    corners = int(mesh.cells[:, :4].max()) + 1
    onto = _moved(mesh, surface, np.unique(mesh.faces[:, :3]))
    share = np.ones(len(mesh.nodes))
    straight = least_determinant(mesh)
    for trial in range(_TRIALS):
        base = mesh.nodes + share[:, None] * onto
        bent = _with_middles(mesh, base, corners)
        middles = np.unique(mesh.faces[:, 3:])
        aside = _moved(bent, surface, middles)
        nodes = bent.nodes + share[:, None] * aside
        trialled = QuadraticMesh(nodes, mesh.cells, mesh.faces)
        bad = least_determinant(trialled) < _LEAST_SHARE * straight
        if not bad.any():
            return trialled
        share[np.unique(mesh.cells[bad])] *= 0.5 if trial < _TRIALS - 2 else 0.0
    return mesh


def straightened(mesh: QuadraticMesh) -> QuadraticMesh:
    """The same cells, straight where bending turned them inside out: corners stay, middle nodes go back.

    Args:
        mesh: with corners whose straight cells are not inside out.
    """
    corners = int(mesh.cells[:, :4].max()) + 1
    straight = _with_middles(mesh, mesh.nodes, corners)
    loose = np.zeros(len(mesh.nodes), dtype=np.bool_)
    # A node that goes back bends its other cells, which may have to follow.
    while True:
        nodes = np.where(loose[:, None], straight.nodes, mesh.nodes)
        trialled = QuadraticMesh(nodes, mesh.cells, mesh.faces)
        bad = least_determinant(trialled) <= 0.0
        bad &= ~loose[mesh.cells[:, 4:]].all(axis=1)
        if not bad.any():
            return trialled
        loose[mesh.cells[bad, 4:]] = True


def _with_middles(mesh: QuadraticMesh, nodes: FloatArray, corners: int) -> QuadraticMesh:
    """Straight cells on moved corners."""
    moved = nodes.copy()
    moved[corners:] = middles_of(nodes, mesh.cells, len(nodes))[corners:]
    return QuadraticMesh(moved, mesh.cells, mesh.faces)


def _moved(mesh: QuadraticMesh, surface: Mesh, chosen: IntArray) -> FloatArray:
    """``(n, 3)`` m from each chosen node to the surface; zero for all others."""
    normals = Mesh(mesh.nodes, mesh.triangles).vertex_normals[chosen]
    reach = _REACH_OF_EDGE * _shortest_edges(mesh)[chosen]
    places, _ = nearest_on_surface(surface, mesh.nodes[chosen], normals, reach, _LEAST_COSINE)
    way = np.zeros_like(mesh.nodes)
    way[chosen] = places - mesh.nodes[chosen]
    return way


def _shortest_edges(mesh: QuadraticMesh) -> FloatArray:
    """``(n,)`` m, of the edges of the surface that a node lies on; infinite inside."""
    shortest = np.full(len(mesh.nodes), np.inf)
    for first, middle in ((0, 3), (1, 4), (2, 5)):
        a, b = mesh.faces[:, first], mesh.faces[:, (first + 1) % 3]
        length = np.linalg.norm(mesh.nodes[a] - mesh.nodes[b], axis=1)
        for node in (a, b, mesh.faces[:, middle]):
            np.minimum.at(shortest, node, length)
    return shortest
