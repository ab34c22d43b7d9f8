"""Errors against contacts and against seconds."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from harness.report.data import Curve
from harness.report.style import blank, styled

_COLOURS = ("#c2410c", "#5b616b", "#0f766e", "#1b3fae", "#9d6b00", "#8a2d79")


def error_chart(curves: tuple[Curve, ...], x_label: str, logarithmic_x: bool) -> Figure:
    """Errors in millimetres on a logarithmic scale; the first curve is drawn strong.

    Args:
        curves: at least one; errors of zero are drawn at the scale's lower end.
        x_label: with its unit.
        logarithmic_x: for seconds; contacts are counted.
    """
    with styled():
        figure = blank(6.4, 3.9)
        figure.set_layout_engine("constrained")
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
                color=_COLOURS[index % len(_COLOURS)],
                label=curve.name,
                zorder=3 if strong else 2,
            )
            for x, error, label in zip(curve.x, curve.error, curve.labels, strict=False):
                at = (x, max(error * 1e3, floor))
                axes.annotate(label, at, (5, 5), textcoords="offset points", fontsize=8)
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_ylabel("error in mm")
        axes.set_xlabel(x_label)
        if logarithmic_x:
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        else:
            axes.set_xticks(sorted({x for curve in curves for x in curve.x}))
        axes.grid(visible=True, which="major", color="#e6e8eb", lw=0.8)
        axes.set_axisbelow(True)
        axes.legend(frameon=False, fontsize=9)
    return figure


def _any(curves: tuple[Curve, ...]) -> bool:
    return any(error > 0.0 for curve in curves for error in curve.error)
