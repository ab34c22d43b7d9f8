"""A search ends at a touch, and asks the arm for no longer a way than its station allows."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.skills.strike import SearchGuard, meets

LONGEST = 0.2
DOWN = np.array([0.0, 0.0, -1.0])


class Arm:
    """Moves on and on until ``surface`` m are behind it."""

    def __init__(self, surface: float) -> None:
        self._surface = surface
        self.gone = 0.0
        self.asked: list[float] = []

    def move_until_contact(self, direction: Any, speed: float, force: float, travel: float) -> bool:
        assert np.array_equal(direction, DOWN)
        assert (speed, force) == (0.02, 0.3)
        self.asked.append(travel)
        self.gone = min(self._surface, self.gone + travel)
        return self.gone == self._surface


def bench(arm: Arm) -> Any:
    safety = SimpleNamespace(travel=LONGEST)
    return SimpleNamespace(arm=arm, station=SimpleNamespace(arm=SimpleNamespace(safety=safety)))


@pytest.mark.parametrize("surface", [0.05, 0.25, 0.39, 1.0])
def test_a_long_way_is_searched_in_pieces_and_ends_at_the_touch(surface: float) -> None:
    arm = Arm(surface)
    assert meets(bench(arm), DOWN, 0.45, SearchGuard(0.02, 0.3)) == (surface < 0.45)
    assert max(arm.asked) <= LONGEST
    assert arm.gone == pytest.approx(min(surface, 0.45))


def test_a_short_way_is_one_search() -> None:
    arm = Arm(1.0)
    assert not meets(bench(arm), DOWN, 0.1, SearchGuard(0.02, 0.3))
    assert arm.asked == [0.1]
