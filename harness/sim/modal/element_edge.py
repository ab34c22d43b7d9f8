"""Choose the default edge length of elements from the wavelengths of the requested modes.

A plate that twists carries shear along its faces, opposite on both; at its narrow sides, which are free,
that shear turns from one face to the other, and dies out inwards within about half of the wall. Where a
handle stands on a wall stress grows towards the crease. A cell that is as wide as the wall is thick is too
stiff in both, however short it is against the wave.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, row_keys
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.sim.modal.modal import bending_wave, default_edge
from harness.sim.solid.filled import filled
from harness.sim.solid.modal_kernels import EDGES
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra
from harness.sim.solid.walls import (
    enclosed_volume,
    flat_share,
    nearest_on_surface,
    thin_wall,
    wall_thickness,
)

_LAYER = 0.25
"""Thickness of the layer of cells at the rim, as a fraction of the wall. The ten modes of a plate of
100 x 80 x 4 mm, edges 3 mm, have an error of 1.6e-3 with 0.18 and 0.25, 1.75e-3 with 0.33, 3.0e-3 without."""

_NEAR = 0.5
"""Largest distance of a corner that counts as on the layer, as a fraction of it; avoids cutting slivers."""

_SHARP = 0.5
"""Cosine of the angle between faces that meet at a sharp edge: 60 degrees, and more."""

_DEEP = 2.0
"""Walls of material behind a face, above which it is no side of a wall."""


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


SHARE = 0.25
"""Of the shortest wave of bending or shear below the limit, an element's edge at most."""

FINE_SHARE = 0.14
"""Of the shortest wave of shear: solids are then within 1e-3 of their exact frequencies up to it."""

_FINE_BUDGET, _COUNTED_BUDGET = 1e5, 2.5e5
"""Unknowns, about, up to which edges are that short: for a limit, and where so many modes are asked for."""

_ACROSS = 0.45
"""Of the wall, an element's edge if the budget allows it."""

_BUDGET = 3e4
"""Unknowns, about, up to which elements become as small as the wall wants them."""

_BENT = 0.18
"""Of the geometric mean of the wall and the shortest wave of bending, an element's edge where the wall is
thin. An element follows bending to the second degree along the wall only; what it misses is shear,
``edge^2 / wave`` against the wall, squared in the energy."""

_BENT_SPARE = 2
"""Modes more than asked for, of whose waves the few lowest are as short."""

_BENT_BUDGET = 1e5
"""Unknowns, about, up to which they become that short where modes are counted; bent walls are filled with
two or three times as many."""

_BENT_UP_TO = 0.15
"""The same up to a limit of frequency, of the wave of bending there, which is known and not counted: a free
plate has a few more modes than its area holds of that wave, so that it is the longer of the two."""

_FLAT_BUDGET = 2.5e5
"""Unknowns, about, up to which they become that short up to a limit, if walls are flat; walls that are not
are filled with twice as many, in ten times the time: for them ``_BUDGET`` holds, and only rims are cut."""

_FLAT = 0.8
"""Share of its surface in few planes from which an object's walls are flat."""

_FLAT_UNKNOWNS = 62.0
"""Unknowns in a square of the edge's side, as filling a flat wall makes them that is no thicker, its rims
cut: 58 to 66 where edges are 1 to 1.5 walls long. A thicker one has more, as the root of its thickness."""

_RIM = 0.4
"""Of the wall, the edge above which rims are cut; the layer of a rim is about as wide."""

_WARPED = 0.3
"""Of the wall, an element's edge where a whole section may warp, as of a bar that twists: the twist of
a bar of 200 x 20 x 10 mm is off by 4e-3 with 0.45, by 7e-4 with 0.3."""

_WARPED_BUDGET = 7e4
"""Unknowns, about, up to which they come near to that: with many more, it is a shell, which bends first."""

_UNKNOWNS = 40.0
"""Unknowns in a cube of the edge's side, as filling makes them."""

_SPARE = 30
"""Modes more than asked for: the lowest bend, and so need shorter edges than their frequency says."""


