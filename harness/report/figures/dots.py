"""A gel's printed dots: where they were found, what their grid is, and what is off it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from harness.basics.arrays import ByteArray, FloatArray
from harness.picture.dot_lattice import DotLattice
from harness.report.figures.style import ANSWER, SOFT, TOOL, blank, styled

_CLOSE = 3
"""Spacings to a side that the enlarged part of the picture shows."""

_ARROW = 0.4
"""Of the spacing, how long the longest arrow is drawn."""


def found_figure(picture: ByteArray, places: FloatArray, radii: FloatArray, lattice: DotLattice) -> Figure:
    """All dots in the picture with their grid, and the middle of it enlarged.

    Args:
        picture: ``(rows, columns, 3)`` of the resting gel.
        places: ``(n, 2)`` pixels (column, row), of the dots.
        radii: ``(n,)`` pixels.
        lattice: the grid laid through them.
    """
    rows, columns = picture.shape[:2]
    with styled():
        figure = blank(12.6, 12.6 / 2.0 * rows / columns + 0.3, "constrained")
        whole, part = figure.subplots(1, 2)
        for axes, thick in ((whole, 0.7), (part, 1.4)):
            _dots(axes, picture, places, radii, lattice, thick)
            axes.set_axis_off()
        whole.set_title("every dot that was found, and the straight grid through them", fontsize=10)
        middle = places[np.argmin(np.hypot(*(places - np.median(places, axis=0)).T))]
        reach = _CLOSE * lattice.spacing
        part.set_xlim(max(-0.5, middle[0] - reach), min(columns - 0.5, middle[0] + reach))
        high = reach * rows / columns
        part.set_ylim(min(rows - 0.5, middle[1] + high), max(-0.5, middle[1] - high))
        part.set_title("the middle of it", fontsize=10)
    return figure


def off_figure(rows: int, columns: int, places: FloatArray, lattice: DotLattice) -> Figure:
    """By how much dots are off the straight grid, and what is left once a lens's bend is taken out.

    Args:
        rows: of the picture.
        columns: of the picture.
        places: ``(n, 2)`` pixels (column, row), of the dots.
        lattice: the grid laid through them.
    """
    panels = (
        ("off the straight grid", lattice.affine),
        ("off the smoothly bent grid", lattice.local),
    )
    with styled():
        figure = blank(12.0, 6.0 * rows / columns + 0.6, "constrained")
        for axes, (words, off) in zip(np.asarray(figure.subplots(1, 2)), panels, strict=True):
            x, y = places[lattice.on].T
            right, down = off[lattice.on].T
            longest = max(float(np.hypot(right, down).max()), 1e-9)
            longer = _ARROW * lattice.spacing / longest
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


def _dots(
    axes: Axes, picture: ByteArray, places: FloatArray, radii: FloatArray, lattice: DotLattice, thick: float
) -> None:
    axes.imshow(picture)
    across, down = lattice.index[lattice.on].max(axis=0)
    for ends in [((0, row), (across, row)) for row in range(down + 1)] + [
        ((column, 0), (column, down)) for column in range(across + 1)
    ]:
        line = lattice.origin + np.array(ends, dtype=np.float64) @ lattice.step.T
        axes.plot(*line.T, color="white", lw=0.6 * thick)
    for place, radius, on in zip(places, radii, lattice.on, strict=True):
        axes.add_patch(Circle((place[0], place[1]), radius, fill=False, ec=TOOL if on else SOFT, lw=thick))
        axes.plot(*place, marker="+", ms=4.0 * thick, color="white", mew=0.8 * thick)
