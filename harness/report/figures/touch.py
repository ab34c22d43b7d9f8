"""One press in pictures: its height map, its colours, what it changed, and what a live camera saw of it."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.basics.arrays import ByteArray, FloatArray
from harness.report.figures.style import INK, blank, styled, titled_picture
from harness.report.figures.tiles import DIFFERENCE_GAIN, difference
from harness.sim.optics.depth_reading import DepthReading

_WIDTH, _TITLES = 3.6, 0.62

_DEPTH_WIDTH, _DEPTH_TITLES = 3.8, 0.7


@dataclass(frozen=True, eq=False)
class TouchPictures:
    """What is shown of a press."""

    heights: FloatArray  #: ``(rows, columns)`` metres of indentation.
    image: ByteArray  #: ``(rows, columns, 3)`` RGB, simulated.
    background: ByteArray  #: the same of the untouched gel.
    live: ByteArray | None  #: the same, seen by a camera; None without.
    pitch: float  #: metres a pixel.
    words: tuple[str, ...]
    """under the height map, the picture, its change, the live picture, live against simulated, live against
    the background."""
    name: str = "simulated"  #: source of heights and picture.
    reference: tuple[FloatArray, ByteArray] | None = None  #: heights and picture by the rasteriser.
    caption: str = ""  #: under all.


def touch_figure(shown: TouchPictures) -> Figure:
    """Plot a row of the press, and under it a row of the live picture or of the rasteriser's press.

    Raises:
        ValueError: pictures of other shapes, or heights that are not finite.
    """
    _check(shown)
    rows, columns = shown.heights.shape
    down = 1 if shown.live is None and shown.reference is None else 2
    with styled():
        figure = blank(3 * _WIDTH + 0.9, down * (_WIDTH * rows / columns + _TITLES), "constrained")
        grid = np.asarray(figure.subplots(down, 3, squeeze=False))
        axes = grid[0, 0]
        low, high = min(0.0, float(shown.heights.min())), max(1e-6, float(shown.heights.max()))
        _map(figure, axes, 1e3 * shown.heights, shown.pitch, (1e3 * low, 1e3 * high), "mm")
        axes.set_title("indentation", fontsize=10)
        axes.set_xlabel(f"gel x in mm\n{shown.words[0]}", fontsize=8)
        titled_picture(grid[0, 1], shown.image, shown.name, shown.words[1])
        _difference(grid[0, 2], shown.image, shown.background, f"{shown.name} - background", shown.words[2])
        if shown.live is not None:
            titled_picture(grid[1, 0], shown.live, "live", shown.words[3])
            _difference(grid[1, 1], shown.live, shown.image, "live - simulated", shown.words[4])
            _difference(grid[1, 2], shown.live, shown.background, "live - background", shown.words[5])
        elif shown.reference is not None:
            heights, image = shown.reference
            gap = 1e6 * (shown.heights - heights)
            largest = max(1e-3, float(np.abs(gap).max()))
            _map(figure, grid[1, 0], gap, shown.pitch, (-largest, largest), "um", "RdBu_r")
            grid[1, 0].set_title(f"indentation, {shown.name} - rasteriser", fontsize=10)
            titled_picture(grid[1, 1], image, "rasteriser", "")
            _difference(grid[1, 2], shown.image, image, f"{shown.name} - rasteriser", "")
        if shown.caption:
            figure.supxlabel(shown.caption, fontsize=8)
    return figure


def _map(
    figure: Figure,
    axes: Axes,
    values: FloatArray,
    pitch: float,
    limits: tuple[float, float],
    unit: str,
    colours: str = "viridis",
) -> None:
    rows, columns = values.shape
    half = 0.5e3 * pitch * np.array([columns, rows])
    drawn = axes.imshow(
        values,
        cmap=colours,
        vmin=limits[0],
        vmax=limits[1],
        extent=(-half[0], half[0], half[1], -half[1]),
        interpolation="nearest",
    )
    axes.set_xlabel("gel x in mm", fontsize=8)
    axes.set_ylabel("gel y in mm", fontsize=8)
    axes.tick_params(labelsize=7)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.9, aspect=24)
    bar.set_label(unit, fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _difference(axes: Axes, of: ByteArray, less: ByteArray, title: str, words: str) -> None:
    titled_picture(axes, difference(of, less), f"{title}, x {DIFFERENCE_GAIN:g}", words)


def _check(shown: TouchPictures) -> None:
    wanted = (*shown.heights.shape, 3)
    pictures = [shown.image, shown.background, *([] if shown.live is None else [shown.live])]
    if any(picture.shape != wanted for picture in pictures) or not np.isfinite(shown.heights).all():
        raise ValueError(
            f"pictures of {[p.shape for p in pictures]} for finite heights of {shown.heights.shape}"
        )
    if len(shown.words) < (3 if shown.live is None else 6):
        raise ValueError(f"{len(shown.words)} captions; each picture has one")


def depth_figure(shown: DepthReading) -> Figure:
    """Live picture, indentation in mm, and one standard deviation of it in micrometres.

    The contact is outlined; dots are where the slope was held or doubtful.
    """
    rows, columns = shown.height.shape
    half = 0.5e3 * shown.pitch * np.array([columns, rows])
    extent = (-half[0], half[0], half[1], -half[1])
    with styled():
        figure = blank(3 * _DEPTH_WIDTH + 1.2, _DEPTH_WIDTH * rows / columns + _DEPTH_TITLES, "constrained")
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
