"""One press in pictures: its height map, its colours, what it changed, and what a live camera saw of it."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.arrays import AnyArray, ByteArray, FloatArray
from harness.report.style import blank, styled
from harness.report.tiles import DIFFERENCE_GAIN, difference

_WIDTH, _TITLES = 3.6, 0.62


@dataclass(frozen=True, eq=False)
class TouchPictures:
    """What is shown of a press.

    Attributes:
        heights: ``(rows, columns)`` metres of indentation.
        image: ``(rows, columns, 3)`` RGB, simulated.
        background: the same of the untouched gel.
        live: the same, seen by a camera; None without.
        pitch: metres a pixel.
        words: under the height map, the picture, its change, the live picture, live against simulated, live
            against the background.
    """

    heights: FloatArray
    image: ByteArray
    background: ByteArray
    live: ByteArray | None
    pitch: float
    words: tuple[str, ...]


def touch_figure(shown: TouchPictures) -> Figure:
    """A row of the simulated press, and a row of the live one under it where there is one.

    Raises:
        ValueError: pictures of other shapes, or heights that are not finite.
    """
    _check(shown)
    rows, columns = shown.heights.shape
    down = 1 if shown.live is None else 2
    with styled():
        figure = blank(3 * _WIDTH + 0.9, down * (_WIDTH * rows / columns + _TITLES))
        figure.set_layout_engine("constrained")
        grid = np.asarray(figure.subplots(down, 3, squeeze=False))
        _heights(figure, grid[0, 0], shown)
        _picture(grid[0, 1], shown.image, "simulated", shown.words[1])
        _difference(grid[0, 2], shown.image, shown.background, "simulated - background", shown.words[2])
        if shown.live is not None:
            _picture(grid[1, 0], shown.live, "live", shown.words[3])
            _difference(grid[1, 1], shown.live, shown.image, "live - simulated", shown.words[4])
            _difference(grid[1, 2], shown.live, shown.background, "live - background", shown.words[5])
    return figure


def _heights(figure: Figure, axes: Axes, shown: TouchPictures) -> None:
    rows, columns = shown.heights.shape
    half = 0.5e3 * shown.pitch * np.array([columns, rows])
    low, high = min(0.0, float(shown.heights.min())), max(1e-6, float(shown.heights.max()))
    drawn = axes.imshow(
        1e3 * shown.heights,
        cmap="viridis",
        vmin=1e3 * low,
        vmax=1e3 * high,
        extent=(-half[0], half[0], half[1], -half[1]),
        interpolation="nearest",
    )
    axes.set_title("indentation", fontsize=10)
    axes.set_xlabel(f"gel x in mm\n{shown.words[0]}", fontsize=8)
    axes.set_ylabel("gel y in mm", fontsize=8)
    axes.tick_params(labelsize=7)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.9, aspect=24)
    bar.set_label("mm", fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _picture(axes: Axes, picture: AnyArray, title: str, words: str) -> None:
    axes.imshow(picture, interpolation="nearest")
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(words, fontsize=8)
    axes.set_xticks([])
    axes.set_yticks([])


def _difference(axes: Axes, of: ByteArray, less: ByteArray, title: str, words: str) -> None:
    _picture(axes, difference(of, less), f"{title}, x {DIFFERENCE_GAIN:g}", words)


def _check(shown: TouchPictures) -> None:
    wanted = (*shown.heights.shape, 3)
    pictures = [shown.image, shown.background, *([] if shown.live is None else [shown.live])]
    if any(picture.shape != wanted for picture in pictures) or not np.isfinite(shown.heights).all():
        raise ValueError(
            f"pictures of {[p.shape for p in pictures]} for finite heights of {shown.heights.shape}"
        )
    if len(shown.words) < (3 if shown.live is None else 6):
        raise ValueError(f"{len(shown.words)} captions; each picture has one")
