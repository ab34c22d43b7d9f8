"""The effects of one press: the catalogue's, where something is given that the catalogue computes.

A press may bring its own height map, or its own gel; a published calibration brings the untouched gel's
surface. And one picture is asked what a batch is not: how much of it is clipped, and how much of it
is steeper than any press of the calibration.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from harness.accuracy import Level
from harness.arrays import BoolArray, ByteArray, FloatArray, IntArray, read_only
from harness.effects import Effect
from harness.sensor import TactileSensor
from harness.sim.catalogue import EFFECTS, OPTICS
from harness.sim.height_map import height_maps, rest_surface
from harness.sim.optics import Optics, OpticsLevel, TactileImages
from harness.sim.shadow_image import darkening
from harness.sim.snapped_optics import SnappedOptics
from harness.sim.tactile_calibration import TactileCalibration

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

REST = "sensor.rest"
"""Source: ``(rows, columns)`` metres, the untouched gel's surface towards the camera."""

_LEVELS: dict[str, OpticsLevel] = {"exact": "exact", "fast": "fast", "smooth": "smooth"}


def press_effects(given: frozenset[str], own_rest: bool) -> tuple[Effect, ...]:
    """The effects of a press.

    Args:
        given: quantities of the catalogue that come as sources: ``"touch.height_map"``, ``"touch.gel"``.
        own_rest: whether the untouched gel's surface is the source ``sensor.rest``; else it is the
            sensor's, flat or a dome.
    """
    effects = {effect.provides: effect for effect in EFFECTS if effect.provides not in given}
    effects["touch.colour"] = Effect("touch.colour", ("touch.drawn",), _colour)
    rest = (REST,) if own_rest else ()
    needs = ("touch.gel", "sensor", "sensor.calibration", *rest)
    effects["touch.drawn"] = Effect("touch.drawn", needs, _drawn, knobs=(OPTICS,))
    effects["touch.saturated"] = Effect("touch.saturated", ("touch.drawn",), _saturated)
    effects["touch.extrapolated"] = Effect("touch.extrapolated", ("touch.drawn",), _extrapolated)
    if own_rest:
        shadowed = effects["touch.darkening"]
        effects["touch.darkening"] = replace(shadowed, needs=(*shadowed.needs, REST), compute=_darkening)
    if own_rest and "touch.height_map" in effects:
        raster = effects["touch.height_map"]
        effects["touch.height_map"] = replace(raster, needs=(*raster.needs, REST), compute=_height_map)
    return tuple(effects.values())


def contact_of(
    penetration: FloatArray, calibration: TactileCalibration, of: Literal["object", "gel"]
) -> BoolArray:
    """``(rows, columns)`` where the object touches the gel.

    Of an object, every pixel where it reaches the gel. Of a gel, what the object surely shapes: the
    skirt's share of the deepest pixel and more.
    """
    share = calibration.header.skirt.core if of == "gel" else 0.0
    touched: BoolArray = (penetration > 0.0) & (penetration >= share * penetration.max())
    return touched


def _drawn(given: Given, levels: Levels) -> TactileImages:
    calibration, level = given["sensor.calibration"], _LEVELS[str(levels[OPTICS.name])]
    return _optics(calibration, level, given["sensor"], _Rest(given.get(REST))).render(given["touch.gel"])


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
    if rest.surface is not None:
        return SnappedOptics(calibration, level, rest.surface)
    return Optics(calibration, level, None if sensor.gel_radius is None else -rest_surface(sensor))


def _colour(given: Given, _levels: Levels) -> ByteArray:
    images: ByteArray = given["touch.drawn"].images
    return images


def _saturated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].saturated
    return counts


def _extrapolated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].extrapolated
    return counts


def _darkening(given: Given, _levels: Levels) -> tuple[FloatArray, FloatArray]:
    return darkening(
        given["touch.colour"],
        given["touch.height_map"],
        given["touch.gel"],
        given["sensor"],
        given["sensor.calibration"],
        given["sensor.shadow_table"],
        given[REST],
    )


def _height_map(given: Given, levels: Levels) -> FloatArray:
    """As the catalogue's, over a surface of the gel's own; its z is 0 at the window's centre."""
    sensor, rays = given["sensor"], int(levels["touch.supersampling"])
    fine = replace(sensor, rows=sensor.rows * rays, columns=sensor.columns * rays, pitch=sensor.pitch / rays)
    gap = height_maps(given["object.raster"], given["contact.gel_from_object"], fine)
    towards = given[REST]
    rows, columns = (np.array([(size - 1) // 2, size // 2]) for size in towards.shape)
    surface = towards[np.ix_(rows, columns)].mean() - towards
    deep = np.maximum(0.0, surface.repeat(rays, axis=0).repeat(rays, axis=1) - gap)
    blocks = deep.reshape(len(deep), sensor.rows, rays, sensor.columns, rays)
    return read_only(blocks.mean(axis=(2, 4)))
