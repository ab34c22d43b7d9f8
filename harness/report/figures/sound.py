"""Pictures of what was heard: a strike beside the model's, and each sense's posterior."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from harness.basics.arrays import FloatArray
from harness.report.figures.pictures import Heat, mark
from harness.report.figures.shading import Shot
from harness.report.figures.style import ANSWER, INK, SOFT, TRUTH, blank, styled
from harness.report.values import Missing, Posterior

FLOOR = -70.0
"""dB against a spectrogram's own loudest, below which nothing is told apart."""

_SPREAD = 30.0
_MARK = 70.0
_SENSE_WIDTH = 3.1
_TITLES = 0.5


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
        figure = blank(10.2, 3.5, "constrained")
        row = list(np.asarray(figure.subplots(1, 3, sharex=True, sharey=True)))
        _levels(row[0], times, frequencies, heard, "recorded", "magma", (FLOOR, 0.0))
        last = _levels(row[1], times, frequencies, rung, "simulated", "magma", (FLOOR, 0.0))
        figure.colorbar(last, ax=row[:2], label="dB", shrink=0.9, aspect=30)
        both = "recorded - simulated"
        apart = _levels(row[2], times, frequencies, heard - rung, both, "RdBu_r", (-_SPREAD, _SPREAD))
        figure.colorbar(apart, ax=row[2], label="dB", shrink=0.9, aspect=30)
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
) -> QuadMesh:
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
    return drawn


def senses_figure(
    shots: Sequence[Shot], by_sense: Mapping[str, Posterior | Missing], truth: FloatArray | None = None
) -> Figure:
    """Where each sense believes the contact to be: a column a sense, a row a view of the object.

    Args:
        shots: square views of the object; fewer than 500 pixels do.
        by_sense: posteriors by the sense's name, in order; a sense that has none leaves the object bare.
        truth: ``(3,)`` metres, object frame.

    Raises:
        ValueError: there is no sense, or no view.
    """
    if not by_sense or not shots:
        raise ValueError("a picture of the senses needs the posterior of one at least, and a view of it")
    with styled():
        high = _SENSE_WIDTH * len(shots) + _TITLES
        figure = blank(_SENSE_WIDTH * len(by_sense), high)
        grid = np.asarray(figure.subplots(len(shots), len(by_sense), squeeze=False))
        figure.subplots_adjust(0.0, 0.0, 1.0, 1.0 - _TITLES / high, 0.02, 0.02)
        for (sense, found), column in zip(by_sense.items(), grid.T, strict=True):
            _title(column[0], sense, found)
            for axes, shot in zip(column, shots, strict=True):
                _believed(axes, shot, found, truth)
    return figure


def _title(axes: Axes, sense: str, found: Posterior | Missing) -> None:
    said = "no answer" if isinstance(found, Missing) else f"90 % within {1e3 * found.credible90:.1f} mm"
    axes.set_title(f"{sense}\n{said}", fontsize=11, color=SOFT if isinstance(found, Missing) else INK)


def _believed(axes: Axes, shot: Shot, found: Posterior | Missing, truth: FloatArray | None) -> None:
    axes.set_axis_off()
    if isinstance(found, Missing):
        axes.imshow(shot.picture())
    else:
        axes.imshow(shot.picture(0, Heat(found)))
        mark(axes, shot, found.estimate, "P", ANSWER, _MARK)
    if truth is not None:
        mark(axes, shot, truth, "*", TRUTH, _MARK)