def fine_edge(surface: Mesh, material: Material, limit: float, count: int | None) -> float:
    """Metres: small against the waves of what is asked for, and against the wall.

    Edges are ``FINE_SHARE`` of the shortest shear wave, or as near to it as a budget of unknowns
    allows; never above ``SHARE`` of the shortest wave, of bending too (``default_edge``); and short
    against the wall, or against it and the wave that bends it, as far as another budget allows.

    Args:
        surface: closed.
        material: of all of it.
        limit: Hz, the highest frequency asked for.
        count: modes asked for, the lowest; None for all up to the limit.
    """
    volume = enclosed_volume(surface)
    highest = limit
    if count is not None:
        highest = min(limit, weyl_frequency(surface, material, count + _SPARE, volume))
    budget = _FINE_BUDGET if count is None else _COUNTED_BUDGET
    short = max(FINE_SHARE * _shear_speed(material) / highest, _affordable(volume, budget))
    wall = thin_wall(surface, 0.5)
    # Short against the wall or, where that is thin, its waves too, as far as budgets allow.
    across = max(_WARPED * wall, _affordable(volume, _WARPED_BUDGET))
    if across > _ACROSS * wall:
        bent = _bent(surface, material, wall, volume, limit, count)
        across = max(_ACROSS * wall, min(bent, _affordable(volume, _BUDGET)))
    return float(min(default_edge(surface, material, highest, count, SHARE), short, across))


def weyl_frequency(surface: Mesh, material: Material, count: int, volume: float) -> float:
    """Hz below which a free solid has about ``count`` elastic modes.

    Weyl's law of an elastic body with the term of its free surface (Dupuis, Mazo and Onsager,
    J. Chem. Phys. 33, 1960). What is thin against the wave has more modes, which bend.

    Args:
        surface: closed.
        material: of all of it.
        count: above zero.
        volume: m^3 that the surface encloses.
    """
    shear = _shear_speed(material)
    # Squared ratio of the speeds of shear and pressure.
    ratio = (1.0 - 2.0 * material.poisson) / (2.0 * (1.0 - material.poisson))
    inside = 4.0 / 3.0 * np.pi * volume * (2.0 + ratio**1.5) / shear**3
    skin = np.pi / 4.0 * float(surface.face_areas.sum())
    skin *= (2.0 * ratio**2 - 3.0 * ratio + 3.0) / (1.0 - ratio) / shear**2
    # Of its three roots one is positive; the others' real parts are negative.
    return float(np.roots([inside, skin, 0.0, -float(count)]).real.max())


def finely_filled(
    surface: Mesh,
    material: Material,
    limit: float,
    count: int | None,
    store: Store | None,
    envelope: float | None = None,
) -> tuple[Tetrahedra, float, bool]:
    """A surface filled for the modes asked for: with ``fine_edge``, and cut at rims that it is long for.

    Args:
        surface: closed.
        material: of all of it.
        limit: Hz, the highest frequency asked for.
        count: modes asked for, the lowest; None for all up to the limit.
        store: where tetrahedra are kept; None to fill.
        envelope: m, how far cells may leave the surface; None for ``tetrahedralize``'s own.

    Returns:
        The tetrahedra, the edge aimed at in m, and whether they were kept.

    Raises:
        MeshRefused: a surface that cannot be filled.
    """
    edge = fine_edge(surface, material, limit, count)
    inside, kept = filled(surface, edge, store, envelope)
    wall = thin_wall(surface, 0.5)
    return (with_rim_layer(inside, wall) if edge > _RIM * wall else inside), edge, kept


def _bent(
    surface: Mesh, material: Material, wall: float, volume: float, limit: float, count: int | None
) -> float:
    """Metres: short against a thin wall and the wave that bends it, as far as budgets allow."""
    if count is not None:
        middle = 0.5 * float(surface.face_areas.sum())
        short = _BENT * np.sqrt(wall * float(np.sqrt(np.pi * middle / (count + _BENT_SPARE))))
        return float(max(short, _affordable(volume, _BENT_BUDGET)))
    if flat_share(surface) < _FLAT:
        return np.inf
    sides = float(surface.face_areas.sum()) - 2.0 * volume / wall
    wave = min(bending_wave(material, wall, limit), 4.0 * volume / sides if sides > 0.0 else np.inf)
    # Edge at which flat walls use about their budget of unknowns.
    square = _FLAT_UNKNOWNS * 0.5 * float(surface.face_areas.sum()) / _FLAT_BUDGET
    affordable = float(max(square**0.5, (square * wall**0.5) ** 0.4))
    return float(max(_BENT_UP_TO * np.sqrt(wall * wave), affordable))


def _affordable(volume: float, unknowns: float) -> float:
    return float(np.cbrt(_UNKNOWNS * volume / unknowns))


def _shear_speed(material: Material) -> float:
    return float(np.sqrt(material.young / (2.0 * (1.0 + material.poisson) * material.density)))


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


def _split(cut: _Cut, across: BoolArray) -> _Cut:
    """Cut every edge in two that is the longest to be cut in all cells that have it.

    All cells of an edge are cut at once, so that they still meet; what is left to cut is left for later.
    """
    ends = np.sort(cut.cells[:, EDGES], axis=2)
    _, first_of_pair, which = np.unique(row_keys(ends[across]), return_index=True, return_inverse=True)
    pairs = ends[across][first_of_pair]
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
