"""The part of a report that compares live readings with a model of the object and with the twin."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.agreement.agreement import Agreement, SideBySide
from harness.basics.arrays import FloatArray
from harness.experiment.report_content import CaptionedPicture, Missing, PageBlock, Picture, ReportTable
from harness.report.figures.figures import Album
from harness.report.figures.style import ANSWER, SOFT, TOOL, blank, styled

_WIDTH, _HEIGHT, _TITLES = 9.6, 2.2, 0.4

_SCALED = {"m": (1e3, "mm"), "Hz": (1e-3, "kHz"), "covered": (1.0, "covered")}
"""The factor and the unit that each unit is drawn in."""


def show_agreement(agreement: Agreement | None, album: Album) -> tuple[PageBlock, ...]:
    """Show verdicts with their numbers, and a picture in the album."""
    if agreement is None:
        return (Missing("the readings were not compared with a model"),)
    doubt = agreement.first_doubt
    if doubt is not None:
        summary = f"First in doubt: {doubt[1]}, at step {doubt[0] + 1}."
    else:
        summary = "Everything that can be compared fits." if agreement.fits else "Nothing could be compared."
    return (
        f"Live readings compared with a model of the {agreement.about} at the pose that the scene states, "
        f"whatever the answer is. {summary}",
        ReportTable(
            ("sense", "compared with", "verdict", "largest residual"),
            [
                (judged.compared.sense, judged.compared.source, judged.verdict, sentence)
                for judged, sentence in zip(agreement.senses, agreement.sentences(), strict=True)
            ],
            "llll",
        ),
        CaptionedPicture(
            _picture(agreement, album),
            "Live reading, model and their difference: for each sense the step in doubt, or the first step. "
            "Resonances: live above, the model's modes below.",
        ),
    )


def _picture(agreement: Agreement, album: Album) -> Picture | Missing:
    pairs = {}
    for judged in agreement.senses:
        # The residual in doubt, or the first that has a picture.
        with_picture = [residual for residual in judged.compared.residuals if residual.sides is not None]
        doubted = judged.doubted is not None and judged.doubted.sides is not None
        residual = judged.doubted if doubted else next(iter(with_picture), None)
        if residual is not None and residual.sides is not None:
            of = f"{judged.compared.sense} against the {judged.compared.source}, step {residual.step + 1}"
            verdict = "in doubt" if residual is judged.doubted else judged.verdict
            pairs[f"{of}: {residual.quantity}, {verdict}"] = residual.sides
    if not pairs:
        return Missing("no sense that was compared has a picture")
    return album.drawing("agreement", agreement_figure(pairs))


def agreement_figure(pairs: Mapping[str, SideBySide]) -> Figure:
    """Fields as three pictures: live, model, and their difference; values as lines on one axis.

    Args:
        pairs: one or more, by the title of their row.
    """
    with styled():
        figure = blank(_WIDTH, len(pairs) * (_HEIGHT + _TITLES), "constrained")
        for part, (title, pair) in zip(
            np.atleast_1d(np.asarray(figure.subfigures(len(pairs), 1))), pairs.items(), strict=True
        ):
            part.suptitle(title, fontsize=10)
            factor, unit = _SCALED[pair.unit]
            live, model = factor * pair.live, factor * pair.model
            if live.ndim == 2:
                _fields(part.subplots(1, 3), live, model, unit)
            else:
                _values(part.subplots(1, 1), live, model, unit)
    return figure


def _fields(axes: FloatArray, live: FloatArray, model: FloatArray, unit: str) -> None:
    low, high = (float(found) for found in (min(live.min(), model.min()), max(live.max(), model.max())))
    apart = live - model
    most = max(1e-9, float(np.abs(apart).max()))
    shown = ((live, "live", low, high), (model, "model", low, high), (apart, "live - model", -most, most))
    for each, (field, title, least, greatest) in zip(axes, shown, strict=True):
        colours = "RdBu_r" if field is apart else "viridis"
        drawn = each.imshow(field, cmap=colours, vmin=least, vmax=greatest, interpolation="nearest")
        each.set_title(title, fontsize=9)
        each.set_xticks([])
        each.set_yticks([])
        bar = each.figure.colorbar(drawn, ax=each, shrink=0.9, aspect=24)
        bar.set_label(unit, fontsize=8)
        bar.ax.tick_params(labelsize=7)


def _values(axes: Axes, live: FloatArray, model: FloatArray, unit: str) -> None:
    """Live values upward, the model's downward, as far as the live ones reach."""
    near = model[(model >= 0.9 * live.min()) & (model <= 1.1 * live.max())]
    axes.vlines(live, 0.0, 1.0, color=ANSWER, label="live")
    axes.vlines(near, -1.0, 0.0, color=TOOL, label="model")
    axes.axhline(0.0, color=SOFT, linewidth=0.8)
    axes.set_yticks([])
    axes.set_xlabel(unit, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=8, frameon=False, ncols=2)
