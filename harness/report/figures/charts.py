"""Errors against contacts and against seconds."""

from types import MappingProxyType

import numpy as np
from matplotlib.figure import Figure

from harness.report.data import ErrorCurve
from harness.report.figures.marks import key, number_marks
from harness.report.figures.style import blank, plain_logarithm, styled

_COLOURS = ("#c2410c", "#5b616b", "#0f766e", "#1b3fae", "#9d6b00", "#8a2d79")
_OF = MappingProxyType(
    {"both": "#c2410c", "touch": "#0f766e", "audio": "#1b3fae", "geometry": "#5b616b", "particle": "#8a2d79"}
)
"""Colours of what a curve is by, the same in every chart of a report."""


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
            max(1e-2, 0.5 * min(e for c in curves for e in c.error if e > 0.0) * 1e3) if _any(curves) else 0.1
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


def _any(curves: tuple[ErrorCurve, ...]) -> bool:
    return any(error > 0.0 for curve in curves for error in curve.error)
