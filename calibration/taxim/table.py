"""The colour table of a calibration: its fit to ball presses, and the standard error of every cell.

The table is Taxim's: per bin of the slope, six coefficients of the position. Few presses reach any one bin,
so a bin starts from the smooth model, which has the table's own terms in the position, and is moved by the
mean residual of the presses that did reach it, shrunk towards none. Rows beyond the steepest supported slope
repeat the last supported one. What a contact adds whatever its slope is let in over the first few degrees:
flat gel keeps the background's colour.

The standard error is the scatter between presses. A press errs as a whole: its centre, its speckles and its
light are the same for all of its pixels, so that the scatter of pixels, and what least squares says of them,
claims a table that is several times too good. Presses are left out instead, one at a time. The fit is linear
in its colours, so that what it would be without one press follows from what the press leaves over and from
its leverage, its own part of the normal equations, with no further fit; the smooth model under a bin and the
bin's own pixels change together. From there it is the jackknife by clusters (Bell and McCaffrey, Survey
Methodology 28, 2002). Centres are held.

What no press has taught stays the smooth model's, however often presses are left out. How far that is from
bins that presses did teach says by how much it errs; few pixels leave a share of it.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from calibration.taxim.moments import OFFSET, SLOPES, colour_terms, place_products
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import (
    WITH_OFFSET,
    SmoothFit,
    ball_shades,
    contact_pixels,
    huber,
    ridge_of,
    scaled_place,
    stride,
)
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.shading import POSITION_TERMS, design, scaled_position
from harness.sim.optics.tactile_calibration import Float32Array, smooth_terms

BINS = 120
"""ObjectFolder's."""

SHRINK = 4.0
"""Pixels' worth of belief in the smooth model, per bin."""

_LET_IN = np.radians(4.0)
"""Slope from which on the gel is taken to be in contact."""

_ROWS_BESIDE = 4
"""Rows to each side, three degrees, over which the smooth model's misfit is taken to be alike."""


def bin_of(magnitude: FloatArray, direction: FloatArray, bins: int) -> tuple[IntArray, IntArray]:
    """Row and column of the table for slopes in rad; direction wraps at the seam."""
    row = np.floor(magnitude / (0.5 * np.pi / (bins - 1))).astype(np.int64)
    column = np.floor((direction + np.pi) / (2.0 * np.pi / (bins - 1))).astype(np.int64)
    return row, column % (bins - 1)


def fit_table(
    pack: PressPack, fit: SmoothFit, ball: float, change: FloatArray
) -> tuple[Float32Array, BoolArray]:
    """The table ``(120, 120, 6, 3)`` in raw pixels and which bins presses reached ``(120, 120)``.

    Args:
        pack: the presses.
        fit: of the same presses.
        ball: radius in pixels.
        change: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
    """
    rows, columns = pack.shape
    by_place = np.tensordot(_bin_terms(fit.edge, ball), by_group(fit.colours), axes=1)  # (bins^2, 6, 3)
    # Both are all the quadratics of the place: nine places give the one from the other exactly.
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, columns - 1, 3), np.linspace(0, rows - 1, 3)))
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    raw_from_scaled = np.linalg.pinv(raw) @ place_terms(scaled_position(x, y, rows, columns))
    table: FloatArray = (raw_from_scaled @ by_place).reshape(BINS, BINS, 6, 3)
    total, count = np.zeros((BINS, BINS, 3)), np.zeros((BINS, BINS))
    for left, pixels in bin_residuals(pack, fit, ball, change):
        total += left
        count += pixels
    table[..., 5, :] += total / (count + SHRINK)[..., None]
    if len(fit.colours) > smooth_terms():
        table[0] = 0.0
    last = steepest_row(fit, ball)
    table[last + 1 :] = table[last]
    table[:, BINS - 1] = table[:, 0]
    support = count > 0
    support[last + 1 :] = False
    support[:, BINS - 1] = support[:, 0]
    return table.astype(np.float32), support


