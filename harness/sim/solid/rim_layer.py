"""Cells cut along the sharp edges of thin walls, where stress changes within a layer no deeper than the wall.

A plate that twists carries shear along its faces, opposite on both; at its narrow sides, which are free,
that shear turns from one face to the other, and dies out inwards within about half of the wall. Where a
handle stands on a wall stress grows towards the crease. A cell that is as wide as the wall is thick is too
stiff in both, however short it is against the wave.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.sim.solid.modal_kernels import EDGES
from harness.sim.solid.surface_measure import nearest_on_surface, wall_thickness
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra

_LAYER = 0.25
"""Of the wall, how far inside its rim cells are cut: the ten modes of a plate of 100 x 80 x 4 mm are off by
1.6e-3 with 0.18 and 0.25 of it, by 1.75e-3 with 0.33, by 3.0e-3 without, at edges of 3 mm."""

_NEAR = 0.5
"""Of the layer, by which a corner may miss it and still count as on it, lest a sliver be cut off."""

_SHARP = 0.5
"""Cosine of the angle between faces that meet at a sharp edge: 60 degrees, and more."""

_DEEP = 2.0
"""Walls of material behind a face, above which it is no side of a wall."""


def rim_faces(surface: Mesh, wall: float) -> IntArray:
    """Which faces are at a sharp edge and have much more than a wall behind them.

    They are the narrow sides of walls, and the roots of what stands on them.

    Args:
        surface: closed, of faces no wider than the wall or so.
        wall: m, typical of the object.
    """
    faces = surface.faces
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, face = ends[order], order % len(faces)
    same = (ends[1:] == ends[:-1]).all(axis=1)
    normals = surface.face_normals
    cosine = np.einsum("ij,ij->i", normals[face[1:][same]], normals[face[:-1][same]])
    sharp = np.zeros(len(surface.vertices), dtype=np.bool_)
    sharp[ends[1:][same][cosine < _SHARP]] = True
    at_edge = sharp[surface.faces].any(axis=1)
    asked = np.flatnonzero(at_edge)
    middles = surface.corners[asked].mean(axis=1)
    return asked[wall_thickness(surface, middles, surface.face_normals[asked]) > _DEEP * wall]


def with_rim_layer(of: Tetrahedra, wall: float) -> Tetrahedra:
    """The same body, its cells cut a quarter of the wall inside of its rims.

    What the old cells could follow the new ones can, so that frequencies fall, and towards the exact ones.

    Args:
        of: whose surface is closed.
        wall: m, typical of the object.

    Raises:
        MeshRefused: a cut left a cell without volume.
    """
    rims = rim_faces(of.surface, wall)
    if len(rims) == 0:
        return of
    ends = of.nodes[of.cells[:, EDGES]]
    longest = float(np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2).max())
    # No edge that reaches into the layer ends beyond.
    reach = np.full(len(of.nodes), wall + longest)
    any_way = np.tile([0.0, 0.0, 1.0], (len(of.nodes), 1))
    places, found = nearest_on_surface(Mesh(of.nodes, of.surface.faces[rims]), of.nodes, any_way, reach)
    away = np.where(found >= 0, np.linalg.norm(places - of.nodes, axis=1), reach)
    cut = _Cut(of.nodes, of.cells, away / (_LAYER * wall))
    while (across := cut.across()).any():
        cut = _split(cut, across)
    return tetrahedra(cut.nodes, cut.cells)


@dataclass(frozen=True, eq=False)
class _Cut:
    """Cells that are being cut where a field over their corners is 1."""

    nodes: FloatArray  #: ``(n, 3)`` m.
    cells: IntArray  #: ``(c, 4)``.
    field: FloatArray  #: ``(n,)``, linear along edges.

    def across(self) -> BoolArray:
        """``(c, 6)``: which edges have one end within and one beyond."""
        beyond = np.where(np.abs(self.field - 1.0) > _NEAR, np.sign(self.field - 1.0), 0.0)
        ends = beyond[self.cells[:, EDGES]]
        return np.asarray(ends[..., 0] * ends[..., 1] < 0.0)


def _split(cut: _Cut, across: BoolArray) -> _Cut:
    """Cut every edge in two that is the longest to be cut in all cells that have it.

    All cells of an edge are cut at once, so that they still meet; what is left to cut is left for later.
    """
    ends = np.sort(cut.cells[:, EDGES], axis=2)
    pairs, which = np.unique(ends[across], axis=0, return_inverse=True)
    length = np.linalg.norm(cut.nodes[pairs[:, 0]] - cut.nodes[pairs[:, 1]], axis=1)
    place = np.empty(len(pairs), dtype=np.int64)
    place[np.argsort(-length, kind="stable")] = np.arange(len(pairs))
    rank = np.full(across.shape, len(pairs))
    rank[across] = place[which.reshape(-1)]
    edges = len(pairs)
    first = rank.min(axis=1)
    agreed = np.ones(edges + 1, dtype=np.bool_)
    agreed[edges] = False
    differing = (rank != first[:, None]) & (rank < edges)
    agreed[rank[differing]] = False
    split = np.flatnonzero(agreed[first])
    which, one, number = np.unique(first[split], return_index=True, return_inverse=True)
    pairs = ends[split, rank[split].argmin(axis=1)]
    low, high = pairs[one].T
    share = (1.0 - cut.field[low]) / (cut.field[high] - cut.field[low])
    made = cut.nodes[low] + share[:, None] * (cut.nodes[high] - cut.nodes[low])
    middle = (len(cut.nodes) + number)[:, None]
    halves = [np.where(cut.cells[split] == pairs[:, [end]], middle, cut.cells[split]) for end in (0, 1)]
    return _Cut(
        np.concatenate([cut.nodes, made]),
        np.concatenate([np.delete(cut.cells, split, axis=0), *halves]),
        np.concatenate([cut.field, np.ones(len(which))]),
    )
