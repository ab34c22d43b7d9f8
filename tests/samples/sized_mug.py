"""A mug in about as many unknowns as asked for, to measure how seconds grow."""

from harness.objects.household import build
from harness.sim.modal.modal import curved
from harness.sim.solid.tetrahedra import QuadraticMesh, tetrahedralize
from harness.sim.solid.walls import thin_wall

_EDGE = 3.9e-3
_UNKNOWNS = 108_000
_GROWTH = 2.2
"""Between a shell's two and a solid's three: one element through the wall, then more."""


def mug(unknowns: int) -> QuadraticMesh:
    """About so many unknowns, from 20 000 on; how many it became is for the caller to print."""
    surface = build("mug")
    edge = _EDGE * (_UNKNOWNS / unknowns) ** (1.0 / _GROWTH)
    filled = tetrahedralize(surface, edge, 0.2 * thin_wall(surface))
    return curved(filled, surface, filled)
