"""Shadows that a contact throws over the gel under grazing light, from a measured table.

Taxim's construction (Si and Yuan, 2022, section III-C): every pixel on the contact's rim throws
a fan of rays outwards along its slope; along each the colour is held down to what a pin of
that depth was seen to leave. For sensors whose light grazes; others need no such effect.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import cv2
import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import over_range
from harness.sim.gel.height_map import rest_surface
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration

RIM = 4
"""Pixels to each side by which the rim of a contact reaches past it."""

Beyond = Literal["hold", "skip"]

CHANNELS = 4
"""Red, green, blue and one that is never lower, so that a pixel is held down in one step."""

Lists = tuple[FloatArray | Float32Array, IntArray, FloatArray, tuple[float, float, float]]
"""``levels`` (or ``levels_single``), ``longest`` and ``rays`` of a ``ShadowTable``; metres at which its
depths begin, metres from one to the next, and rad from direction to direction."""


@dataclass(frozen=True, eq=False)
class ShadowTable:
    """What pins pressed into the gel were seen to throw."""

    directions: FloatArray
    """``(d,)`` rad, evenly spaced over a turn: the middle of a list's fan. The k-th list is of slopes that
    fall in directions from k spacings to k + 1."""
    lengths: IntArray  #: ``(3, d, k)`` how many samples each channel, direction and depth has.
    values: FloatArray
    """the samples, one list after another in the order of ``lengths``: grey levels against the untouched gel,
    outwards from the pin."""
    shallowest: float  #: metres, the depth at which the first of the ``k`` rows begins.
    depth_step: float = 0.1e-3  #: metres from row to row, above zero.
    sample_step: float = 1.25  #: pixels between samples.
    fan: float = 0.1  #: rad to either side of the slope's direction that are shaded too.
    fan_step: float = 0.05  #: rad between rays.

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

    @cached_property
    def longest(self) -> IntArray:
        """``(d, k)`` samples of the longest of the three channels' lists."""
        return read_only(np.ascontiguousarray(self.lengths.max(axis=0)).astype(np.int64))

    @cached_property
    def levels(self) -> FloatArray:
        """``(d, k, samples, CHANNELS)`` the lists of all channels side by side, +inf beyond their ends."""
        levels = np.full((*self.lengths.shape[1:], int(self.lengths.max(initial=0)), CHANNELS), np.inf)
        lists = np.split(self.values, np.cumsum(self.lengths.ravel())[:-1])
        for (c, d, k), one in zip(np.ndindex(self.lengths.shape), lists, strict=True):
            levels[d, k, : len(one), c] = one
        return read_only(levels)

    @cached_property
    def levels_single(self) -> Float32Array:
        """``levels`` in single precision."""
        single: Float32Array = self.levels.astype(np.float32)
        return read_only(single)

    @cached_property
    def rays(self) -> FloatArray:
        """``(d, rays, samples, 2)`` pixels down and along from the rim to each sample; NaN of no ray."""
        fans = [np.arange(one - self.fan, one + self.fan, self.fan_step) for one in self.directions]
        samples = int(self.lengths.max(initial=0))
        rays = np.full((len(fans), max(len(fan) for fan in fans), samples, 2), np.nan)
        for d, fan in enumerate(fans):
            across = self.sample_step * np.stack([np.sin(fan), np.cos(fan)], axis=-1)
            rays[d, : len(fan)] = np.arange(samples)[None, :, None] * across[:, None, :]
        return read_only(rays)

    def lists(self, levels: FloatArray | Float32Array) -> Lists:
        """What the loops take, with ``levels`` or ``levels_single``."""
        step = float(self.directions[1] - self.directions[0])
        return levels, self.longest, self.rays, (self.shallowest, self.depth_step, step)


def rim(core: BoolArray) -> BoolArray:
    """``(rows, columns)`` the ring of four pixels around a contact, from which shadows are thrown."""
    wide = cv2.dilate(core.view(np.uint8), np.ones((2 * RIM + 1, 2 * RIM + 1), np.uint8))
    ring: BoolArray = np.asarray(wide, dtype=np.bool_) & ~core
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
    lists = table.lists(table.levels)
    shaded, outside = change.copy(), np.zeros(len(change))
    for n in range(len(change)):
        ring = rim(core[n])
        if not ring.any():
            continue
        floor = np.full((*ring.shape, CHANNELS), np.inf)
        thrown, missing = throw(floor, surface[n], indentation[n], ring, lists, beyond == "hold")
        np.minimum(shaded[n], floor[..., :3], out=shaded[n])
        outside[n] = missing / thrown
    return read_only(shaded), read_only(outside)


