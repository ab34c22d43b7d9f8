"""Solids that meet: at an edge or a point, each keeps a surface of its own; in a face, they are one."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.sim.solid.mesh_repair import RepairedSurface, bodies, boundary_edges

_SAME_ANGLE = 1e-6
"""rad between two faces about their edge that lie on each other."""


def take_apart(surface: RepairedSurface) -> None:
    """Give solids that touch in an edge, a point or a face a surface each, where each is closed by itself.

    Around an edge of more than two faces those are neighbours that have material between them, by the way
    that the file's faces turn. Where that does not make closed solids, nothing is changed.
    """
    solid = _solids(surface)
    count = int(solid.max()) + 1
    if count == int(bodies(surface).max()) + 1:
        return
    if any(len(boundary_edges(surface.faces[solid == k])) for k in range(count)):
        return
    keys = solid[:, None] * len(surface.vertices) + surface.faces
    used, faces = np.unique(keys, return_inverse=True)
    surface.vertices = surface.vertices[used % len(surface.vertices)]
    surface.faces = faces.reshape(-1, 3).astype(np.int64)
    surface.repairs.append(f"took {count} solids apart that meet in an edge, a point or a face")


def _solids(surface: RepairedSurface) -> IntArray:
    """``(m,)``: which solid each face bounds, from 0."""
    faces, count = surface.faces, len(surface.faces)
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = directed[:, 0] < directed[:, 1]
    _, edge = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True)
    owner, order = np.tile(np.arange(count), 3), np.argsort(edge.ravel(), kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(edge.ravel()[order]) > 0, True])
    lengths = np.diff(starts)
    plain = order[starts[:-1][lengths == 2]], order[starts[:-1][lengths == 2] + 1]
    pairs = [np.column_stack([owner[plain[0]], owner[plain[1]]])]
    for start, length in zip(starts[:-1][lengths > 2], lengths[lengths > 2], strict=True):
        around = order[start : start + length]
        joined = _with_material_between(_angles(surface, directed[around[0]], owner[around]), forward[around])
        pairs.append(owner[around][joined])
    joined_faces = np.concatenate(pairs)
    graph = coo_array((np.ones(len(joined_faces)), tuple(joined_faces.T)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _angles(surface: RepairedSurface, edge: IntArray, around: IntArray) -> FloatArray:
    """``(k,)`` in steps of ``_SAME_ANGLE``: where faces stand about their edge, lesser vertex to greater."""
    start, end = surface.vertices[edge.min()], surface.vertices[edge.max()]
    along = (end - start) / np.linalg.norm(end - start)
    corners = surface.faces[around]
    third = corners[(corners != edge[0]) & (corners != edge[1])]
    arms = surface.vertices[third] - start
    arms = arms - (arms @ along)[:, None] * along
    across = np.cross(along, arms[0])
    angles = np.arctan2(arms @ across, np.linalg.norm(arms[0]) * (arms @ arms[0]))
    steps = np.round(2.0 * np.pi / _SAME_ANGLE)
    return np.asarray(np.round(angles / _SAME_ANGLE) % steps)


def _with_material_between(angles: FloatArray, forward: BoolArray) -> IntArray:
    """``(p, 2)`` of faces about an edge, those that bound one material; none where they do not take turns.

    A face that runs forward along the edge has its material before it, one that runs backward behind it.
    """
    # Of two faces that lie on each other the one that ends material comes first.
    order = np.lexsort((~forward, angles))
    ends = forward[order]
    if len(order) % 2 or (ends == np.roll(ends, 1)).any():
        return np.zeros((0, 2), dtype=np.int64)
    begins = np.flatnonzero(~ends)
    return np.column_stack([order[begins], order[(begins + 1) % len(order)]])
