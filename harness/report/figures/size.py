"""Figures of a size: posterior density, outline, resonances and contacts."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.basics.arrays import ByteArray, FloatArray
from harness.report.figures.style import ANSWER, INK, SOFT, TOOL, TRUTH, blank, plain_logarithm, styled

_COLOURS = {"vision": "#8a2d79", "audio": ANSWER, "touch": TRUTH, "fused": INK}
_AROUND = 0.35
_CLOSE = 0.15


def beliefs_figure(
    sizes: FloatArray, beliefs: Mapping[str, FloatArray], asked: tuple[float, float], true: float | None
) -> Figure:
    """The density of each sense over the size, each to its own greatest.

    Args:
        sizes: ``(n,)`` m.
        beliefs: ``(n,)`` densities by sense, ``"fused"`` among them.
        asked: m, from and to, that was asked about.
        true: m; None where nobody knows.
    """
    with styled():
        figure = blank(8.2, 3.4, "constrained")
        whole, near = figure.subplots(1, 2, sharey=True)
        for axes in (whole, near):
            for name, density in beliefs.items():
                axes.plot(
                    1e2 * sizes,
                    density / density.max(),
                    color=_COLOURS.get(name, SOFT),
                    lw=2.4 if name == "fused" else 1.4,
                    label=name,
                    zorder=3 if name == "fused" else 2,
                )
            if true is not None:
                axes.axvline(1e2 * true, color=TOOL, lw=1.2, ls="--", label="true (mock)")
            axes.set_xlabel("longest side in cm")
        for end in asked:
            whole.axvline(1e2 * end, color=SOFT, lw=0.8, ls=":")
        whole.set_xscale("log")
        plain_logarithm(whole.xaxis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
        whole.set_xlim(1e2 * sizes[0], 1e2 * sizes[-1])
        whole.set_title("searched sizes (dotted: requested range)", fontsize=9, loc="left")
        middle = 1e2 * sizes[int(beliefs["fused"].argmax())]
        near.set_xlim((1.0 - _CLOSE) * middle, (1.0 + _CLOSE) * middle)
        near.set_title("near the answer", fontsize=9, loc="left")
        whole.set_ylabel("density, greatest = 1")
        near.legend(loc="upper right", frameon=False, fontsize=8)
    return figure


def outline_figure(picture: ByteArray, seen: FloatArray, fitted: FloatArray | None) -> Figure:
    """The outline that was read, and the model's at the size found, on the picture about the object.

    Args:
        picture: ``(rows, columns, 3)`` RGB.
        seen: ``(n, 2)`` px, corners of the hull of the object's pixels.
        fitted: ``(m, 2)`` px, of the model's; None where none fits.
    """
    low, high = seen.min(axis=0), seen.max(axis=0)
    margin = _AROUND * float((high - low).max())
    with styled():
        figure = blank(6.4, 4.8, "constrained")
        axes = figure.add_subplot()
        axes.imshow(picture, interpolation="nearest", extent=(0, picture.shape[1], picture.shape[0], 0))
        _ring(axes, seen, TOOL, "hull of what the camera sees", 2.6)
        if fitted is not None:
            _ring(axes, fitted, ANSWER, "the model at the estimated size", 1.2)
        axes.set_xlim(max(0.0, low[0] - margin), min(picture.shape[1], high[0] + margin))
        axes.set_ylim(min(picture.shape[0], high[1] + margin), max(0.0, low[1] - margin))
        axes.set_xticks([])
        axes.set_yticks([])
        axes.legend(loc="upper right", frameon=True, framealpha=0.8, fontsize=8)
    return figure


def resonances_figure(recorded: FloatArray, modelled: FloatArray, band: tuple[float, float]) -> Figure:
    """Plot recorded peaks above the model's modes at the estimated size, over one axis of frequency.

    Args:
        recorded: ``(p, 2)`` Hz and dB re 1 Pa/N.
        modelled: ``(m, 2)`` Hz and dB, as ``recorded``.
        band: lowest and highest frequency in Hz that the strikes excited.
    """
    with styled():
        figure = blank(8.2, 3.6, "constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        for axes, lines, colour, title in (
            (above, recorded, TOOL, "recorded"),
            (below, modelled, ANSWER, "model at the estimated size"),
        ):
            inside = (lines[:, 0] > 0.5 * band[0]) & (lines[:, 0] < 1.5 * band[1])
            floor = float(lines[inside, 1].min()) - 6.0 if inside.any() else -60.0
            axes.vlines(lines[inside, 0], floor, lines[inside, 1], color=colour, lw=1.6)
            axes.set_title(title, fontsize=9, loc="left")
            axes.set_ylabel("dB re 1 Pa/N")
            axes.axvspan(*band, color="#f3f1ec", zorder=0)
        below.set_xlabel("Hz (shaded: what the hammer excited)")
    return figure


def spectrogram_figure(frequencies: FloatArray, levels: Mapping[str, FloatArray]) -> Figure:
    """How loudly bands ring, in one line for each stretch of time after the strike.

    Args:
        frequencies: ``(b,)`` Hz, the bands' middles.
        levels: ``(b,)`` dB below the loudest by stretch of time, not a number where nothing was excited.
    """
    with styled():
        figure = blank(8.2, 3.4, "constrained")
        axes = figure.add_subplot()
        for number, (name, level) in enumerate(levels.items()):
            shade = 0.25 + 0.75 * (1.0 - number / max(1, len(levels)))
            axes.plot(frequencies, level, color=ANSWER, alpha=shade, lw=1.4, label=name)
        axes.set_xscale("log")
        plain_logarithm(axes.xaxis, (1.0, 2.0, 5.0))
        axes.set_xlabel("Hz")
        axes.set_ylabel("dB below the loudest band")
        axes.legend(loc="lower left", frameon=False, fontsize=8, title="after the strike", title_fontsize=8)
    return figure


def touched_figure(surface: FloatArray, contacts: FloatArray, passed: Sequence[FloatArray]) -> Figure:
    """Plot the object from above and from the side, with its contacts and the probe lines without contact.

    Args:
        surface: ``(n, 3)`` m, samples of the surface at the estimated size, upright.
        contacts: ``(c, 3)`` m, centres of the contacts.
        passed: ``(n, 3)`` m each, probe lines without contact.
    """
    with styled():
        figure = blank(8.2, 3.8, "constrained")
        for axes, up, title in zip(
            figure.subplots(1, 2), (1, 2), ("from above", "from the side"), strict=True
        ):
            axes.plot(1e2 * surface[:, 0], 1e2 * surface[:, up], ".", ms=1.5, color="#c9c5bb")
            for line in passed:
                axes.plot(1e2 * line[:, 0], 1e2 * line[:, up], color=SOFT, lw=0.8, ls=":")
            axes.plot(1e2 * contacts[:, 0], 1e2 * contacts[:, up], "o", ms=5, color=TOOL)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_title(title, fontsize=9, loc="left")
            axes.set_xlabel("cm")
    return figure


def _ring(axes: Axes, corners: FloatArray, colour: str, label: str, width: float) -> None:
    closed = np.vstack([corners, corners[:1]])
    axes.plot(closed[:, 0], closed[:, 1], color=colour, lw=width, label=label)
