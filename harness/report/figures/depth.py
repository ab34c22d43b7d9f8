"""A press read from a live picture: what the camera saw, how deep the gel is, and how sure that is."""

import numpy as np
from matplotlib.figure import Figure

from harness.report.figures.style import INK, blank, styled
from harness.sim.optics.depth_reading import DepthReading

_WIDTH, _TITLES = 3.8, 0.7


def depth_figure(shown: DepthReading) -> Figure:
    """Live picture, indentation in mm, and one standard deviation of it in micrometres.

    The contact is outlined; dots are where the slope was held or doubtful.
    """
    rows, columns = shown.height.shape
    half = 0.5e3 * shown.pitch * np.array([columns, rows])
    extent = (-half[0], half[0], half[1], -half[1])
    with styled():
        figure = blank(3 * _WIDTH + 1.2, _WIDTH * rows / columns + _TITLES, "constrained")
        live, height, sigma = np.asarray(figure.subplots(1, 3))
        live.imshow(shown.image, extent=extent)
        live.set_title("live", fontsize=10)
        drawn = height.imshow(1e3 * shown.height, cmap="viridis", extent=extent, interpolation="nearest")
        figure.colorbar(drawn, ax=height, shrink=0.85, label="mm")
        height.set_title("indentation", fontsize=10)
        drawn = sigma.imshow(1e6 * shown.sigma, cmap="magma", extent=extent, interpolation="nearest")
        figure.colorbar(drawn, ax=sigma, shrink=0.85, label="um")
        sigma.set_title("one standard deviation; dots: slope not trusted", fontsize=10)
        x, y = (shown.pitch * 1e3 * (np.arange(size) + 0.5 - 0.5 * size) for size in (columns, rows))
        if shown.contact.any() and not shown.contact.all():
            height.contour(
                x, y, shown.contact.astype(np.float64), levels=[0.5], colors="white", linewidths=1.0
            )
        doubtful = ~shown.trusted & shown.contact
        if doubtful.any():
            row, column = np.nonzero(doubtful)
            sigma.plot(x[column], y[row], ls="none", marker=".", ms=1.5, color="white")
        for axes in (live, height, sigma):
            axes.set_xlabel("gel x, mm", fontsize=8, color=INK)
        live.set_ylabel("gel y, mm", fontsize=8, color=INK)
    return figure