def steepest_row(fit: SmoothFit, ball: float) -> int:
    """The last row of the table that presses support, of a ball's radius in pixels."""
    return int(np.floor(np.arcsin(fit.edge / ball) / (0.5 * np.pi / (BINS - 1)))) - 1


def table_shades(table: Float32Array, centre: FloatArray, place: IntArray, ball: float) -> FloatArray:
    """``(n, 3)`` grey levels that a table gives pixels of a press at a centre (column, row)."""
    y, x = (axis.astype(np.float64) for axis in place.T)
    at = _bins_of_ball(x - centre[0], y - centre[1], ball)
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    shown: FloatArray = np.einsum("nt,ntc->nc", terms, table[at].astype(np.float64))
    return shown


def _bins_of_ball(right: FloatArray, down: FloatArray, ball: float) -> tuple[IntArray, IntArray]:
    return bin_of(np.arcsin(np.hypot(right, down) / ball), np.arctan2(-down, -right), BINS)


def _bin_terms(edge: float, ball: float) -> FloatArray:
    """Return the regressors of each bin: 20 of the smooth model's slopes, and the offset."""
    step = 0.5 * np.pi / (BINS - 1)
    magnitude, direction = np.meshgrid(
        (np.arange(BINS) + 0.5) * step, -np.pi + (np.arange(BINS) + 0.5) * 4.0 * step, indexing="ij"
    )
    sine = np.minimum(np.sin(magnitude), edge / ball).ravel()
    # A height's gradient (a down, b right) has the normal's image part pointing the other way.
    normal = -np.stack([sine * np.cos(direction.ravel()), sine * np.sin(direction.ravel())], axis=1)
    slopes = design(normal, np.zeros_like(normal))[:, ::POSITION_TERMS]
    return np.column_stack([slopes, np.minimum(1.0, magnitude.ravel() / _LET_IN)])


