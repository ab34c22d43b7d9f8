"""The picture of costs: a panel a knob, nothing drawn of pictures that are the same."""

import math

import numpy as np
import pytest

from harness.report.figures.vision_cost import LevelMark, Panel, vision_cost_figure

PANEL = Panel(
    "step, voxels",
    "ms",
    (LevelMark("2", 5.0, 30.0, 40.0), LevelMark("1", 9.0, 33.0, 50.0), LevelMark("0", 20.0, 34.0, math.inf)),
)


def test_each_knob_has_a_panel_and_equal_pictures_are_left_out() -> None:
    figure = vision_cost_figure([PANEL] * 5, "title")
    shown = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_title() for axes in shown] == ["step, voxels"] * 5
    exact, many = shown[0].get_lines()
    assert np.asarray(exact.get_xdata()).tolist() == [5.0, 9.0, 20.0]
    assert np.asarray(many.get_ydata()).tolist() == [40.0, 50.0]
    assert [text.get_text() for text in shown[0].texts] == ["2", "1", "0"]


@pytest.mark.parametrize("panels", [[], [Panel("a", "ms", (LevelMark("1", 0.0, 1.0, 1.0),))]])
def test_nothing_to_draw_is_refused(panels: list[Panel]) -> None:
    with pytest.raises(ValueError, match="one panel or more"):
        vision_cost_figure(panels, "title")
