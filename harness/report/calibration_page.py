"""The page of a tactile calibration: what it was made of, how good it is and where; everything inlined."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, IntArray
from harness.report.figures.bins import BinsFigure, bins_figure
from harness.report.figures.figures import Album, Picture
from harness.report.figures.shadow import ShadowFigure, shadow_figure
from harness.report.figures.style import ANSWER, INK, SOFT, TOOL, blank, styled
from harness.report.figures.tiles import DIFFERENCE_GAIN, difference, png
from harness.report.template import rendered

PAGE = "calibration.html"
"""Name of the page in its folder."""

_LONGER = 20.0
"""Times as long as they are, arrows of what presses are off the arm's map."""

_WORST_SHOWN = 30.0
"""Grey levels at which the map of what is left over ends."""


@dataclass(frozen=True)
class PressLine:
    """One press of a calibration.

    Attributes:
        name: of its picture.
        centre: pixels (column, row).
        radius: pixels, of the contact line.
        depth: metres.
        table: dB, predicted by the other presses, centre refitted.
        smooth: the same by the smooth model.
        unrefitted: the same by the table with the centre where the detector found it.
        nothing: dB of the untouched gel.
    """

    name: str
    centre: tuple[float, float]
    radius: float
    depth: float
    table: float
    smooth: float
    unrefitted: float
    nothing: float


@dataclass(frozen=True, eq=False)
class Example:
    """A press beside what the calibration draws of it: ``(rows, columns, 3)`` RGB about its contact."""

    title: str
    live: ByteArray
    drawn: ByteArray


@dataclass(frozen=True, eq=False)
class MovesFigure:
    """Where the arm moved the ball over the gel, and where the pictures saw it.

    Attributes:
        numbers: name, value and what it is uncertain by.
        on_gel: ``(presses, 2)`` m, by the arm.
        residuals: ``(presses, 2)`` m, by which the arm's place is off the pictures'.
        used: ``(presses,)`` whether a press is among those that the map stands on.
    """

    numbers: Sequence[tuple[str, str, str]]
    on_gel: FloatArray
    residuals: FloatArray
    used: BoolArray


@dataclass(frozen=True, eq=False)
class CalibrationReport:
    """Everything the page shows.

    Attributes:
        title: of the page.
        cards: figures to see first: heading, value, and what it means.
        facts: name and value, of the artefact.
        notes: what a reader must know.
        presses: of the calibration.
        refused: name, kind and reason of the others.
        background: ``(rows, columns, 3)`` RGB of the untouched gel.
        coverage: ``(rows, columns)`` how many contacts reached a pixel.
        left: ``(rows, columns)`` grey levels rms left over on held-out presses; NaN where none was.
        examples: from the worst press to the best.
        moves: of the arm between the presses; None where none are known.
        shadow: what presses leave over around their contacts.
        bins: of the table; None where its errors are not known.
    """

    title: str
    cards: Sequence[tuple[str, str, str]]
    facts: Sequence[tuple[str, str]]
    notes: Sequence[str]
    presses: Sequence[PressLine]
    refused: Sequence[tuple[str, str, str]]
    background: ByteArray
    coverage: IntArray
    left: FloatArray
    examples: Sequence[Example]
    moves: MovesFigure | None = None
    shadow: ShadowFigure | None = None
    bins: BinsFigure | None = None


@dataclass(frozen=True)
class CalibrationRow:
    """One example's pictures under its title."""

    title: str
    pictures: tuple[tuple[str, Picture], ...]


