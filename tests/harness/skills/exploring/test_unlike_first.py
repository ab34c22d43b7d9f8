"""Lines that go where others have gone come last; nothing else changes their order."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, transform
from harness.skills.exploring.lines import unlike_first

DOWN, ASIDE = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)


def line(x: float, y: float, z: float, forward: tuple[float, float, float] = DOWN) -> FloatArray:
    return transform(frame_facing(np.array(forward), 0.3), np.array([x, y, z]))


LINES = [line(0.0, 0.0, 0.01), line(0.05, 0.0, 0.01), line(0.0, 0.0, 0.02, ASIDE), line(0.0, 0.05, 0.01)]


def order(*before: FloatArray) -> list[int]:
    found = unlike_first(LINES, before)
    return [next(k for k, line in enumerate(LINES) if line is one) for one in found]


def test_where_none_was_followed_they_stay_as_they_were() -> None:
    assert order() == [0, 1, 2, 3]


@pytest.mark.parametrize("height", [-0.1, 0.01, 0.3])
def test_one_that_was_followed_comes_last_wherever_along_it_the_other_was_given(height: float) -> None:
    assert order(line(0.004, -0.003, height)) == [1, 2, 3, 0]


def test_one_that_crosses_it_another_way_is_another() -> None:
    assert order(line(0.0, 0.0, 0.02, (0.0, 1.0, 0.0))) == [0, 1, 2, 3]
    assert order(line(0.0, 0.0, 0.02, (0.97, 0.24, 0.0))) == [0, 1, 3, 2]


def test_none_is_lost_where_all_were_followed() -> None:
    assert order(*LINES) == [0, 1, 2, 3]
