"""Which slopes presses have taught a table, and how well."""

import numpy as np
from matplotlib.figure import Figure

from harness.basics.arrays import BoolArray, FloatArray
from harness.report.figures.style import INK, blank, styled


def bins_figure(errors: FloatArray, reached: BoolArray, steepest: float) -> Figure:
    """Errors by slope upwards and direction to the right, and beside them which bins were reached.

    Args:
        errors: ``(slopes, directions)`` grey levels, standard error, root mean square over the channels.
        reached: ``(slopes, directions)`` whether presses reached a bin.
        steepest: rad, where the last supported slope ends.
    """
    rows, columns = errors.shape
    shown = max(int(np.ceil(steepest / (0.5 * np.pi) * (rows - 1))), 1)
    extent = (-180.0, 180.0, 0.0, 90.0 * shown / (rows - 1))
    error, support = errors[:shown, : columns - 1], reached[:shown, : columns - 1]
    with styled():
        figure = blank(12.6, 3.4, "constrained")
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
