"""What a file of tetrahedra must be before it is solved; elements are named by number, from 1."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.sim.solid.modal_kernels import EDGES
from harness.sim.solid.modal_mesh import FACES, QuadraticMesh, least_determinant
from harness.sim.solid.tetrahedra import FLATTEST, fullness, joined_by_faces, signed_volumes

REGULAR = 6.0 * np.sqrt(2.0)
"""Times the fullness of a cell is its quality, 1 where it is regular."""

_POOR = 1e-3
"""Quality below which a cell is worth a word."""

_ASTRAY = 0.4
"""Of an edge, how far its middle node may lie from its middle; at a quarter along the edge the
element is singular, and no bend of a useful one is as deep."""

_REVERSED = np.array([0, 2, 1, 3, 6, 5, 4, 7, 9, 8])
"""The nodes of a cell from the other side: corners 1 and 2 change places."""

_COINCIDENT = 1e-9
_NAMED = 4


def named(chosen: BoolArray) -> str:
    """The numbers of the chosen elements, from 1; beyond four, how many more."""
    numbers = np.flatnonzero(chosen) + 1
    listed = ", ".join(str(number) for number in numbers[:_NAMED])
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"element{'s' if len(numbers) > 1 else ''} {listed}{more}"


def check_full(nodes: FloatArray, cells: IntArray) -> None:
    """Refuse flat cells.

    Raises:
        MeshRefused: with their numbers and the worst one's quality.
    """
    quality = fullness(nodes, cells[:, :4])
    if quality.min() < FLATTEST:
        raise MeshRefused(
            f"{named(quality < FLATTEST)} of {len(cells)} are flat (the worst quality is "
            f"{REGULAR * quality.min():.1e}, the least allowed {REGULAR * FLATTEST:.1e}, a regular one's 1): "
            "the stiffness would lose its digits; collapse them, or mesh the object again"
        )


def turned(nodes: FloatArray, cells: IntArray) -> tuple[IntArray, BoolArray]:
    """Cells of four or ten nodes, all positively oriented, and ``(c,)`` which were not."""
    reversed_ = signed_volumes(nodes, cells) < 0.0
    order = _REVERSED[: cells.shape[1]]
    return np.where(reversed_[:, None], cells[:, order], cells), reversed_


def check_overlap(cells: IntArray, reversed_: BoolArray) -> None:
    """Refuse oriented cells that lie on the same side of the face that they share.

    Args:
        cells: ``(c, 4)`` or more, positively oriented.
        reversed_: ``(c,)``, which had to be turned; of two that overlap, the one to blame if
            their neighbours were not.

    Raises:
        MeshRefused: with the numbers of the cells that are inside out.
    """
    faces = cells[:, FACES].reshape(-1, 3)
    even = (faces < np.roll(faces, -1, axis=1)).sum(axis=1) == 2
    keys = np.column_stack([np.sort(faces, axis=1), even])
    _, which, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    involved = (counts[which.ravel()] > 1).reshape(-1, 4).any(axis=1)
    if not involved.any():
        return
    blamed = involved & (reversed_ if 2 * int(reversed_.sum()) <= len(cells) else ~reversed_)
    wrong = named(np.asarray(blamed if blamed.any() else involved))
    raise MeshRefused(
        f"{wrong} of {len(cells)} are inverted: they overlap the elements beside them, so a node lies on "
        "the wrong side of a face; mesh the object again, or move the node back"
    )


def ordered_middles(nodes: FloatArray, cells: IntArray, said: list[str]) -> IntArray:
    """Ten-node cells with each middle node on its own edge.

    Formats differ in the order of the middle nodes. Where a node is far from its edge and one
    order puts all nodes of all cells onto theirs, that is the file's order.

    Raises:
        MeshRefused: there is no such order; the cells are named.
    """
    middles = nodes[cells[:, EDGES]].mean(axis=2)
    lengths = np.linalg.norm(nodes[cells[:, EDGES[:, 0]]] - nodes[cells[:, EDGES[:, 1]]], axis=2)

    def astray(tried: IntArray) -> BoolArray:
        gaps = np.linalg.norm(nodes[tried[:, 4:]] - middles, axis=2)
        found: BoolArray = (gaps > _ASTRAY * lengths).any(axis=1)
        return found

    if not astray(cells).any():
        return cells
    gaps = np.linalg.norm(nodes[cells[:, 4:]][:, :, None] - middles[:, None], axis=3)
    orders, counts = np.unique(gaps.argmin(axis=1), axis=0, return_counts=True)
    likely = orders[np.argmax(counts)]
    tried = np.concatenate([cells[:, :4], cells[:, 4:][:, likely]], axis=1)
    if astray(tried).any():
        bad = astray(cells) if astray(cells).sum() <= astray(tried).sum() else astray(tried)
        raise MeshRefused(
            f"{named(bad)} of {len(cells)} have a middle node far from the middle of its edge; check the "
            "order of the nodes (corners 1 to 4, then edges 12 23 13 14 24 34), or mesh the object again"
        )
    said.append(
        f"the middle nodes of the elements stood in the order {' '.join(str(5 + place) for place in likely)} "
        "instead of 5 6 7 8 9 10, and are put in order"
    )
    return tried


def check_shared(cells: IntArray) -> None:
    """Refuse ten-node cells that share an edge but not its middle node.

    Raises:
        MeshRefused: with the numbers of the cells.
    """
    ends = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    _, edge = np.unique(ends, axis=0, return_inverse=True)
    edge = edge.ravel()
    owner = np.zeros(int(edge.max()) + 1, dtype=np.int64)
    owner[edge] = cells[:, 4:].ravel()
    differs = (owner[edge] != cells[:, 4:].ravel()).reshape(-1, 6).any(axis=1)
    if differs.any():
        raise MeshRefused(
            f"{named(differs)} of {len(cells)} share an edge with others but not the node in its middle, so "
            "that the mesh is cracked there; merge coincident nodes and export it again"
        )


def check_curved(mesh: QuadraticMesh, said: list[str]) -> float:
    """The least quality of a cell; poor ones are said.

    Raises:
        MeshRefused: cells that their middle nodes turn inside out, by number.
    """
    straight = 6.0 * signed_volumes(mesh.nodes, mesh.cells)
    share = least_determinant(mesh) / straight
    if share.min() <= 0.0:
        raise MeshRefused(
            f"{named(share <= 0.0)} of {len(mesh.cells)} are turned inside out by their middle nodes (the "
            f"worst has {share.min():.2g} of its straight volume somewhere, which must be above 0); "
            "straighten them, or refine the mesh where it bends"
        )
    quality = REGULAR * fullness(mesh.nodes, mesh.cells) * np.minimum(share, 1.0)
    worst = float(quality.min())
    if worst < _POOR:
        said.append(
            f"{named(quality < _POOR)} of {len(mesh.cells)} are nearly flat (the worst quality is "
            f"{worst:.1e}, a regular one's 1); they stiffen the mesh around them a little"
        )
    return worst


def joints(mesh: QuadraticMesh) -> tuple[int, tuple[str, ...]]:
    """How many bodies touch nowhere, and what to say of them."""
    cells, count = mesh.cells[:, :4], int(mesh.cells[:, :4].max()) + 1
    ends = np.repeat(cells[:, :1], 3, axis=1).ravel(), cells[:, 1:].ravel()
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(count, count))
    bodies = int(connected_components(graph, directed=False)[0])
    said = []
    if bodies > 1:
        said.append(f"{bodies} separate bodies: each has six rigid motions, all left out")
        near = cKDTree(mesh.nodes).query_pairs(_COINCIDENT * float(np.ptp(mesh.nodes, axis=0).max()))
        if near:
            said.append(f"{len(near)} pairs of nodes coincide: merge them if the bodies are to be one")
    hinged = joined_by_faces(cells) - bodies
    if hinged > 0:
        said.append(
            f"{hinged} parts are joined to others at an edge or a point only: they may turn about it, and "
            "modes near 0 Hz are such turns"
        )
    return bodies, tuple(said)
