"""Figures of the calibrations of a tactile sensor: ball presses, colour table, shadows, and printed dots."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, IntArray
from harness.picture.dot_lattice import DotLattice
from harness.report.figures.style import ANSWER, INK, SOFT, TOOL, blank, styled

LONGER = 20.0
"""Times as long as they are, arrows of what presses are off the arm's map."""

_WORST_SHOWN = 30.0
"""Grey levels at which the map of what is left over ends."""

_SHOWN = 15.0
"""Grey levels at which the colours end."""

_COLOURS = ("red", "green", "blue")

_CLOSE = 3
"""Spacings to a side that the enlarged part of the picture shows."""

_ARROW = 0.4
"""Of the spacing, how long the longest arrow is drawn."""


def maps_figure(
    background: ByteArray,
    circles: Sequence[tuple[tuple[float, float], float]],
    coverage: IntArray,
    left_over: FloatArray,
) -> Figure:
    """Where the presses were, how often each place was reached, and what is left over there.

    Args:
        background: ``(rows, columns, 3)`` RGB of the untouched gel.
        circles: centre (column, row) and radius of each contact line, pixels.
        coverage: ``(rows, columns)`` how many contacts reached a pixel.
        left_over: ``(rows, columns)`` grey levels rms on held-out presses; NaN where none was.
    """
    rows, columns = coverage.shape
    with styled():
        figure = blank(12.6, 12.6 / 3.0 * rows / columns + 0.2, "constrained")
        where, often, left = np.asarray(figure.subplots(1, 3))
        where.imshow(background)
        where.set_title("presses on the untouched gel", fontsize=10)
        for centre, radius in circles:
            where.add_patch(Circle(centre, radius, fill=False, ec="white", lw=0.9))
            where.plot(*centre, marker="+", ms=4, color=INK, mew=0.8)
        _map(figure, often, coverage, "contacts that reached a pixel", "Blues", float(coverage.max()))
        worst = "left over on held-out presses, grey levels rms"
        _map(figure, left, left_over, worst, "magma", _WORST_SHOWN)
        for axes in (where, often, left):
            axes.set_xlim(-0.5, columns - 0.5)
            axes.set_ylim(rows - 0.5, -0.5)
            axes.set_axis_off()
    return figure


def moves_figure(on_gel: FloatArray, residuals: FloatArray, used: BoolArray) -> Figure:
    """Every press on the gel by the arm, with what it is off the map, drawn longer.

    Args:
        on_gel: ``(presses, 2)`` m, by the arm.
        residuals: ``(presses, 2)`` m, by which the arm's place is off the pictures'.
        used: ``(presses,)`` whether a press is among those that the map stands on.
    """
    x, y = 1e3 * on_gel.T
    right, down = 1e3 * LONGER * residuals.T
    with styled():
        figure = blank(7.6, 5.6, "constrained")
        axes = figure.add_subplot()
        for which, colour, label in ((used, ANSWER, "used"), (~used, SOFT, "not used")):
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
        axes.set_title(f"arrows: off the arm's map, {LONGER:g} times as long", fontsize=9, loc="left")
        axes.set_xlabel("x of the tool's gel frame, mm")
        axes.set_ylabel("y, mm")
        axes.legend(frameon=False, fontsize=9, loc="upper right")
    return figure


def scores_figure(scores: Mapping[str, FloatArray]) -> Figure:
    """Held-out PSNR of every press, sorted, with and without the centre refitted, and of nothing at all.

    Args:
        scores: ``(presses,)`` dB, by what predicts: ``table``, ``smooth``, ``unrefitted`` and ``nothing``.
    """
    curves: tuple[tuple[str, str, str, str], ...] = (
        ("table", "table, centre refitted", ANSWER, "o"),
        ("smooth", "smooth model, centre refitted", TOOL, "s"),
        ("unrefitted", "table, centre as detected", SOFT, "^"),
        ("nothing", "untouched gel", "#b9bec6", "x"),
    )
    order = np.argsort(scores["table"], kind="stable")
    with styled():
        figure = blank(9.0, 3.9, "constrained")
        axes = figure.add_subplot()
        for which, label, colour, marker in curves:
            axes.plot(
                np.arange(1, len(order) + 1),
                scores[which][order],
                ls="none",
                marker=marker,
                ms=4.5,
                color=colour,
                label=label,
            )
        axes.axhline(float(np.median(scores["table"])), color=ANSWER, lw=1.0, ls="--")
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


