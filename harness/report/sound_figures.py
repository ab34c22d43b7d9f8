"""Pictures of what was heard: spectrograms, the peaks beside the modes, and each sense's posterior."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.arrays import FloatArray
from harness.report.pictures import Heat, Sides
from harness.report.shading import Shot
from harness.report.style import ANSWER, INK, SOFT, TRUTH, blank, styled
from harness.report.values import Posterior

FLOOR = -70.0
"""dB against a spectrogram's own loudest, below which nothing is told apart."""

_SPREAD = 30.0
_ROW_HEIGHT = 0.26
_LIFT = 3e-3


@dataclass(frozen=True)
class PeakRow:
    """One line of the mode table.

    Attributes:
        peak: Hz, a frequency that was heard.
        mode: Hz, the model's mode it is taken for; None where it is taken for none.
        weight: how much it counts in the answer, from 0.
    """

    peak: float
    mode: float | None
    weight: float


def spectrogram_pair(
    times: FloatArray, frequencies: FloatArray, recorded: FloatArray, simulated: FloatArray
) -> Figure:
    """A strike as it was heard, as the model rings at the answer, and the difference in dB.

    Levels are each drawn against the loudest of their own spectrogram, since the model's absolute
    level is an upper bound only. Where both lie below `FLOOR` the difference is drawn as none.

    Args:
        times: ``(n,)`` s from the strike.
        frequencies: ``(f,)`` Hz.
        recorded: ``(f, n)`` dB.
        simulated: ``(f, n)`` dB.

    Raises:
        ValueError: shapes do not agree, or a level is not finite.
    """
    for name, levels in (("recorded", recorded), ("simulated", simulated)):
        if levels.shape != (len(frequencies), len(times)) or not np.all(np.isfinite(levels)):
            raise ValueError(
                f"{name}: {levels.shape} levels for {len(frequencies)} frequencies and {len(times)} times, "
                "all finite"
            )
    heard, rung = (np.maximum(levels - levels.max(), FLOOR) for levels in (recorded, simulated))
    with styled():
        figure = blank(10.2, 3.5)
        figure.set_layout_engine("constrained")
        row = list(np.asarray(figure.subplots(1, 3, sharex=True, sharey=True)))
        for axes, levels, title in ((row[0], heard, "recorded"), (row[1], rung, "simulated")):
            _levels(axes, times, frequencies, levels, title, "magma", (FLOOR, 0.0))
        _levels(
            row[2], times, frequencies, heard - rung, "recorded - simulated", "RdBu_r", (-_SPREAD, _SPREAD)
        )
        row[0].set_ylabel("frequency in kHz")
        for axes in row:
            axes.set_xlabel("ms from the strike")
    return figure


def _levels(
    axes: Axes,
    times: FloatArray,
    frequencies: FloatArray,
    levels: FloatArray,
    title: str,
    colours: str,
    limits: tuple[float, float],
) -> None:
    drawn = axes.pcolormesh(
        1e3 * times,
        1e-3 * frequencies,
        levels,
        cmap=colours,
        vmin=limits[0],
        vmax=limits[1],
        shading="nearest",
        rasterized=True,
    )
    axes.set_title(title, fontsize=10)
    assert axes.figure is not None
    axes.figure.colorbar(drawn, ax=axes, label="dB", shrink=0.9)


def mode_table(rows: Sequence[PeakRow]) -> Figure:
    """Peaks that were heard beside the modes they are taken for, loudest claim first.

    Raises:
        ValueError: there is no row, or a frequency or weight is not above zero (weights: not below).
    """
    if not rows:
        raise ValueError("a mode table needs a peak; where none was heard, say so instead of drawing it")
    for row in rows:
        if not (row.peak > 0.0 and (row.mode is None or row.mode > 0.0) and 0.0 <= row.weight < np.inf):
            raise ValueError(f"{row}: frequencies must be above zero and the weight finite and not below")
    ordered = sorted(rows, key=lambda row: -row.weight)
    heaviest = max(ordered[0].weight, np.finfo(float).tiny)
    with styled():
        figure = blank(6.4, _ROW_HEIGHT * (len(ordered) + 1) + 0.2)
        axes = figure.add_axes((0.02, 0.0, 0.96, 1.0))
        axes.set_axis_off()
        axes.set_xlim(0.0, 1.0)
        axes.set_ylim(len(ordered) + 0.6, -0.6)
        _cells(axes, 0, ("peak in Hz", "mode in Hz", "difference", "weight"), SOFT)
        for line, row in enumerate(ordered, start=1):
            axes.barh(line, 0.21 * row.weight / heaviest, left=0.78, height=0.62, color="#cfd8f5")
            _cells(axes, line, (f"{row.peak:.0f}", *_matched(row), f"{row.weight:.3g}"), INK)
    return figure


def _matched(row: PeakRow) -> tuple[str, str]:
    if row.mode is None:
        return "none", ""
    return f"{row.mode:.0f}", f"{100.0 * (row.peak / row.mode - 1.0):+.2f} %"


def _cells(axes: Axes, line: int, cells: tuple[str, ...], colour: str) -> None:
    for right, cell in zip((0.16, 0.36, 0.58, 0.76), cells, strict=True):
        axes.text(right, line, cell, ha="right", va="center", fontsize=9, color=colour)


def senses_figure(sides: Sides, by_sense: Mapping[str, Posterior], truth: FloatArray | None = None) -> Figure:
    """Where each sense believes the contact to be, a column a sense, on the object from two sides.

    Args:
        sides: of `harness.report.pictures.object_sides`; fewer than 500 pixels do.
        by_sense: posteriors by the sense's name ("touch", "audio", "both"), in order.
        truth: ``(3,)`` metres, object frame.

    Raises:
        ValueError: there is no sense.
    """
    if not by_sense:
        raise ValueError("a picture of the senses needs the posterior of one at least")
    with styled():
        figure = blank(2.9 * len(by_sense), 6.1)
        grid = np.asarray(figure.subplots(2, len(by_sense), squeeze=False))
        figure.subplots_adjust(0.0, 0.0, 1.0, 0.92, 0.02, 0.02)
        for column, (sense, posterior) in enumerate(by_sense.items()):
            title = f"{sense}\n90 % within {1e3 * posterior.credible90:.1f} mm"
            grid[0, column].set_title(title, fontsize=10)
            heat = Heat(posterior)
            for axes, shot in zip(grid[:, column], sides.shots, strict=True):
                axes.imshow(shot.picture(0, heat))
                axes.set_axis_off()
                _mark(axes, shot, posterior.estimate, "P", ANSWER)
                if truth is not None:
                    _mark(axes, shot, truth, "*", TRUTH)
    return figure


def _mark(axes: Axes, shot: Shot, place: FloatArray, marker: str, colour: str) -> None:
    """A marker on the object; pale where it lies on the far side."""
    pixel = shot.camera.project(place[None])[0][0]
    strength = 0.25 if bool(shot.hidden(place[None], _LIFT)[0]) else 1.0
    axes.scatter(
        float(pixel[0]), float(pixel[1]), s=90.0, marker=marker, c=colour,
        edgecolors="white", linewidths=1.1, alpha=strength, zorder=5,
    )  # fmt: skip
