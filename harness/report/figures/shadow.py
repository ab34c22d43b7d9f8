"""What ball presses leave over around their contacts: where shadows lie, if there are any."""

import numpy as np
from matplotlib.figure import Figure

from harness.basics.arrays import BoolArray, FloatArray
from harness.report.figures.style import INK, blank, styled

_SHOWN = 15.0
"""Grey levels at which the colours end."""

_COLOURS = ("red", "green", "blue")


def shadow_figure(
    directions: FloatArray, step: float, left_over: FloatArray, shaded: BoolArray, dark_sides: FloatArray
) -> Figure:
    """Three panels, direction to the right and distance upwards.

    Args:
        directions: ``(d,)`` rad, in the picture from the columns' direction towards the rows'.
        step: metres from sample to sample.
        left_over: ``(3, d, samples)`` grey levels along rays from the rim, red, green, blue.
        shaded: ``(3, d, samples)`` what is taken for a shadow.
        dark_sides: ``(3,)`` rad, where slopes turn from each light.
    """
    samples = left_over.shape[2]
    far = 1e3 * step * samples
    with styled():
        figure = blank(12.6, 3.4, "constrained")
        panels = np.asarray(figure.subplots(1, 3, sharey=True))
        for axes, name, left, cells, dark in zip(
            panels, _COLOURS, left_over, shaded, dark_sides, strict=True
        ):
            shown = axes.imshow(
                left.T,
                cmap="RdBu_r",
                vmin=-_SHOWN,
                vmax=_SHOWN,
                origin="lower",
                extent=(0.0, 360.0, 0.0, far),
                aspect="auto",
            )
            if cells.any():
                middles = (np.degrees(directions), far * (np.arange(samples) + 0.5) / samples)
                axes.contour(*middles, cells.T.astype(np.float64), levels=[0.5], colors=INK, linewidths=1.2)
            axes.axvline(np.degrees(dark), color=INK, lw=1.0, ls="--")
            axes.set_title(name, fontsize=10)
            axes.set_xlabel("direction in the picture, deg")
        panels[0].set_ylabel("from the rim, mm")
        figure.colorbar(shown, ax=panels, shrink=0.9, label="grey levels left over")
    return figure
