"""Taxim's table from ball presses: per bin of the slope, six coefficients of the position.

Few presses reach any one bin, so a bin starts from the smooth model, which has the table's own
terms in the position, and is moved by the mean residual of the presses that did reach it,
shrunk towards none. Rows beyond the steepest supported slope repeat the last supported one.
"""

import numpy as np

from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import SmoothFit, changes
from harness.arrays import BoolArray, FloatArray, IntArray
from harness.sim.shading import design, scaled_position
from harness.sim.tactile_calibration import Float32Array

BINS = 120
"""ObjectFolder's."""

_SHRINK = 4.0
"""Pixels' worth of belief in the smooth model, per bin."""


def bin_of(magnitude: FloatArray, direction: FloatArray, bins: int) -> tuple[IntArray, IntArray]:
    """Row and column of the table for slopes in rad; direction wraps at the seam."""
    row = np.floor(magnitude / (0.5 * np.pi / (bins - 1))).astype(np.int64)
    column = np.floor((direction + np.pi) / (2.0 * np.pi / (bins - 1))).astype(np.int64)
    return row, column % (bins - 1)


def fit_table(pack: PressPack, fit: SmoothFit, ball: float) -> tuple[Float32Array, BoolArray]:
    """The table ``(120, 120, 6, 3)`` in raw pixels and which bins presses reached ``(120, 120)``."""
    rows, columns = pack.background.shape[:2]
    table = _from_smooth(fit.smooth, fit.edge / ball, rows, columns)
    total, count = _residuals(pack, fit, ball)
    table[..., 5, :] += total / (count + _SHRINK)[..., None]
    last = int(np.floor(np.arcsin(fit.edge / ball) / (0.5 * np.pi / (BINS - 1)))) - 1
    table[last + 1 :] = table[last]
    table[:, BINS - 1] = table[:, 0]
    support = count > 0
    support[last + 1 :] = False
    support[:, BINS - 1] = support[:, 0]
    return table.astype(np.float32), support


def _from_smooth(smooth: FloatArray, limit: float, rows: int, columns: int) -> FloatArray:
    step = 0.5 * np.pi / (BINS - 1)
    magnitude, direction = np.meshgrid(
        (np.arange(BINS) + 0.5) * step, -np.pi + (np.arange(BINS) + 0.5) * 4.0 * step, indexing="ij"
    )
    sine = np.minimum(np.sin(magnitude), limit).ravel()
    # A height's gradient (a down, b right) has the normal's image part pointing the other way.
    normal = -np.stack([sine * np.cos(direction.ravel()), sine * np.sin(direction.ravel())], axis=1)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, columns - 1, 3), np.linspace(0, rows - 1, 3)))
    where = scaled_position(x, y, rows, columns)
    shades = np.stack(
        [design(normal, np.broadcast_to(place, normal.shape)) @ smooth for place in where]
    )  # (9, bins^2, 3)
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    table: FloatArray = np.einsum("tp,pnc->ntc", np.linalg.pinv(raw), shades).reshape(BINS, BINS, 6, 3)
    return table


def _residuals(pack: PressPack, fit: SmoothFit, ball: float) -> tuple[FloatArray, FloatArray]:
    rows, columns = pack.background.shape[:2]
    total, count = np.zeros((BINS, BINS, 3)), np.zeros((BINS, BINS))
    change = changes(pack)
    for k, (cx, cy) in enumerate(fit.centres):
        away = np.hypot(np.arange(columns)[None, :] - cx, np.arange(rows)[:, None] - cy)
        y, x = (axis.astype(np.float64) for axis in np.nonzero(away <= fit.edge))
        normal = np.stack([x - cx, y - cy], axis=1) / ball
        left = change[k][away <= fit.edge] - design(normal, scaled_position(x, y, rows, columns)) @ fit.smooth
        at = bin_of(np.arcsin(np.hypot(*normal.T)), np.arctan2(-normal[:, 1], -normal[:, 0]), BINS)
        np.add.at(total, at, left)
        np.add.at(count, at, 1.0)
    return total, count
