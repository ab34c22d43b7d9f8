"""A line into a large space begins outside all of it."""

import numpy as np
import pytest

from harness.basics.geometry import translation
from harness.basics.mesh import closed_hull
from harness.bench.sensor import GELSIGHT_R15
from harness.twin.bench import TwinBench
from harness.twin.motion import FARTHEST, STAND_OFF, stand_off_outside

TOOL = translation(np.array([0.0, 0.0, 0.12]))
SUPPORT = 0.25
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])


def space(height: float) -> TwinBench:
    """A block of 40 cm by 40 cm, in which the whole tool finds room."""
    ends = np.array([[-0.2, -0.2, 0.0], [0.2, 0.2, height]])
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    at = translation(np.array([-0.5, 0.0, SUPPORT]))
    return TwinBench("ur5e", TOOL, GELSIGHT_R15, closed_hull(corners), at)


@pytest.mark.parametrize("height", [0.1, 0.2, 0.3])
def test_a_tool_that_is_wholly_inside_is_not_outside(height: float) -> None:
    bench = space(height)
    base_from_gel = translation(np.array([-0.5, 0.0, SUPPORT + 0.01])) @ DOWN
    back = stand_off_outside(bench, base_from_gel)
    assert back is not None
    assert SUPPORT + 0.01 + back >= SUPPORT + height + bench.clearance
    assert not bench.tool_hits(translation(np.array([0.0, 0.0, back])) @ base_from_gel, press=False)


def test_there_is_none_where_the_space_is_larger_than_any_line() -> None:
    base_from_gel = translation(np.array([-0.5, 0.0, SUPPORT + 0.01])) @ DOWN
    assert stand_off_outside(space(FARTHEST + 0.1), base_from_gel) is None


def test_a_place_in_the_open_keeps_the_usual_stand_off() -> None:
    base_from_gel = translation(np.array([-0.5, 0.0, SUPPORT + 0.1])) @ DOWN
    assert stand_off_outside(space(0.1), base_from_gel) == STAND_OFF
