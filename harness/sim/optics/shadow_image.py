"""Shadows of a contact laid over the pictures that the optics drew."""

import cv2
import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import over_range
from harness.sim.gel.height_map import rest_surface
from harness.sim.optics.shadow import CHANNELS, RIM, ShadowTable, cast_shadows, lay_over, rim, take, throw
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration

SOFTNESS = 59e-6
"""Metres, sigma of the blur of shadows: two pixels of the sensor of Taxim (Si and Yuan, 2022)."""


def darkening(
    pictures: ByteArray,
    penetration: FloatArray,
    indentation: FloatArray,
    sensor: TactileSensor,
    calibration: TactileCalibration,
    table: ShadowTable,
    rest: FloatArray | None = None,
) -> tuple[Float32Array, FloatArray]:
    """How much darker shadows make each picture.

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
    """What ``cast_shadows`` takes from colours that are no picture's, blurred as ``darkening`` does.

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
    """Pixels to a side beyond which a blur has nothing: four sigma."""
    return max(1, int(4.0 * sigma + 0.5))


def darkened(pictures: ByteArray, by: Float32Array) -> ByteArray:
    """The pictures, darker by grey levels; the same to the bit where that is zero."""
    drawn = np.empty_like(pictures, order="C")
    lay_over(
        np.ascontiguousarray(pictures).reshape(-1), np.ascontiguousarray(by).reshape(-1), drawn.reshape(-1)
    )
    return read_only(drawn)