@compiled
def throw(
    floor: FloatArray | Float32Array,
    surface: FloatArray,
    indentation: FloatArray,
    ring: BoolArray,
    lists: Lists,
    hold: bool,
) -> tuple[int, int]:
    """Hold a floor down to the shadows of a contact.

    Args:
        floor: ``(rows, columns, CHANNELS)`` grey levels that no shadow leaves more of; lowered.
        surface: ``(rows, columns)`` pixels, the gel's height, its own dome included.
        indentation: ``(rows, columns)`` metres.
        ring: ``(rows, columns)`` the pixels that throw.
        lists: of the table.
        hold: whether a pixel whose depth is not in the table takes the nearest; else it throws nothing.

    Returns:
        How many pixels are in the ring, and how many of them have a depth that the table does not.
    """
    levels, longest, _, (shallowest, depth_step, _) = lists
    rows, columns = ring.shape
    count, missing = 0, 0
    for i in range(rows):
        for j in range(columns):
            if not ring[i, j]:
                continue
            count += 1
            row = int(np.floor((indentation[i, j] - shallowest) / depth_step + 1e-9))
            k = min(max(row, 0), longest.shape[1] - 1)
            if k != row:
                missing += 1
                if not hold:
                    continue
            d = _direction_row(surface, i, j, lists)
            _fan(floor, surface, i, j, levels[d, k, : longest[d, k]], lists[2][d])
    return count, missing


