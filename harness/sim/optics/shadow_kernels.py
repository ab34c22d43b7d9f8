"""The loops of shadows: thrown onto a floor of grey levels, taken off a picture's colours, laid over it."""

import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.optics.tactile_calibration import Float32Array

CHANNELS = 4
"""Red, green, blue and one that is never lower, so that a pixel is held down in one step."""

Lists = tuple[FloatArray | Float32Array, IntArray, FloatArray, tuple[float, float, float]]
"""``levels`` (or ``levels_single``), ``longest`` and ``rays`` of a ``ShadowTable``; metres at which its
depths begin, metres from one to the next, and rad from direction to direction."""


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
