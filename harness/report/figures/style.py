"""Type and colours that all drawings of a report share."""

from contextlib import AbstractContextManager
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from harness.basics.arrays import AnyArray

INK, SOFT, TRUTH, ANSWER, TOOL = "#22252b", "#5b616b", "#00796b", "#1b3fae", "#c2410c"
HEAT = LinearSegmentedColormap.from_list("heat", ["#f6d9a8", "#f59e42", "#dc3d2a", "#7a0f3c", "#3b0535"])
DPI = 140

_STYLE: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 10,
    "axes.edgecolor": "#9aa0a8",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "touchstone",
}


def styled() -> AbstractContextManager[None]:
    """Within it, drawings take the report's style."""
    return mpl.rc_context(_STYLE)


def blank(width: float, height: float, layout: Literal["constrained"] | None = None) -> Figure:
    """An empty white figure of ``width`` times ``height`` inches that needs no display."""
    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white", layout=layout)
    FigureCanvasAgg(figure)
    return figure


def titled_picture(axes: Axes, picture: AnyArray, title: str, words: str) -> None:
    """Show a picture pixel by pixel, with a title above, words below, and no ticks.

    Args:
        axes: to draw in.
        picture: ``(rows, columns, 3)`` RGB, or ``(rows, columns)``.
        title: above it.
        words: below it.
    """
    axes.imshow(picture, interpolation="nearest")
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(words, fontsize=8)
    axes.set_xticks([])
    axes.set_yticks([])


def plain_logarithm(axis: Axis, ticks: tuple[float, ...]) -> None:
    """Ticks of a logarithmic axis at these multiples of the powers of ten, written as plain numbers."""
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