@compiled
def _direction_row(surface: FloatArray, i: int, j: int, lists: Lists) -> int:
    """Which list a pixel throws; at the picture's border slopes count as none."""
    rows, columns = surface.shape
    down, along = 0.0, 0.0
    if 0 < i < rows - 1 and 0 < j < columns - 1:
        down = (surface[i + 1, j] - surface[i - 1, j]) / 2.0
        along = (surface[i, j + 1] - surface[i, j - 1]) / 2.0
    # The slope climbs towards the contact; the shadow falls the other way, half a turn on.
    outwards = np.arctan2(down, along) + np.pi
    return min(int(outwards // lists[3][2]), len(lists[1]) - 1)


@compiled
def _fan(
    floor: FloatArray | Float32Array,
    surface: FloatArray,
    i: int,
    j: int,
    levels: FloatArray | Float32Array,
    rays: FloatArray,
) -> None:
    """Throw the rays of one pixel, downhill only."""
    rows, columns = surface.shape
    here = surface[i, j]
    for ray in range(len(rays)):
        if np.isnan(rays[ray, 0, 0]):
            break
        for s in range(1, len(levels)):
            y, x = int(i + rays[ray, s, 0]), int(j + rays[ray, s, 1])
            if x < 0 or x >= columns or y < 0 or y >= rows:
                # Rays are straight: what has left the picture does not come back.
                break
            if here <= surface[y, x]:
                continue
            for c in range(CHANNELS):
                floor[y, x, c] = min(floor[y, x, c], levels[s, c])


@compiled
def take(picture: ByteArray, background: ByteArray, floor: Float32Array, taken: Float32Array) -> None:
    """Write into ``taken``, ``(rows, columns, 3)``, what a floor takes off a picture's change of colour."""
    rows, columns, channels = taken.shape
    for i in range(rows):
        for j in range(columns):
            for c in range(channels):
                change = np.float32(np.int32(picture[i, j, c]) - np.int32(background[i, j, c]))
                taken[i, j, c] = max(change - floor[i, j, c], np.float32(0.0))


@compiled
def lay_over(picture: ByteArray, by: Float32Array, drawn: ByteArray) -> None:
    """Write into ``drawn`` a picture less grey levels, rounded and clipped; all of one length."""
    for k in range(len(drawn)):
        left = np.rint(np.float64(picture[k]) - np.float64(by[k]))
        drawn[k] = np.uint8(np.int32(min(max(left, 0.0), 255.0)))


SOFTNESS = 59e-6
"""sigma in m of the blur of shadows: two pixels of the sensor of Taxim (Si and Yuan, 2022)."""


def darkening(
    pictures: ByteArray,
    penetration: FloatArray,
    indentation: FloatArray,
    sensor: TactileSensor,
    calibration: TactileCalibration,
    table: ShadowTable,
    rest: FloatArray | None = None,
) -> tuple[Float32Array, FloatArray]:
    """Compute the darkening of each image by shadows.

    A shadow only holds colours down, so it may work on rounded ones: rounding and clipping keep order.

    Args:
        pictures: ``(n, rows, columns, 3)`` without shadows.
        penetration: ``(n, rows, columns)`` metres, how deep the object reaches.
        indentation: ``(n, rows, columns)`` metres, of the gel's surface.
        sensor: of the pictures.
        calibration: gives the background, the core of a contact and the pitch.
        table: of the sensor; a rim deeper or shallower than it takes its nearest row.
        rest: ``(rows, columns)`` metres, the untouched gel's surface towards the camera, where the sensor's
            own flat or spherical one does not say it.

    Returns:
        ``(n, rows, columns, 3)`` grey levels, 0 or more, and ``(n,)`` the share of each contact's rim
        whose depth was not in the table.
    """
    held, _ = over_range(penetration, sensor)
    deepest = held.max(axis=(1, 2), keepdims=True)
    core = (held > calibration.header.skirt.core * deepest) & (held > 0.0)
    untouched = -rest_surface(sensor) if rest is None else rest
    pitch = calibration.header.pitch
    soft, outside = np.zeros(pictures.shape, np.float32), np.zeros(len(pictures))
    for n in range(len(pictures)):
        box = _reached(core[n], table, pitch)
        if box is None:
            continue
        surface = (indentation[n][box] + untouched[box]) / pitch
        floor = np.full((*surface.shape, CHANNELS), np.inf, np.float32)
        ring = rim(core[n][box])
        lists = table.lists(table.levels_single)
        thrown, missing = throw(floor, surface, indentation[n][box], ring, lists, hold=True)
        outside[n] = missing / max(thrown, 1)
        take(pictures[n][box], calibration.background[box], floor, soft[n][box])
        soft[n][box] = _blurred(soft[n][box], SOFTNESS / pitch)
    return read_only(soft), read_only(outside)


def _reached(core: BoolArray, table: ShadowTable, pitch: float) -> tuple[slice, slice] | None:
    """The part of a picture that shadows of a contact may reach, blur included; None without a contact."""
    rows, columns = np.flatnonzero(core.any(axis=1)), np.flatnonzero(core.any(axis=0))
    if not len(rows):
        return None
    longest = table.sample_step * float(table.lengths.max(initial=0))
    margin = RIM + int(np.ceil(longest)) + _radius(SOFTNESS / pitch) + 2
    return tuple(  # type: ignore[return-value]  # two of them
        slice(max(0, int(one[0]) - margin), int(one[-1]) + margin + 1) for one in (rows, columns)
    )


def soft_shadows(
    change: FloatArray,
    indentation: FloatArray,
    surface: FloatArray,
    core: BoolArray,
    table: ShadowTable,
    pitch: float,
) -> tuple[FloatArray, FloatArray]:
    """Compute the darkening of ``cast_shadows`` for unrounded colours, blurred as in ``darkening``.

    ``pitch`` in metres a pixel says how many pixels the blur is wide.
    """
    shaded, outside = cast_shadows(change, indentation, surface, core, table)
    taken = np.subtract(change, shaded, dtype=np.float32, casting="same_kind")
    soft = np.stack([_blurred(one, SOFTNESS / pitch) for one in taken])
    return read_only(soft.astype(np.float64)), outside


def _blurred(taken: Float32Array, sigma: float) -> Float32Array:
    size = 2 * _radius(sigma) + 1
    blurred = cv2.GaussianBlur(taken, (size, size), sigma, borderType=cv2.BORDER_REFLECT)
    return np.asarray(blurred, dtype=np.float32)


def _radius(sigma: float) -> int:
    """Half width of a blur in pixels: four sigma."""
    return max(1, int(4.0 * sigma + 0.5))


def darkened(pictures: ByteArray, by: Float32Array) -> ByteArray:
    """The pictures, darker by grey levels; the same to the bit where that is zero."""
    drawn = np.empty_like(pictures, order="C")
    lay_over(
        np.ascontiguousarray(pictures).reshape(-1), np.ascontiguousarray(by).reshape(-1), drawn.reshape(-1)
    )
    return read_only(drawn)
