"""Shadows of a contact laid over the pictures that the optics drew."""

import numpy as np
from scipy import ndimage

from harness.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.sensor import TactileSensor
from harness.sim.gel import over_range
from harness.sim.height_map import rest_surface
from harness.sim.shadow import ShadowTable, cast_shadows
from harness.sim.tactile_calibration import TactileCalibration

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
) -> tuple[FloatArray, FloatArray]:
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
    core = (held > calibration.header.skirt.core * held.max(axis=(1, 2), keepdims=True)) & (held > 0.0)
    untouched = -rest_surface(sensor) if rest is None else rest
    surface = (indentation + untouched) / calibration.header.pitch
    change = pictures.astype(np.float64) - calibration.background
    return soft_shadows(change, indentation, surface, core, table, calibration.header.pitch)


def soft_shadows(
    change: FloatArray,
    indentation: FloatArray,
    surface: FloatArray,
    core: BoolArray,
    table: ShadowTable,
    pitch: float,
) -> tuple[FloatArray, FloatArray]:
    """What ``cast_shadows`` takes from the colours, blurred as shadows are; otherwise as ``darkening``.

    ``pitch`` in metres a pixel says how many pixels the blur is wide.
    """
    shaded, outside = cast_shadows(change, indentation, surface, core, table)
    sigma = SOFTNESS / pitch
    soft: FloatArray = ndimage.gaussian_filter(change - shaded, (0.0, sigma, sigma, 0.0))
    return read_only(soft), outside


def darkened(pictures: ByteArray, by: FloatArray) -> ByteArray:
    """The pictures, darker by grey levels; the same to the bit where that is zero."""
    return read_only(np.clip(np.rint(pictures - by), 0.0, 255.0).astype(np.uint8))
