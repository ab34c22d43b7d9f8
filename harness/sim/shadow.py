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
    wide: BoolArray = ndimage.binary_dilation(core, np.ones((5, 5), np.bool_), iterations=2)
    return wide & ~core


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
    fans = [_fan(direction, table) for direction in table.directions]
    rays = np.full((len(fans), max(len(fan) for fan in fans)), np.nan)
    for k, fan in enumerate(fans):
        rays[k, : len(fan)] = fan
    shaded, outside = change.copy(), np.zeros(len(change))
    for n in range(len(change)):
        ring = rim(core[n])
        if not ring.any():
            continue
        row = np.floor((indentation[n] - table.shallowest) / table.depth_step + 1e-9).astype(np.int64)
        held = np.clip(row, 0, table.lengths.shape[2] - 1)
        missing = ring & (row != held)
        outside[n] = missing.sum() / ring.sum()
        throws = ring & ~missing if beyond == "skip" else ring
        direction = _direction_rows(surface[n], table)
        lists = (table.lengths, starts, table.values)
        _throw(shaded[n], surface[n], throws, held, direction, rays, lists, table.sample_step)
    return read_only(shaded), read_only(outside)


def _fan(direction: float, table: ShadowTable) -> FloatArray:
    return np.arange(direction - table.fan, direction + table.fan, table.fan_step)


def _direction_rows(surface: FloatArray, table: ShadowTable) -> IntArray:
    down, right = np.zeros_like(surface), np.zeros_like(surface)
    down[1:-1, 1:-1] = (surface[2:, 1:-1] - surface[:-2, 1:-1]) / 2.0
    right[1:-1, 1:-1] = (surface[1:-1, 2:] - surface[1:-1, :-2]) / 2.0
    # The slope climbs towards the contact; the shadow falls the other way, half a turn on.
    outwards = np.arctan2(down, right) + np.pi
    step = float(table.directions[1] - table.directions[0])
    return np.minimum(np.floor_divide(outwards, step).astype(np.int64), len(table.directions) - 1)


@compiled
def _throw(
    shaded: FloatArray,
    surface: FloatArray,
    throws: BoolArray,
    depth_row: IntArray,
    direction_row: IntArray,
    rays: FloatArray,
    lists: tuple[IntArray, IntArray, FloatArray],
    step: float,
) -> None:
    lengths, starts, values = lists
    rows, columns = surface.shape
    for i in range(rows):
        for j in range(columns):
            if not throws[i, j]:
                continue
            d, k = direction_row[i, j], depth_row[i, j]
            for ray in range(rays.shape[1]):
                turn = rays[d, ray]
                if np.isnan(turn):
                    continue
                across, along = step * np.cos(turn), step * np.sin(turn)
                for c in range(3):
                    first = starts[(c * lengths.shape[1] + d) * lengths.shape[2] + k]
                    for s in range(1, lengths[c, d, k]):
                        x, y = int(j + s * across), int(i + s * along)
                        if x < 0 or x >= columns or y < 0 or y >= rows or surface[i, j] <= surface[y, x]:
                            continue
                        shaded[y, x, c] = min(shaded[y, x, c], values[first + s])
