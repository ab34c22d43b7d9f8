"""What the effects of touch share: how deep an object reaches into a gel, and the optics that colour it."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration, rest_surface
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.tactile_calibration import TactileCalibration

_OPTICS: dict[str, OpticsLevel] = {"exact": "exact", "fast": "fast", "smooth": "smooth"}


def reached(
    raster: RasterMesh,
    gel_from_object: FloatArray,
    sensor: TactileSensor,
    rays: int,
    towards: FloatArray | None = None,
) -> FloatArray:
    """How deep an object reaches into an undeformed gel.

    Args:
        raster: the object.
        gel_from_object: ``(n, 4, 4)`` rigid.
        sensor: gives the window.
        rays: to a pixel, each way; their mean is taken.
        towards: ``(rows, columns)`` metres towards the camera, the gel's own surface, whose z is 0 at the
            window's centre; None for the sensor's, flat or a dome.

    Returns:
        ``(n, rows, columns)`` metres, 0 or more.

    Raises:
        OutOfDomain: a pose that is not finite and rigid.
    """
    fine = replace(sensor, rows=sensor.rows * rays, columns=sensor.columns * rays, pitch=sensor.pitch / rays)
    gap = height_maps(raster, gel_from_object, fine)
    deep = penetration(gap, fine) if towards is None else np.maximum(0.0, _surface(towards, rays) - gap)
    if rays == 1:
        return read_only(deep)
    blocks = deep.reshape(len(deep), sensor.rows, rays, sensor.columns, rays)
    return read_only(blocks.mean(axis=(2, 4)))


def optics(
    calibration: TactileCalibration, level: str, sensor: TactileSensor, towards: FloatArray | None = None
) -> Optics:
    """Slopes to colours, kept for as long as they are asked for.

    Args:
        calibration: of the colours.
        level: ``"exact"``, ``"fast"`` or ``"smooth"``.
        sensor: gives the untouched gel where ``towards`` does not.
        towards: ``(rows, columns)`` metres towards the camera, the gel's own surface; None for the sensor's.

    Raises:
        CalibrationRefused: a level that the calibration does not have.
    """
    return _optics(calibration, _OPTICS[level], sensor, _Rest(towards))


class _Rest:
    """An array that a cache can tell from another: by being the same one."""

    def __init__(self, surface: FloatArray | None) -> None:
        self.surface = surface

    def __hash__(self) -> int:
        return id(self.surface)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Rest) and other.surface is self.surface


@lru_cache(maxsize=4)
def _optics(
    calibration: TactileCalibration, level: OpticsLevel, sensor: TactileSensor, rest: _Rest
) -> Optics:
    if rest.surface is not None or sensor.gel_radius is None:
        return Optics(calibration, level, rest.surface)
    return Optics(calibration, level, -rest_surface(sensor))


def _surface(towards: FloatArray, rays: int) -> FloatArray:
    """``(rows * rays, columns * rays)`` metres in the gel frame."""
    rows, columns = (np.array([(size - 1) // 2, size // 2]) for size in towards.shape)
    surface: FloatArray = towards[np.ix_(rows, columns)].mean() - towards
    return surface.repeat(rays, axis=0).repeat(rays, axis=1)
