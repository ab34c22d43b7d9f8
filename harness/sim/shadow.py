"""Shadows that a contact throws over the gel under grazing light, from a measured table.

Taxim's construction (Si and Yuan, 2022, section III-C): every pixel on the contact's rim throws
a fan of rays outwards along its slope; along each the colour is held down to what a pin of
that depth was seen to leave. For sensors whose light grazes; others need no such effect.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import ndimage

from harness.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.errors import CalibrationRefused, OutOfDomain
from harness.sim.compiled import compiled

RIM = 4
"""Pixels to each side by which the rim of a contact reaches past it."""

Beyond = Literal["hold", "skip"]


@dataclass(frozen=True, eq=False)
class ShadowTable:
    """What pins pressed into the gel were seen to throw.

    Attributes:
        directions: ``(d,)`` rad, evenly spaced over a turn: the middle of a list's fan. The k-th list is of
            slopes that fall in directions from k spacings to k + 1.
        lengths: ``(3, d, k)`` how many samples each channel, direction and depth has.
        values: the samples, one list after another in the order of ``lengths``: grey levels
            against the untouched gel, outwards from the pin.
        shallowest: metres, the depth at which the first of the ``k`` rows begins.
        depth_step: metres from row to row, above zero.
        sample_step: pixels between samples.
        fan: rad to either side of the slope's direction that are shaded too.
        fan_step: rad between rays.
    """

    directions: FloatArray
    lengths: IntArray
    values: FloatArray
    shallowest: float
    depth_step: float = 0.1e-3
    sample_step: float = 1.25
    fan: float = 0.1
    fan_step: float = 0.05

    def __post_init__(self) -> None:
        if self.lengths.ndim != 3 or self.lengths.shape[:2] != (3, len(self.directions)):
            raise CalibrationRefused(
                f"shadow lists are {self.lengths.shape}, for {len(self.directions)} directions"
            )
        if int(self.lengths.sum()) != len(self.values) or not np.isfinite(self.values).all():
            raise CalibrationRefused(
                f"the shadow lists have {int(self.lengths.sum())} samples; {len(self.values)} came"
            )
        if not (self.depth_step > 0.0 and self.sample_step > 0.0 and self.fan_step > 0.0):
            raise CalibrationRefused(
                f"shadows in steps of {self.depth_step:g} m, {self.sample_step:g} px and "
                f"{self.fan_step:g} rad cannot be: all three are above zero; fit the calibration again"
            )


def rim(core: BoolArray) -> BoolArray:
    """``(rows, columns)`` the ring of four pixels around a contact, from which shadows are thrown."""
    wide = ndimage.maximum_filter(core.view(np.uint8), 2 * RIM + 1, mode="constant") > 0
    ring: BoolArray = wide & ~core
    return ring


def cast_shadows(
    change: FloatArray,
    indentation: FloatArray,
    surface: FloatArray,
    core: BoolArray,
    table: ShadowTable,
    *,
    beyond: Beyond = "hold",
) -> tuple[FloatArray, FloatArray]:
    """Darken the change of colour by the shadows of every contact.

    Args:
        change: ``(n, rows, columns, 3)`` grey levels against the untouched gel.
        indentation: ``(n, rows, columns)`` metres; chooses the row of the table.
        surface: ``(n, rows, columns)`` the gel's height in pixels, its own dome included; it throws
            shadows only downhill.
        core: ``(n, rows, columns)`` where the object touches.
        table: of the sensor, channels in the order of ``change``.
        beyond: what a rim pixel does whose depth is not in the table: ``"hold"`` takes the
            nearest row, ``"skip"`` throws no shadow, as the published program does.

    Returns:
        The changed colours, and ``(n,)`` the share of rim pixels whose depth was not in the table.
        A contact without a core is handed on to the bit.

    Raises:
        OutOfDomain: no such policy, or shapes that disagree.
    """
    if beyond not in ("hold", "skip"):
        raise OutOfDomain(f"no way {beyond!r} of leaving the shadow table; there are hold, skip")
    if not change.shape[:-1] == indentation.shape == surface.shape == core.shape:
        raise OutOfDomain(
            f"colours {change.shape}, heights {indentation.shape} and core {core.shape} disagree"
        )
    starts = np.concatenate([[0], np.cumsum(table.lengths.ravel())]).astype(np.int64)
    lists = (table.lengths, starts, table.values)
    rays = _rays(table)
    shaded, outside = change.copy(), np.zeros(len(change))
    for n in range(len(change)):
        ring = np.argwhere(rim(core[n]))
        if not len(ring):
            continue
        deep = indentation[n][ring[:, 0], ring[:, 1]]
        row = np.floor((deep - table.shallowest) / table.depth_step + 1e-9).astype(np.int64)
        held = np.clip(row, 0, table.lengths.shape[2] - 1)
        missing = row != held
        outside[n] = missing.sum() / len(ring)
        throws = ~missing if beyond == "skip" else np.ones(len(ring), np.bool_)
        direction = _direction_rows(surface[n], ring[throws], table)
        _throw(shaded[n], surface[n], ring[throws], held[throws], direction, rays, lists, table.sample_step)
    return read_only(shaded), read_only(outside)


def _rays(table: ShadowTable) -> FloatArray:
    """``(d, rays)`` rad, NaN where a fan has fewer."""
    fans = [
        np.arange(direction - table.fan, direction + table.fan, table.fan_step)
        for direction in table.directions
    ]
    rays = np.full((len(fans), max(len(fan) for fan in fans)), np.nan)
    for k, fan in enumerate(fans):
        rays[k, : len(fan)] = fan
    return rays


def _direction_rows(surface: FloatArray, at: IntArray, table: ShadowTable) -> IntArray:
    """``(n,)`` which lists pixels ``(n, 2)`` throw; at the picture's border slopes count as none."""
    i, j = at.T
    rows, columns = surface.shape
    within_rows, within_columns = (i > 0) & (i < rows - 1), (j > 0) & (j < columns - 1)
    inside = within_rows & within_columns
    above, below = np.maximum(i - 1, 0), np.minimum(i + 1, rows - 1)
    left, right = np.maximum(j - 1, 0), np.minimum(j + 1, columns - 1)
    down = np.where(inside, (surface[below, j] - surface[above, j]) / 2.0, 0.0)
    along = np.where(inside, (surface[i, right] - surface[i, left]) / 2.0, 0.0)
    # The slope climbs towards the contact; the shadow falls the other way, half a turn on.
    outwards = np.arctan2(down, along) + np.pi
    step = float(table.directions[1] - table.directions[0])
    return np.minimum(np.floor_divide(outwards, step).astype(np.int64), len(table.directions) - 1)


@compiled
def _throw(
    shaded: FloatArray,
    surface: FloatArray,
    at: IntArray,
    depth_row: IntArray,
    direction_row: IntArray,
    rays: FloatArray,
    lists: tuple[IntArray, IntArray, FloatArray],
    step: float,
) -> None:
    lengths, starts, values = lists
    rows, columns = surface.shape
    for p in range(len(at)):
        i, j = at[p, 0], at[p, 1]
        d, k = direction_row[p], depth_row[p]
        for ray in range(rays.shape[1]):
            turn = rays[d, ray]
            if np.isnan(turn):
                continue
            across, along = step * np.cos(turn), step * np.sin(turn)
            longest = max(lengths[0, d, k], lengths[1, d, k], lengths[2, d, k])
            for s in range(1, longest):
                x, y = int(j + s * across), int(i + s * along)
                if x < 0 or x >= columns or y < 0 or y >= rows:
                    # Rays are straight: what has left the picture does not come back.
                    break
                if surface[i, j] <= surface[y, x]:
                    continue
                for c in range(3):
                    if s < lengths[c, d, k]:
                        level = values[starts[(c * lengths.shape[1] + d) * lengths.shape[2] + k] + s]
                        shaded[y, x, c] = min(shaded[y, x, c], level)