def write_calibration_page(report: CalibrationReport, folder: Path) -> Path:
    """Write the page and its pictures.

    Args:
        report: what it shows.
        folder: made if it does not exist; files of the same names are replaced.

    Returns:
        Path of the page, which refers to nothing outside itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    album = Album(folder)
    page = rendered(
        PAGE,
        report=report,
        maps=album.photograph("maps", maps_figure(report)),
        scores=album.drawing("scores", scores_figure(report.presses)),
        rows=[_row(example, number, album) for number, example in enumerate(report.examples, start=1)],
        gain=f"{DIFFERENCE_GAIN:g}",
        moved=None if report.moves is None else album.drawing("moves", moves_figure(report.moves)),
        longer=f"{_LONGER:g}",
        shadowed=None if report.shadow is None else album.drawing("shadow", shadow_figure(report.shadow)),
        believed=None if report.bins is None else album.drawing("bins", bins_figure(report.bins)),
    )
    (folder / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def maps_figure(report: CalibrationReport) -> Figure:
    """Where the presses were, how often each place was reached, and what is left over there."""
    rows, columns = report.coverage.shape
    with styled():
        figure = blank(12.6, 12.6 / 3.0 * rows / columns + 0.2)
        figure.set_layout_engine("constrained")
        where, often, left = np.asarray(figure.subplots(1, 3))
        where.imshow(report.background)
        where.set_title("presses on the untouched gel", fontsize=10)
        for press in report.presses:
            where.add_patch(Circle(press.centre, press.radius, fill=False, ec="white", lw=0.9))
            where.plot(*press.centre, marker="+", ms=4, color=INK, mew=0.8)
        _map(
            figure,
            often,
            report.coverage,
            "contacts that reached a pixel",
            "Blues",
            float(report.coverage.max()),
        )
        _map(
            figure, left, report.left, "left over on held-out presses, grey levels rms", "magma", _WORST_SHOWN
        )
        for axes in (where, often, left):
            axes.set_xlim(-0.5, columns - 0.5)
            axes.set_ylim(rows - 0.5, -0.5)
            axes.set_axis_off()
    return figure


def moves_figure(moves: MovesFigure) -> Figure:
    """Every press on the gel by the arm, with what it is off the map, drawn longer."""
    x, y = 1e3 * moves.on_gel.T
    right, down = 1e3 * _LONGER * moves.residuals.T
    with styled():
        figure = blank(7.6, 5.6)
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot()
        for which, colour, label in ((moves.used, ANSWER, "used"), (~moves.used, SOFT, "not used")):
            if which.any():
                axes.plot(x[which], y[which], ls="none", marker="o", ms=3.5, color=colour, label=label)
        shown = np.isfinite(right)
        axes.quiver(
            x[shown],
            y[shown],
            right[shown],
            down[shown],
            angles="xy",
            scale_units="xy",
            scale=1.0,
            width=0.003,
            color=TOOL,
        )
        # Arrows do not stretch the axes by themselves: their tips would be cut off.
        axes.update_datalim(np.column_stack([x + right, y + down])[shown])
        axes.autoscale_view()
        axes.set_aspect("equal")
        axes.invert_yaxis()
        axes.set_title(f"arrows: off the arm's map, {_LONGER:g} times as long", fontsize=9, loc="left")
        axes.set_xlabel("x of the tool's gel frame, mm")
        axes.set_ylabel("y, mm")
        axes.legend(frameon=False, fontsize=9, loc="upper right")
    return figure


def scores_figure(presses: Sequence[PressLine]) -> Figure:
    """Held-out PSNR of every press, sorted, with and without the centre refitted, and of nothing at all."""
    curves: tuple[tuple[str, str, str, str], ...] = (
        ("table", "table, centre refitted", ANSWER, "o"),
        ("smooth", "smooth model, centre refitted", TOOL, "s"),
        ("unrefitted", "table, centre as detected", SOFT, "^"),
        ("nothing", "untouched gel", "#b9bec6", "x"),
    )
    order = sorted(presses, key=lambda press: press.table)
    with styled():
        figure = blank(9.0, 3.9)
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot()
        for which, label, colour, marker in curves:
            axes.plot(
                np.arange(1, len(order) + 1),
                [vars(press)[which] for press in order],
                ls="none",
                marker=marker,
                ms=4.5,
                color=colour,
                label=label,
            )
        axes.axhline(float(np.median([press.table for press in order])), color=ANSWER, lw=1.0, ls="--")
        axes.set_xlabel("press, from the worst to the best (line: median of the table)")
        axes.set_ylabel("held-out PSNR within the contact, dB")
        axes.grid(visible=True, axis="y", color="#e6e8eb", lw=0.8)
        axes.set_axisbelow(True)
        axes.legend(frameon=False, fontsize=9, ncols=2, loc="center right")
    return figure


def _map(figure: Figure, axes: Axes, values: AnyArray, title: str, colours: str, highest: float) -> None:
    bare = np.full((*values.shape, 3), 0.93)
    axes.imshow(bare)
    shown = axes.imshow(values, cmap=colours, vmin=0.0, vmax=max(highest, 1.0))
    axes.set_title(title, fontsize=10)
    figure.colorbar(shown, ax=axes, shrink=0.8)


def _row(example: Example, number: int, album: Album) -> CalibrationRow:
    pictures = (
        ("live", example.live),
        ("drawn", example.drawn),
        ("difference", difference(example.live, example.drawn)),
    )
    return CalibrationRow(
        example.title,
        tuple((name, album.pixels(f"press_{number}_{name}", png(picture))) for name, picture in pictures),
    )
