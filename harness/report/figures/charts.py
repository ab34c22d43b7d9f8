"""Charts of a report: errors against contacts and seconds, costs of settings, numbers beside marks."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from harness.basics.arrays import FloatArray
from harness.cost.curve import Point, front
from harness.report.figures.style import SOFT, blank, plain_logarithm, styled

_COLOURS = ("#c2410c", "#5b616b", "#0f766e", "#1b3fae", "#9d6b00", "#8a2d79")
_OF = MappingProxyType(
    {"both": "#c2410c", "touch": "#0f766e", "audio": "#1b3fae", "geometry": "#5b616b", "particle": "#8a2d79"}
)
"""Colours of what a curve is by, the same in every chart of a report."""

_COST_COLOURS = ("#1b3fae", "#c2410c", "#0f766e", "#8a2d79", "#9d6b00")
_DASHES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"))
"""Line and mark of each round of the colours, so that no two of twenty curves look alike."""

_DOMINATED = 0.45
_TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)

_SIZE = 8.0
_WIDE, _HIGH = 0.75, 1.35
"""Of a digit with the air about it, in its size."""

_MARK = 4.0
"""pt about a mark's middle that no number should cover."""

_LINE = 3.0
"""pt about a line that a number should not cover either, if that can be."""

_RINGS = (9.0, 15.0, 22.0, 30.0)
_WAYS = 12


@dataclass(frozen=True)
class ErrorCurve:
    """Errors against the number of contacts, or against seconds."""

    name: str  #: in the legend.
    x: tuple[float, ...]  #: contacts, or seconds.
    error: tuple[float, ...]  #: metres, one for each ``x``.
    labels: tuple[str, ...] = ()  #: next to each point; none if empty.
    by: str = ""  #: sense or method, a key of ``_OF`` with a colour of its own; empty for the next colour.


def error_chart(curves: tuple[ErrorCurve, ...], x_label: str, logarithmic_x: bool) -> Figure:
    """Errors in millimetres on a logarithmic scale; the first curve is drawn strong.

    Points that have labels are numbered, and the numbers explained beside the drawing.

    Args:
        curves: at least one; errors of zero are drawn at the scale's lower end.
        x_label: with its unit.
        logarithmic_x: for seconds; contacts are counted.
    """
    with styled():
        labels = [label for curve in curves for label in curve.labels]
        figure = blank(8.2 if labels else 6.4, 3.9, "constrained")
        axes = figure.add_subplot()
        floor = (
            max(1e-2, 0.5 * min(e for c in curves for e in c.error if e > 0.0) * 1e3)
            if any(error > 0.0 for curve in curves for error in curve.error)
            else 0.1
        )
        for index, curve in enumerate(curves):
            strong = index == 0
            axes.plot(
                curve.x,
                np.maximum(np.array(curve.error) * 1e3, floor),
                marker="o" if strong else ".",
                lw=2.2 if strong else 1.2,
                ls="-" if strong else "--",
                color=_OF.get(curve.by, _COLOURS[index % len(_COLOURS)]),
                label=curve.name,
                zorder=3 if strong else 2,
            )
        axes.set_yscale("log")
        plain_logarithm(axes.yaxis, (1.0, 2.0, 5.0))
        axes.set_ylabel("error in mm")
        axes.set_xlabel(x_label)
        if logarithmic_x:
            axes.set_xscale("log")
            plain_logarithm(axes.xaxis, (1.0, 2.0, 3.0, 5.0))
        else:
            axes.set_xticks(sorted({x for curve in curves for x in curve.x}))
        axes.grid(visible=True, which="major", color="#e6e8eb", lw=0.8)
        axes.set_axisbelow(True)
        # Named, "best" is looked for as long as it takes; left out, a slow machine is warned of.
        axes.legend(loc="best", frameon=False, fontsize=9)
        if labels:
            at = np.array(
                [
                    (x, max(1e3 * e, floor))
                    for c in curves
                    if c.labels
                    for x, e in zip(c.x, c.error, strict=True)
                ]
            )
            key(axes, [f"{number}  {label}" for number, label in enumerate(labels, start=1)])
            number_marks(figure, axes, at, [str(number) for number in range(1, len(labels) + 1)])
    return figure


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
            around, own = divmod(number, len(_COST_COLOURS))
            look = _COST_COLOURS[own], _DASHES[around % len(_DASHES)][1]
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
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            plain_logarithm(axis, _TICKS)
        axes.grid(visible=True, which="major", color="#e6e8eb", lw=0.8)
        axes.set_axisbelow(True)
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
            around, own = divmod(number, len(_COST_COLOURS))
            colour, counts = _COST_COLOURS[own], [count for count, _ in points]
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


