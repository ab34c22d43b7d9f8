"""Which slopes presses have taught a table, and how well."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from harness.basics.arrays import BoolArray, FloatArray
from harness.report.figures.style import INK, blank, styled


@dataclass(frozen=True, eq=False)
class BinsFigure:
    """A table, bin by bin.

    Attributes:
        error: ``(slopes, directions)`` grey levels, standard error, root mean square over the channels.
        support: ``(slopes, directions)`` whether presses reached a bin.
        steepest: rad, where the last supported slope ends.
        reached: grey levels, the median of the bins that presses reached.
        filled: the same of those as steep that none reached; NaN where there is none.
    """

    error: FloatArray
    support: BoolArray
    steepest: float
    reached: float
    filled: float


def bins_figure(bins: BinsFigure) -> Figure:
    """Errors by slope upwards and direction to the right, and beside them which bins were reached."""
    rows, columns = bins.error.shape
    shown = max(int(np.ceil(bins.steepest / (0.5 * np.pi) * (rows - 1))), 1)
    extent = (-180.0, 180.0, 0.0, 90.0 * shown / (rows - 1))
    error, support = bins.error[:shown, : columns - 1], bins.support[:shown, : columns - 1]
    with styled():
        figure = blank(12.6, 3.4)
        figure.set_layout_engine("constrained")
        left, right = np.asarray(figure.subplots(1, 2, sharey=True))
        drawn = left.imshow(
            error,
            cmap="magma",
            vmin=0.0,
            vmax=float(np.quantile(error, 0.99)),
            origin="lower",
            extent=extent,
            aspect="auto",
        )
        figure.colorbar(drawn, ax=left, shrink=0.9)
        left.set_title("standard error, grey levels", fontsize=10)
        right.imshow(support, cmap="Blues", vmin=0.0, vmax=1.6, origin="lower", extent=extent, aspect="auto")
        right.set_title(f"reached by presses: {support.mean():.0%} of the bins", fontsize=10, color=INK)
        left.set_ylabel("slope, deg")
        for axes in (left, right):
            axes.set_xlabel("direction of the slope, deg")
    return figure
