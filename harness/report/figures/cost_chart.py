"""Error against seconds of every setting, the front marked; and error against the number of contacts."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.cost.curve import Point, front
from harness.report.figures.marks import key, number_marks
from harness.report.figures.style import SOFT, blank, plain_logarithm, styled

_COLOURS = ("#1b3fae", "#c2410c", "#0f766e", "#8a2d79", "#9d6b00")
_DASHES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"))
"""Line and mark of each round of the colours, so that no two of twenty curves look alike."""

_DOMINATED = 0.45
_TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)


def cost_chart(points: Sequence[Point], families: Sequence[str], title: str, stale: bool) -> Figure:
    """Every setting with its 90 % intervals; dominated ones pale, the front joined, numbered and named.

    Args:
        points: of one condition, at least one.
        families: the dials each combination of whose levels gets a colour.
        title: over the drawing.
        stale: whether the curve no longer holds; written across it.
    """
    best, unit = front(points), points[0].unit
    with styled():
        figure = blank(10.4, 4.9, "constrained")
        axes = figure.add_subplot()
        for number, name in enumerate(dict.fromkeys(family_of(p, families) for p in points)):
            mine = [point for point in points if family_of(point, families) == name]
            around, own = divmod(number, len(_COLOURS))
            look = _COLOURS[own], _DASHES[around % len(_DASHES)][1]
            _marks(axes, [p for p in mine if p not in best], *look, f"{name}, dominated", pale=True)
            _marks(axes, [p for p in mine if p in best], *look, f"{name}, on the front", pale=False)
        at = np.array([(p.seconds.value, unit.scale * p.error.value) for p in best])
        axes.plot(*at.T, color=SOFT, lw=1.0, zorder=1)
        if stale:
            axes.text(
                0.5, 0.5, "STALE", transform=axes.transAxes, fontsize=64, color="#c2410c", alpha=0.16,
                ha="center", va="center", rotation=18, fontweight="bold",
            )  # fmt: skip
        axes.set_title(title, fontsize=11)
        axes.set_xlabel("seconds of CPU time (geometric mean, 90 % interval)")
        axes.set_ylabel(unit.label)
        _logarithmic(axes)
        axes.legend(loc="best", frameon=False, fontsize=8)  # named: see charts.py
        key(axes, [f"{number}  {point.name}" for number, point in enumerate(best, start=1)])
        number_marks(figure, axes, at, [str(number) for number in range(1, len(best) + 1)])
    return figure


def family_of(point: Point, families: Sequence[str]) -> str:
    """The levels of some dials, for the legend; a dial that a point does not name is left out."""
    return ", ".join(str(point.levels[name]) for name in families if name in point.levels)


def contacts_chart(curves: Sequence[tuple[str, Sequence[tuple[int, Point]]]]) -> Figure:
    """Error and seconds of some settings against the number of contacts.

    Args:
        curves: by name of the setting: the number of contacts and the point measured with them.
    """
    with styled():
        figure = blank(8.2, 3.6, "constrained")
        left, right = figure.subplots(1, 2)
        for number, (name, points) in enumerate(curves):
            around, own = divmod(number, len(_COLOURS))
            colour, counts = _COLOURS[own], [count for count, _ in points]
            dash, mark = _DASHES[around % len(_DASHES)]
            for axes, values, scale in (
                (left, [p.error for _, p in points], 1e3),
                (right, [p.seconds for _, p in points], 1.0),
            ):
                middle = [scale * v.value for v in values]
                below = [scale * (v.value - v.low) for v in values]
                above = [scale * (v.high - v.value) for v in values]
                axes.errorbar(
                    counts,
                    middle,
                    yerr=(below, above),
                    marker=mark,
                    ls=dash,
                    color=colour,
                    capsize=2,
                    label=name,
                )
        for axes, said in ((left, "error in mm"), (right, "seconds of CPU time")):
            axes.set_yscale("log")
            plain_logarithm(axes.yaxis, _TICKS)
            axes.set_xticks(sorted({count for _, points in curves for count, _ in points}))
            axes.set_xlabel("contacts")
            axes.set_ylabel(said)
            axes.grid(visible=True, which="major", color="#e6e8eb", lw=0.8)
        figure.legend(
            *left.get_legend_handles_labels(), loc="outside lower center", frameon=False, fontsize=8
        )
    return figure


def _marks(axes: Axes, points: Sequence[Point], colour: str, mark: str, label: str, pale: bool) -> None:
    if not points:
        return
    scale = points[0].unit.scale
    x, y = [p.seconds.value for p in points], [scale * p.error.value for p in points]
    axes.errorbar(
        x,
        y,
        xerr=(
            [p.seconds.value - p.seconds.low for p in points],
            [p.seconds.high - p.seconds.value for p in points],
        ),
        yerr=(
            [scale * (p.error.value - p.error.low) for p in points],
            [scale * (p.error.high - p.error.value) for p in points],
        ),
        fmt=mark,
        ms=4 if pale else 8,
        mfc="white" if pale else colour,
        color=colour,
        alpha=_DOMINATED if pale else 1.0,
        elinewidth=0.7,
        label=label,
        zorder=2 if pale else 3,
    )


def _logarithmic(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        plain_logarithm(axis, _TICKS)
    axes.grid(visible=True, which="major", color="#e6e8eb", lw=0.8)
    axes.set_axisbelow(True)