def number_marks(figure: Figure, axes: Axes, marks: FloatArray, names: Sequence[str]) -> None:
    """Write a number beside each mark, where it covers no mark, no line and no other number if that can be.

    Args:
        figure: laid out; what is written here does not change its layout.
        axes: that the marks are in, its limits final.
        marks: ``(n, 2)`` in the axes' units.
        names: ``(n,)`` what to write.
    """
    figure.draw_without_rendering()
    at = axes.transData.transform(marks) * 72.0 / figure.dpi
    frame = np.asarray(axes.get_window_extent().get_points()) * 72.0 / figure.dpi
    taken = [_box(point, 2.0 * _MARK, 2.0 * _MARK) for point in at]
    taken += [_box(point, _LINE, _LINE) for line in axes.lines for point in _along(line, axes, figure)]
    for number, (mark, point, name) in enumerate(zip(marks, at, names, strict=True)):
        wide, high = _WIDE * _SIZE * len(name), _HIGH * _SIZE
        turns = np.pi / 4.0 + 2.0 * np.pi * np.arange(_WAYS) / _WAYS
        ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        ways = np.concatenate([reach * ring for reach in _RINGS])
        # Cost: overlap in square pt, a large penalty outside the frame, a small one for the distance.
        prices, others = [], np.array(taken)
        for way in ways:
            box = _box(point + way, wide, high)
            shared = np.minimum(box[1], others[:, 1]) - np.maximum(box[0], others[:, 0])
            covered = float(np.clip(shared, 0.0, None).prod(axis=1).sum())
            outside = (
                np.clip(frame[0] - box[0], 0.0, None).sum() + np.clip(box[1] - frame[1], 0.0, None).sum()
            )
            prices.append(covered + 20.0 * float(outside) + 0.02 * float(np.hypot(*way)))
        way = ways[int(np.argmin(prices))]
        taken.append(_box(point + way, wide, high))
        note = axes.annotate(
            name, (float(mark[0]), float(mark[1])), (float(way[0]), float(way[1])),
            textcoords="offset points", fontsize=_SIZE, fontweight="bold", ha="center", va="center",
            arrowprops={"arrowstyle": "-", "lw": 0.6, "color": SOFT, "shrinkA": 1.0, "shrinkB": 3.0},
            zorder=5 + number, path_effects=[withStroke(linewidth=2.0, foreground="white")],
        )  # fmt: skip
        note.set_in_layout(False)


def key(axes: Axes, lines: Sequence[str]) -> None:
    """Say beside the axes what each number stands for."""
    axes.text(
        1.02, 1.0, "\n".join(lines), transform=axes.transAxes, fontsize=7.5, ha="left", va="top",
        linespacing=1.45,
    )  # fmt: skip


def _along(line: Line2D, axes: Axes, figure: Figure) -> FloatArray:
    """``(n, 2)`` pt: places along a drawn line, close enough to keep a number off it."""
    if line.get_linestyle() == "None":
        return np.zeros((0, 2))
    corners = axes.transData.transform(np.asarray(line.get_xydata())) * 72.0 / figure.dpi
    if len(corners) < 2:
        return corners
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    steps = np.arange(0.0, lengths[-1], _LINE)
    return np.stack([np.interp(steps, lengths, corners[:, axis]) for axis in range(2)], axis=1)


def _box(middle: FloatArray, wide: float, high: float) -> FloatArray:
    """``(2, 2)``: lower left and upper right corner."""
    half = np.array([0.5 * wide, 0.5 * high])
    return np.array([middle - half, middle + half])
