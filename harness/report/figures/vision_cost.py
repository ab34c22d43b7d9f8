"""What a picture errs against what it costs: a panel for each knob, all others at their default."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.basics.arrays import FloatArray
from harness.report.figures.marks import number_marks
from harness.report.figures.style import ANSWER, TOOL, blank, styled

_COLUMNS, _WIDE, _HIGH = 4, 3.3, 2.7


@dataclass(frozen=True)
class LevelMark:
    """One level of a knob.

    Attributes:
        level: for people.
        cost: of a picture, in the panel's unit; above zero.
        exact: dB from exact pictures; infinite where they are the same.
        many: dB from every sample of the same networks; likewise.
    """

    level: str
    cost: float
    exact: float
    many: float


@dataclass(frozen=True)
class Panel:
    """One knob.

    Attributes:
        knob: its name.
        unit: of the costs.
        marks: by their levels, in their order; one or more.
    """

    knob: str
    unit: str
    marks: tuple[LevelMark, ...]


def vision_cost_figure(panels: Sequence[Panel], title: str) -> Figure:
    """Error against cost of every knob; equal pictures have no decibels and are not drawn.

    Args:
        panels: one or more.
        title: above them.

    Raises:
        ValueError: no panel, or a cost that is not above zero.
    """
    if not panels or any(not mark.cost > 0.0 for panel in panels for mark in panel.marks):
        raise ValueError("give one panel or more, and costs above zero")
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    with styled():
        figure = blank(max(2, columns) * _WIDE, rows * _HIGH + 0.8)
        figure.set_layout_engine("constrained")
        every: list[Axes] = np.asarray(figure.subplots(rows, columns, squeeze=False)).ravel().tolist()
        drawn = [_draw(axes, panel) for axes, panel in zip(every, panels, strict=False)]
        for axes in every[len(panels) :]:
            axes.set_axis_off()
        figure.suptitle(title, fontsize=10)
        figure.legend(
            *every[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False
        )
        for axes, panel, at in zip(every, panels, drawn, strict=False):
            number_marks(figure, axes, at, [mark.level for mark in panel.marks if np.isfinite(mark.exact)])
    return figure


def _draw(axes: Axes, panel: Panel) -> FloatArray:
    """Both lines; where the marks are whose levels are to be named."""
    costs = np.array([mark.cost for mark in panel.marks])
    lines = []
    for label, colour, marker, decibels in (
        ("from exact pictures", ANSWER, "o", [mark.exact for mark in panel.marks]),
        ("from every sample of the same networks", TOOL, "s", [mark.many for mark in panel.marks]),
    ):
        shown = np.isfinite(decibels)
        lines.append(np.stack([costs, decibels], axis=1)[shown])
        axes.plot(*lines[-1].T, color=colour, marker=marker, ms=4, lw=0.8, label=label)
    axes.set_xlim(0.0, 1.15 * costs.max())
    axes.margins(y=0.15)
    axes.set_title(panel.knob, fontsize=9)
    axes.set_xlabel(panel.unit, fontsize=8)
    axes.set_ylabel("PSNR, dB", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(visible=True, color="#e6e8eb", lw=0.8)
    return lines[0]
