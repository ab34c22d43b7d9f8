"""Taxim's table from ball presses: per bin of the slope, six coefficients of the position.

Few presses reach any one bin, so a bin starts from the smooth model, which has the table's own
terms in the position, and is moved by the mean residual of the presses that did reach it,
shrunk towards none. Rows beyond the steepest supported slope repeat the last supported one. What a contact
adds whatever its slope is let in over the first few degrees: flat gel keeps the background's colour.
"""

from collections.abc import Iterator

import numpy as np

from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import SmoothFit, ball_shades, contact_pixels
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
    table = _from_smooth(fit, ball, rows, columns)
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


def bin_terms(edge: float, ball: float) -> FloatArray:
    """``(120 * 120, 21)`` what bins have of each group of the smooth model: 20 of slopes, and the offset.

    Args:
        edge: pixels, of the contact line; steeper bins have its slope.
        ball: radius in pixels.
    """
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


def _from_smooth(fit: SmoothFit, ball: float, rows: int, columns: int) -> FloatArray:
    by_place = np.tensordot(bin_terms(fit.edge, ball), by_group(fit.colours), axes=1)  # (bins^2, 6, 3)
    # Both are all the quadratics of the place: nine places give the one from the other exactly.
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, columns - 1, 3), np.linspace(0, rows - 1, 3)))
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    raw_from_scaled = np.linalg.pinv(raw) @ place_terms(scaled_position(x, y, rows, columns))
    table: FloatArray = (raw_from_scaled @ by_place).reshape(BINS, BINS, 6, 3)
    return table


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
