"""How a reconstructed surface came about: small pictures of it, one for each of some presses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from harness.basics.arrays import FloatArray
from harness.report.figures.shape import KnownSurface, paint_surface, scale_of, seen_from
from harness.report.figures.style import SOFT, blank, styled

_TURN, _HEIGHT = -55.0, 35.0
_ACROSS = 4
"""Pictures in a row."""

_WIDTH, _TALL = 2.1, 2.2
_MARGIN = 0.04


@dataclass(frozen=True, eq=False)
class SurfaceThen:
    """A surface as it was known at some time of a run.

    Attributes:
        title: when.
        words: how well it was known, or why it was not.
        shown: None where there was none.
    """

    title: str
    words: str
    shown: KnownSurface | None


def strip_figure(found: Sequence[SurfaceThen]) -> Figure:
    """Surfaces one after the other, from one side, at one size and in one scale of colours.

    Args:
        found: one or more, of which one at least has a surface.
    """
    surfaces = [one.shown for one in found if one.shown is not None]
    scale = scale_of(np.concatenate([one.deviation for one in surfaces]))
    view = seen_from(_TURN, _HEIGHT)
    low, high = _extent([1e2 * one.mesh.vertices @ view[:2].T for one in surfaces])
    rows = -(-len(found) // _ACROSS)
    with styled():
        figure = blank(_ACROSS * _WIDTH, rows * _TALL, "constrained")
        axes = np.asarray(figure.subplots(rows, _ACROSS)).ravel().tolist()
        for one, then in zip(axes, found, strict=False):
            _draw(one, then, view, scale)
            one.set_aspect("equal", adjustable="box")
            one.set_xlim(low[0], high[0])
            one.set_ylim(low[1], high[1])
        for one in axes[len(found) :]:
            one.set_axis_off()
    return figure


def _extent(places: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """``(2,)`` least and greatest of ``(n, 2)`` cm, with a margin."""
    low = np.min([one.min(axis=0) for one in places], axis=0)
    high = np.max([one.max(axis=0) for one in places], axis=0)
    return low - _MARGIN * (high - low), high + _MARGIN * (high - low)


def _draw(axes: Axes, then: SurfaceThen, view: FloatArray, scale: Normalize) -> None:
    axes.set_title(f"{then.title}\n", fontsize=9, loc="left")
    axes.text(0.0, 1.02, then.words, transform=axes.transAxes, fontsize=8, color=SOFT)
    if then.shown is None:
        axes.set_axis_off()
    else:
        paint_surface(axes, then.shown, view, scale)
