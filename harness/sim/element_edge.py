"""How long the edges of elements are where nobody says so: by the waves of the modes asked for."""

import numpy as np

from harness.materials import Material
from harness.mesh import Mesh
from harness.sim.modal import default_edge
from harness.sim.surface_measure import enclosed_volume, thin_wall

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
    against the wall as far as another budget allows.

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
    across = _across(thin_wall(surface, 0.5), volume)
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


def _across(wall: float, volume: float) -> float:
    """Metres: short against the wall, as far as budgets allow."""
    fine = max(_WARPED * wall, _affordable(volume, _WARPED_BUDGET))
    if fine <= _ACROSS * wall:
        return fine
    return max(_ACROSS * wall, _affordable(volume, _BUDGET))


def _affordable(volume: float, unknowns: float) -> float:
    """Metres of an edge with which filling ``volume`` makes about so many unknowns."""
    return float(np.cbrt(_UNKNOWNS * volume / unknowns))


def _shear_speed(material: Material) -> float:
    """Metres in a second."""
    return float(np.sqrt(material.young / (2.0 * (1.0 + material.poisson) * material.density)))
