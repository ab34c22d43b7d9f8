"""How far the table's colours are to be believed, bin by bin.

A press errs as a whole: its centre, its speckles and its light are the same for all of its pixels, so that
the scatter of pixels, and what least squares says of them, claims a table that is several times too good.
Presses are left out instead, one at a time. The fit is linear in its colours, so that what it would be
without one press follows from what the press leaves over and from its leverage, its own part of the normal
equations, with no further fit; the smooth model under a bin and the bin's own pixels change together. From
there it is the jackknife by clusters (Bell and McCaffrey, Survey Methodology 28, 2002). Centres are held.

What no press has taught stays the smooth model's, however often presses are left out. How far that is from
bins that presses did teach says by how much it errs; few pixels leave a share of it.
"""

from collections.abc import Iterable

import numpy as np

from calibration.taxim.held_out import OFFSET as OFFSET_MANNER
from calibration.taxim.moments import OFFSET, SLOPES, colour_terms, place_products
from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import (
    SmoothFit,
    ball_shades,
    contact_pixels,
    huber,
    ridge_of,
    scaled_place,
    stride,
)
from calibration.taxim.table_fit import BINS, SHRINK, bin_residuals, bin_terms, by_group, steepest_row
from harness.basics.arrays import FloatArray
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.shading import scaled_position
from harness.sim.optics.tactile_calibration import Float32Array

_ROWS_BESIDE = 4
"""Rows to each side, three degrees, over which the smooth model's misfit is taken to be alike."""


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
    terms = bin_terms(fit.edge, ball)
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
    whole = gram + np.diag(ridge_of(np.diag(gram), OFFSET_MANNER.place_ridge))
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
