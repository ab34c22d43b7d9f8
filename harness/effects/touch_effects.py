"""The effects of one press: the catalogue's, where something is given that the catalogue computes.

A press may bring its own height map, or its own gel; a published calibration brings the untouched gel's
surface. And one picture is asked what a batch is not: how much of it is clipped, and how much of it
is steeper than any press of the calibration.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.effects.accuracy import Level
from harness.effects.catalogue import EFFECTS, MARKER_NODES, OPTICS, SUPERSAMPLING
from harness.effects.effect import Effect
from harness.effects.touch_drawing import optics, reached
from harness.sim.gel.gel import over_range
from harness.sim.gel.markers import draw_markers, marker_displacements
from harness.sim.optics.optics import TactileImages
from harness.sim.optics.shadow_image import darkening
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

REST = "sensor.rest"
"""Source: ``(rows, columns)`` metres, the untouched gel's surface towards the camera."""

DOTS = "sensor.dots"
"""Source: the ``MarkerFile`` of the very gel."""


def press_effects(given: frozenset[str], own_rest: bool, own_dots: bool = False) -> tuple[Effect, ...]:
    """The effects of a press.

    Args:
        given: quantities of the catalogue that come as sources: ``"touch.height_map"``, ``"touch.gel"``.
        own_rest: whether the untouched gel's surface is the source ``sensor.rest``; else it is the
            sensor's, flat or a dome.
        own_dots: whether the untouched dots are the source ``sensor.dots``; else they are the sensor's grid.
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
    if own_dots:
        for name, compute in (("touch.marker_motion", _marker_motion), ("touch.markers", _markers)):
            effects[name] = replace(effects[name], needs=(*effects[name].needs, DOTS), compute=compute)
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
    level, rest = str(levels[OPTICS.name]), given.get(REST)
    return optics(given["sensor.calibration"], level, given["sensor"], rest).render(given["touch.gel"])


def _colour(given: Given, _levels: Levels) -> ByteArray:
    images: ByteArray = given["touch.drawn"].images
    return images


def _saturated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].saturated
    return counts


def _extrapolated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].extrapolated
    return counts


def _darkening(given: Given, _levels: Levels) -> tuple[Float32Array, FloatArray]:
    return darkening(
        given["touch.colour"],
        given["touch.height_map"],
        given["touch.gel"],
        given["sensor"],
        given["sensor.calibration"],
        given["sensor.shadow_table"],
        given[REST],
    )


def _marker_motion(given: Given, levels: Levels) -> FloatArray:
    """As the catalogue's, of dots that were measured."""
    sensor, dots = given["sensor"], given[DOTS]
    pressed, _ = over_range(given["touch.height_map"], sensor)
    return marker_displacements(pressed, sensor, float(levels[MARKER_NODES.name]), dots.in_gel(sensor.pitch))


def _markers(given: Given, _levels: Levels) -> ByteArray:
    sensor, dots = given["sensor"], given[DOTS]
    at = dots.in_gel(sensor.pitch)
    return draw_markers(given["touch.shadow"], given["touch.marker_motion"], sensor, dots.ink, at)


def _height_map(given: Given, levels: Levels) -> FloatArray:
    """As the catalogue's, over a surface of the gel's own."""
    poses, rays = given["contact.gel_from_object"], int(levels[SUPERSAMPLING.name])
    return reached(given["object.raster"], poses, given["sensor"], rays, given[REST])