def by_group(colours: FloatArray) -> FloatArray:
    """``(21, 6, 3)`` of coefficients, the offset's last: zero where it was not fitted."""
    full = np.zeros(((smooth_terms() // POSITION_TERMS + 1) * POSITION_TERMS, 3))
    full[: len(colours)] = colours
    return full.reshape(-1, POSITION_TERMS, 3)


def bin_residuals(
    pack: PressPack, fit: SmoothFit, ball: float, change: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Of each press ``(120, 120, 3)`` what the smooth model leaves over, summed by bin, and its pixels."""
    for k, centre in enumerate(fit.centres):
        total, count = np.zeros((BINS, BINS, 3)), np.zeros((BINS, BINS))
        place = contact_pixels(pack.shape, centre, fit.edge, 1)
        seen = change[k][place[:, 0], place[:, 1]]
        left = seen - ball_shades(pack, centre, place, fit.colours, ball)
        at = _bins_of_ball(place[:, 1] - centre[0], place[:, 0] - centre[1], ball)
        np.add.at(total, at, left)
        np.add.at(count, at, 1.0)
        yield total, count


def table_error(pack: PressPack, clean: FloatArray, fit: SmoothFit, ball: float) -> Float32Array:
    """The standard error of the colours of a table.

    Args:
        pack: the presses of the fit.
        clean: ``(presses, rows, columns, 3)`` grey levels against the untouched gel, drift removed.
        fit: of the table, with a contact's offset.
        ball: radius in pixels.

    Returns:
        ``(120, 120, 3)`` grey levels, one sigma, root mean square over the places that were pressed. Rows
        beyond the steepest supported slope repeat the last, as the table does.
    """
    last = steepest_row(fit, ball)
    presses = list(bin_residuals(pack, fit, ball, clean))
    count = np.sum([pixels for _, pixels in presses], axis=0)
    kept = (SHRINK / (count + SHRINK))[..., None]
    variance = _left_out(pack, clean, fit, ball, presses)
    variance += kept**2 * _smooth_misfit(presses, last)[:, None, :]
    # Flat gel is the background's colour by definition; what is as good as flat errs as the next row does.
    variance[0] = variance[1]
    variance[last + 1 :] = variance[last]
    variance[:, BINS - 1] = variance[:, 0]
    return np.sqrt(variance).astype(np.float32)


def _left_out(
    pack: PressPack,
    clean: FloatArray,
    fit: SmoothFit,
    ball: float,
    presses: list[tuple[FloatArray, FloatArray]],
) -> FloatArray:
    """``(120, 120, 3)`` the variance of colours by leaving presses out, mean over the presses' places."""
    count = np.array([pixels.ravel() for _, pixels in presses])  # (presses, bins)
    total = np.array([left.reshape(-1, 3) for left, _ in presses])
    x, y = fit.centres.T
    where = place_terms(scaled_position(x, y, *pack.shape))
    terms = _bin_terms(fit.edge, ball)
    own = total.sum(axis=0) / (count.sum(axis=0) + SHRINK)[:, None]
    variance = np.zeros_like(own)
    for k, change in enumerate(_changes_without(pack, clean, fit, ball)):
        by_place = np.einsum("pt,gtc->pgc", where, by_group(change))
        smooth = np.einsum("bg,pgc->pbc", terms, by_place, optimize=True)  # of a bin, where each press is
        others = count.copy()
        others[k] = 0.0
        left = total.sum(axis=0) - total[k] - np.einsum("pb,pbc->bc", others, smooth)
        moved = smooth + (left / (others.sum(axis=0) + SHRINK)[:, None] - own)
        variance += (moved**2).mean(axis=0)
    share = (len(presses) - 1.0) / len(presses)
    return np.asarray(share * variance).reshape(BINS, BINS, 3)


def _changes_without(pack: PressPack, clean: FloatArray, fit: SmoothFit, ball: float) -> Iterable[FloatArray]:
    """``(126, 3)`` of each press, by how much the smooth model's coefficients change if it is left out."""
    parts = []
    for k, centre in enumerate(fit.centres):
        place = contact_pixels(pack.shape, centre, fit.edge, stride(fit.edge))
        left = clean[k][place[:, 0], place[:, 1]] - ball_shades(pack, centre, place, fit.colours, ball)
        products = place_products(scaled_place(pack, place))
        terms = colour_terms(SLOPES + OFFSET, (place[:, ::-1] - centre) / ball, products)
        parts.append(terms.normal_equations(huber(left), left))
    gram = np.sum([own for own, _ in parts], axis=0)
    whole = gram + np.diag(ridge_of(np.diag(gram), WITH_OFFSET.place_ridge))
    for own, right in parts:
        yield -np.asarray(np.linalg.solve(whole - own, right), dtype=np.float64)


def _smooth_misfit(presses: list[tuple[FloatArray, FloatArray]], last: int) -> FloatArray:
    """``(120, 3)`` mean square of the smooth model's misfit by slope.

    Of two presses in one bin, what both are off by is the model's: noise and whatever else is a press's own
    has no part in the mean of their products.
    """
    there = np.zeros((BINS, BINS))
    mean, square = np.zeros((BINS, BINS, 3)), np.zeros((BINS, BINS, 3))
    for total, pixels in presses:
        own = total / np.maximum(pixels, 1.0)[..., None]
        there, mean, square = there + (pixels > 0.0), mean + own, square + own**2
    products, pairs = (mean**2 - square).sum(axis=1), (there * (there - 1.0)).sum(axis=1)
    missed = np.empty((BINS, 3))
    for row in range(BINS):
        near = slice(max(min(row, last) - _ROWS_BESIDE, 0), min(row, last) + _ROWS_BESIDE + 1)
        missed[row] = np.maximum(products[near].sum(axis=0), 0.0) / max(pairs[near].sum(), 1.0)
    return missed
