"""How long the edges of elements are where nobody says so: by the waves of the modes asked for."""

import numpy as np

from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.sim.modal.modal import bending_wave, default_edge
from harness.sim.solid.filled import filled
from harness.sim.solid.rim_layer import with_rim_layer
from harness.sim.solid.surface_measure import enclosed_volume, flat_share, thin_wall
from harness.sim.solid.tetrahedra import Tetrahedra

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
``edge^2 / wave`` against the wall, squared in the energy. The ten modes of 100 x 80 x 4 mm are off by 1.6e-3
with 0.21, by 5e-4 and 8e-4 (two fillings) with 0.18, by 5e-4 with 0.16, all with their rims cut."""

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
    """Metres of an edge with which filling ``volume`` makes about so many unknowns."""
    return float(np.cbrt(_UNKNOWNS * volume / unknowns))


def _shear_speed(material: Material) -> float:
    """Metres in a second."""
    return float(np.sqrt(material.young / (2.0 * (1.0 + material.poisson) * material.density)))
