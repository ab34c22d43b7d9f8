"""A straight way that ends where something is met."""

from dataclasses import dataclass

from harness.basics.arrays import FloatArray
from harness.bench.station import Bench


@dataclass(frozen=True)
class SearchGuard:
    """How a way is followed that may end at any place.

    Attributes:
        speed: m/s.
        force: N of resistance that end it.
    """

    speed: float
    force: float


def meets(bench: Bench, axis: FloatArray, travel: float, guard: SearchGuard) -> bool:
    """Move along an axis until something resists; a long way in pieces, as the station limits a search.

    Args:
        bench: whose arm moves.
        axis: ``(3,)`` unit in base.
        travel: m.
        guard: how.

    Returns:
        False where nothing was met; the arm is then at the end of the way.
    """
    left, longest = travel, bench.station.arm.safety.travel
    while left > longest:
        if bench.arm.move_until_contact(axis, guard.speed, guard.force, longest):
            return True
        left -= longest
    return bench.arm.move_until_contact(axis, guard.speed, guard.force, left)
