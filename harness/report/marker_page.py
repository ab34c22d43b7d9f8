"""The page of a gel's printed dots: where they were found, what their grid is, and what is off it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from harness.basics.arrays import ByteArray, FloatArray
from harness.picture.dot_lattice import DotLattice
from harness.report.figures.figures import Album
from harness.report.figures.style import ANSWER, SOFT, TOOL, blank, styled
from harness.report.template import rendered

PAGE = "markers.html"
"""Name of the page in its folder."""

_CLOSE = 3
"""Spacings to a side that the enlarged part of the picture shows."""

_ARROW = 0.4
"""Of the spacing, how long the longest arrow is drawn."""


@dataclass(frozen=True, eq=False)
class MarkerReport:
    """Everything the page shows.

    Attributes:
        title: of the page.
        cards: figures to see first: heading, value, and what it means.
        facts: name and value, of the artefact.
        notes: what a reader must know.
        picture: ``(rows, columns, 3)`` of the resting gel.
        places: ``(n, 2)`` pixels (column, row), of the dots.
        radius: ``(n,)`` pixels.
        sigma: ``(n,)`` pixels.
        lattice: the grid laid through them.
    """

    title: str
    cards: Sequence[tuple[str, str, str]]
    facts: Sequence[tuple[str, str]]
    notes: Sequence[str]
    picture: ByteArray
    places: FloatArray
    radius: FloatArray
    sigma: FloatArray
    lattice: DotLattice


def write_marker_page(report: MarkerReport, folder: Path) -> Path:
    """Write the page and its pictures into a folder, which is made if it does not exist; the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    album = Album(folder)
    page = rendered(
        PAGE,
        report=report,
        found=album.photograph("found", found_figure(report)),
        off=album.drawing("off", off_figure(report)),
        dots=_lines(report),
    )
    (folder / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def found_figure(report: MarkerReport) -> Figure:
    """All dots in the picture with their grid, and the middle of it enlarged."""
    rows, columns = report.picture.shape[:2]
    with styled():
        figure = blank(12.6, 12.6 / 2.0 * rows / columns + 0.3)
        figure.set_layout_engine("constrained")
        whole, part = figure.subplots(1, 2)
        for axes, thick in ((whole, 0.7), (part, 1.4)):
            _dots(axes, report, thick)
            axes.set_axis_off()
        whole.set_title("every dot that was found, and the straight grid through them", fontsize=10)
        middle = report.places[np.argmin(np.hypot(*(report.places - np.median(report.places, axis=0)).T))]
        reach = _CLOSE * report.lattice.spacing
        part.set_xlim(max(-0.5, middle[0] - reach), min(columns - 0.5, middle[0] + reach))
        high = reach * rows / columns
        part.set_ylim(min(rows - 0.5, middle[1] + high), max(-0.5, middle[1] - high))
        part.set_title("the middle of it", fontsize=10)
    return figure


def off_figure(report: MarkerReport) -> Figure:
    """By how much dots are off the straight grid, and what is left once a lens's bend is taken out."""
    rows, columns = report.picture.shape[:2]
    panels = (
        ("off the straight grid", report.lattice.affine),
        ("off the smoothly bent grid", report.lattice.local),
    )
    with styled():
        figure = blank(12.0, 6.0 * rows / columns + 0.6)
        figure.set_layout_engine("constrained")
        for axes, (words, off) in zip(np.asarray(figure.subplots(1, 2)), panels, strict=True):
            x, y = report.places[report.lattice.on].T
            right, down = off[report.lattice.on].T
            longest = max(float(np.hypot(right, down).max()), 1e-9)
            longer = _ARROW * report.lattice.spacing / longest
            axes.plot(x, y, ls="none", marker="o", ms=2.5, color=ANSWER)
            along = (longer * right, longer * down)
            axes.quiver(x, y, *along, angles="xy", scale_units="xy", scale=1.0, width=0.004, color=TOOL)
            axes.set_title(
                f"{words}: {longest:.3f} px at most, arrows {longer:.0f} times as long", fontsize=10
            )
            axes.set_xlim(-0.5, columns - 0.5)
            axes.set_ylim(rows - 0.5, -0.5)
            axes.set_aspect("equal")
            axes.set_xlabel("column, px")
            axes.set_ylabel("row, px")
    return figure


def _dots(axes: Axes, report: MarkerReport, thick: float) -> None:
    axes.imshow(report.picture)
    across, down = report.lattice.index[report.lattice.on].max(axis=0)
    for ends in [((0, row), (across, row)) for row in range(down + 1)] + [
        ((column, 0), (column, down)) for column in range(across + 1)
    ]:
        line = report.lattice.origin + np.array(ends, dtype=np.float64) @ report.lattice.step.T
        axes.plot(*line.T, color="white", lw=0.6 * thick)
    for place, radius, on in zip(report.places, report.radius, report.lattice.on, strict=True):
        axes.add_patch(Circle((place[0], place[1]), radius, fill=False, ec=TOOL if on else SOFT, lw=thick))
        axes.plot(*place, marker="+", ms=4.0 * thick, color="white", mew=0.8 * thick)


def _lines(report: MarkerReport) -> list[tuple[str, ...]]:
    order = np.lexsort((report.lattice.index[:, 0], report.lattice.index[:, 1]))
    return [
        (
            f"{report.lattice.index[k, 1]}, {report.lattice.index[k, 0]}" if report.lattice.on[k] else "none",
            f"{report.places[k, 0]:.3f}, {report.places[k, 1]:.3f}",
            f"{report.sigma[k]:.3f}",
            f"{report.radius[k]:.2f}",
            f"{np.hypot(*report.lattice.affine[k]):.3f}" if report.lattice.on[k] else "",
            f"{np.hypot(*report.lattice.local[k]):.3f}" if report.lattice.on[k] else "",
        )
        for k in order
    ]