def bins_figure(errors: FloatArray, reached: BoolArray, steepest: float) -> Figure:
    """Errors by slope upwards and direction to the right, and beside them which bins were reached.

    Args:
        errors: ``(slopes, directions)`` grey levels, standard error, root mean square over the channels.
        reached: ``(slopes, directions)`` whether presses reached a bin.
        steepest: rad, where the last supported slope ends.
    """
    rows, columns = errors.shape
    shown = max(int(np.ceil(steepest / (0.5 * np.pi) * (rows - 1))), 1)
    extent = (-180.0, 180.0, 0.0, 90.0 * shown / (rows - 1))
    error, support = errors[:shown, : columns - 1], reached[:shown, : columns - 1]
    with styled():
        figure = blank(12.6, 3.4, "constrained")
        left, right = np.asarray(figure.subplots(1, 2, sharey=True))
        drawn = left.imshow(
            error,
            cmap="magma",
            vmin=0.0,
            vmax=float(np.quantile(error, 0.99)),
            origin="lower",
            extent=extent,
            aspect="auto",
        )
        figure.colorbar(drawn, ax=left, shrink=0.9)
        left.set_title("standard error, grey levels", fontsize=10)
        right.imshow(support, cmap="Blues", vmin=0.0, vmax=1.6, origin="lower", extent=extent, aspect="auto")
        right.set_title(f"reached by presses: {support.mean():.0%} of the bins", fontsize=10, color=INK)
        left.set_ylabel("slope, deg")
        for axes in (left, right):
            axes.set_xlabel("direction of the slope, deg")
    return figure


def shadow_figure(
    directions: FloatArray, step: float, left_over: FloatArray, shaded: BoolArray, dark_sides: FloatArray
) -> Figure:
    """Three panels, direction to the right and distance upwards.

    Args:
        directions: ``(d,)`` rad, in the picture from the columns' direction towards the rows'.
        step: metres from sample to sample.
        left_over: ``(3, d, samples)`` grey levels along rays from the rim, red, green, blue.
        shaded: ``(3, d, samples)`` what is taken for a shadow.
        dark_sides: ``(3,)`` rad, where slopes turn from each light.
    """
    samples = left_over.shape[2]
    far = 1e3 * step * samples
    with styled():
        figure = blank(12.6, 3.4, "constrained")
        panels = np.asarray(figure.subplots(1, 3, sharey=True))
        for axes, name, left, cells, dark in zip(
            panels, _COLOURS, left_over, shaded, dark_sides, strict=True
        ):
            shown = axes.imshow(
                left.T,
                cmap="RdBu_r",
                vmin=-_SHOWN,
                vmax=_SHOWN,
                origin="lower",
                extent=(0.0, 360.0, 0.0, far),
                aspect="auto",
            )
            if cells.any():
                middles = (np.degrees(directions), far * (np.arange(samples) + 0.5) / samples)
                axes.contour(*middles, cells.T.astype(np.float64), levels=[0.5], colors=INK, linewidths=1.2)
            axes.axvline(np.degrees(dark), color=INK, lw=1.0, ls="--")
            axes.set_title(name, fontsize=10)
            axes.set_xlabel("direction in the picture, deg")
        panels[0].set_ylabel("from the rim, mm")
        figure.colorbar(shown, ax=panels, shrink=0.9, label="grey levels left over")
    return figure


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
            axes.imshow(picture)
            across, down = lattice.index[lattice.on].max(axis=0)
            for ends in [((0, row), (across, row)) for row in range(down + 1)] + [
                ((column, 0), (column, down)) for column in range(across + 1)
            ]:
                line = lattice.origin + np.array(ends, dtype=np.float64) @ lattice.step.T
                axes.plot(*line.T, color="white", lw=0.6 * thick)
            for place, radius, on in zip(places, radii, lattice.on, strict=True):
                axes.add_patch(
                    Circle((place[0], place[1]), radius, fill=False, ec=TOOL if on else SOFT, lw=thick)
                )
                axes.plot(*place, marker="+", ms=4.0 * thick, color="white", mew=0.8 * thick)
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
