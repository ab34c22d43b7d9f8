"""Numbers beside the marks of a chart, kept off each other, and the key that says what they stand for."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from harness.basics.arrays import FloatArray
from harness.report.figures.style import SOFT

_SIZE = 8.0
_WIDE, _HIGH = 0.75, 1.35
"""Of a digit with the air about it, in its size."""

_MARK = 4.0
"""pt about a mark's middle that no number should cover."""

_LINE = 3.0
"""pt about a line that a number should not cover either, if that can be."""

_RINGS = (9.0, 15.0, 22.0, 30.0)
_WAYS = 12


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
        ways = _ways()
        prices = [
            _price(_box(point + way, wide, high), taken, frame) + 0.02 * float(np.hypot(*way)) for way in ways
        ]
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


def _ways() -> FloatArray:
    """``(w, 2)`` pt: where a number may go, nearest first, up and to the right first of all."""
    turns = np.pi / 4.0 + 2.0 * np.pi * np.arange(_WAYS) / _WAYS
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.concatenate([reach * ring for reach in _RINGS])


def _box(middle: FloatArray, wide: float, high: float) -> FloatArray:
    """``(2, 2)``: lower left and upper right corner."""
    half = np.array([0.5 * wide, 0.5 * high])
    return np.array([middle - half, middle + half])


def _price(box: FloatArray, taken: Sequence[FloatArray], frame: FloatArray) -> float:
    """How many square pt are covered twice, and much for leaving the frame."""
    others = np.array(taken)
    shared = np.minimum(box[1], others[:, 1]) - np.maximum(box[0], others[:, 0])
    covered = float(np.clip(shared, 0.0, None).prod(axis=1).sum())
    outside = np.clip(frame[0] - box[0], 0.0, None).sum() + np.clip(box[1] - frame[1], 0.0, None).sum()
    return covered + 20.0 * float(outside)
