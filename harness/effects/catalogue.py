"""Every effect of the simulation, in one list: what there is, what it needs, when it runs.

The functions here only take apart what the kernels take; the mathematics is theirs. Sources,
which the caller gives: ``object.mesh`` (``Mesh``), ``object.material`` (``Material``),
``contact.gel_from_object`` (``(n, 4, 4)``), ``sensor`` (``TactileSensor``),
``sensor.calibration`` (``TactileCalibration``), ``sensor.shadow_table`` (``ShadowTable``),
``sensor.noise`` (grey levels), ``seed``; for forces those of ``harness.effects.force_effects``; for sound
those of ``harness.effects.sound_effects``; for pictures those of ``harness.effects.camera_effects``; for
touch and pictures from an ObjectFile those of ``harness.effects.touch_file_effects`` and
``harness.effects.camera_effects``.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.camera_effects import scene_camera_effects
from harness.effects.effect import Condition, Effect
from harness.effects.force_effects import FORCE_EFFECT
from harness.effects.sound_effects import SOUND_EFFECTS
from harness.effects.touch_drawing import optics, reached
from harness.effects.touch_file_effects import FILE_EFFECTS, GEL_FROM_CODES, SHAPES
from harness.sim.gel.gel import deform, over_range
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.markers import draw_markers, marker_displacements
from harness.sim.optics.optics import with_camera_noise
from harness.sim.optics.shadow_image import darkened, darkening
from harness.sim.optics.tactile_calibration import Float32Array

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

SUPERSAMPLING = Knob("touch.supersampling", (1, 2, 3), "rays a side", "number", 1, "rays a pixel, each way")
GEL = Knob("touch.gel", ("fast", "exact"), "", "method", "exact", "how wide blurs of the gel are done")
OPTICS = Knob("touch.optics", ("smooth", "fast", "exact"), "", "method", "fast", "slope to colour")
MARKER_NODES = Knob("touch.marker_motion", (2, 4, 8), "nodes", "number", 4, "loads to one gel thickness")


def _prepare(given: Given, _levels: Levels) -> RasterMesh:
    return RasterMesh(given["object.mesh"])


def _height_map(given: Given, levels: Levels) -> FloatArray:
    poses, rays = given["contact.gel_from_object"], int(levels[SUPERSAMPLING.name])
    return reached(given["object.raster"], poses, given["sensor"], rays)


def _gel(given: Given, levels: Levels) -> FloatArray:
    # Estimated contacts are simulated too: what reaches deeper than the gel is held at its thickness here;
    # ``touch_press`` refuses such a press where a user requests it.
    pressed, _ = over_range(given["touch.height_map"], given["sensor"])
    skirt = given["sensor.calibration"].header.skirt
    return deform(pressed, skirt, "fast" if levels[GEL.name] == "fast" else "exact")


def _colour(given: Given, levels: Levels) -> ByteArray:
    drawn = optics(given["sensor.calibration"], str(levels[OPTICS.name]), given["sensor"])
    return drawn.render(given["touch.gel"]).images


def _darkening(given: Given, _levels: Levels) -> tuple[Float32Array, FloatArray]:
    return darkening(
        given["touch.colour"],
        given["touch.height_map"],
        given["touch.gel"],
        given["sensor"],
        given["sensor.calibration"],
        given["sensor.shadow_table"],
    )


def _shadow(given: Given, _levels: Levels) -> ByteArray:
    return darkened(given["touch.colour"], given["touch.darkening"][0])


def _shadow_out_of_table(given: Given, _levels: Levels) -> FloatArray:
    share: FloatArray = given["touch.darkening"][1]
    return share


def _marker_motion(given: Given, levels: Levels) -> FloatArray:
    pressed, _ = over_range(given["touch.height_map"], given["sensor"])
    return marker_displacements(pressed, given["sensor"], float(levels[MARKER_NODES.name]))


def _markers(given: Given, _levels: Levels) -> ByteArray:
    return draw_markers(given["touch.shadow"], given["touch.marker_motion"], given["sensor"])


def _noise(given: Given, _levels: Levels) -> FloatArray:
    return with_camera_noise(given["touch.markers"], given["sensor.noise"], given["seed"])


def _image(given: Given, _levels: Levels) -> ByteArray:
    seen: ByteArray = given["touch.noise"]
    if seen.dtype == np.uint8:
        return seen
    return np.clip(np.rint(seen), 0.0, 255.0).astype(np.uint8)


TOUCH = Condition(lambda f: f.scene.sensors.touch, "sensors.touch is true", "sensors.touch is false")
SHADOW = Condition(
    lambda f: f.sensor.casts_shadow, "the sensor's light casts shadows", "the sensor casts no shadows"
)
MARKERS = Condition(lambda f: f.sensor.markers is not None, "the gel has markers", "the gel has no markers")
NOISE = Condition(lambda f: f.scene.sensors.noise, "sensors.noise is true", "sensors.noise is false")
CAMERA = Condition(lambda f: f.scene.sensors.camera, "sensors.camera is true", "sensors.camera is false")
LIGHTS = Condition(lambda f: bool(f.scene.lights), "the scene has [[lights]]", "the scene has no [[lights]]")

EFFECTS = (
    Effect("object.raster", ("object.mesh",), _prepare),
    Effect(
        "touch.height_map",
        ("object.raster", "contact.gel_from_object", "sensor"),
        _height_map,
        knobs=(SUPERSAMPLING,),
    ),
    FORCE_EFFECT,
    *FILE_EFFECTS,
    Effect(
        "touch.gel",
        ("touch.height_map", "sensor", "sensor.calibration"),
        _gel,
        knobs=(GEL,),
        choice=SHAPES,
        ways={"network": GEL_FROM_CODES},
    ),
    Effect("touch.colour", ("touch.gel", "sensor", "sensor.calibration"), _colour, knobs=(OPTICS,)),
    Effect(
        "touch.darkening",
        (
            "touch.colour",
            "touch.height_map",
            "touch.gel",
            "sensor",
            "sensor.calibration",
            "sensor.shadow_table",
        ),
        _darkening,
        when=SHADOW,
    ),
    Effect("touch.shadow", ("touch.colour", "touch.darkening"), _shadow, when=SHADOW, bypass="touch.colour"),
    Effect("touch.shadow_out_of_table", ("touch.darkening",), _shadow_out_of_table, when=SHADOW),
    Effect(
        "touch.marker_motion",
        ("touch.height_map", "sensor"),
        _marker_motion,
        when=MARKERS,
        knobs=(MARKER_NODES,),
    ),
    Effect(
        "touch.markers",
        ("touch.shadow", "touch.marker_motion", "sensor"),
        _markers,
        when=MARKERS,
        bypass="touch.shadow",
    ),
    Effect(
        "touch.noise", ("touch.markers", "sensor.noise", "seed"), _noise, when=NOISE, bypass="touch.markers"
    ),
    Effect("touch.image", ("touch.noise",), _image, when=TOUCH),
    *SOUND_EFFECTS,
    *scene_camera_effects(CAMERA, LIGHTS),
)
