"""Every effect of the simulation, one row each: its function, when it runs, and its knobs.

``EFFECTS`` is what a scene is compared with. The networks of an ObjectFile are levels of the effects that
they stand for; ``DIALS`` has the knobs of these levels.
"""

from collections.abc import Mapping

from harness.bench.scene import SceneFile
from harness.effects import camera, force, sound, touch
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Condition, Effect, build_catalogue
from harness.effects.scene_object import named_file
from harness.objectfile.description import Description
from harness.objectfile.entries import Modality
from harness.sim.modal.modal import VERSION

TOUCH = Condition(lambda f: f.scene.sensors.touch, "sensors.touch is true", "sensors.touch is false")
SHADOW = Condition(
    lambda f: f.sensor.casts_shadow, "the sensor's light casts shadows", "the sensor casts no shadows"
)
MARKERS = Condition(lambda f: f.sensor.markers is not None, "the gel has markers", "the gel has no markers")
NOISE = Condition(lambda f: f.scene.sensors.noise, "sensors.noise is true", "sensors.noise is false")
SOUND = Condition(lambda f: f.scene.sensors.sound, "sensors.sound is true", "sensors.sound is false")
ROOM = Condition(lambda f: f.scene.room is not None, "the scene has a [room]", "the scene has no [room]")
CAMERA = Condition(lambda f: f.scene.sensors.camera, "sensors.camera is true", "sensors.camera is false")
LIGHTS = Condition(lambda f: bool(f.scene.lights), "the scene has [[lights]]", "the scene has no [[lights]]")
NAMED = Condition(
    lambda f: f.scene.object.objectfile is not None,
    "the scene names an ObjectFile",
    "the scene names no ObjectFile (objectfile in [object])",
)

SOUND_EFFECTS = (
    Effect(
        "object.modes",
        sound.solve_modes,
        when=SOUND,
        knobs=(sound.EDGE, sound.MODES),
        version=VERSION,
        stored=True,
        choice=sound.SHAPES,
        ways={
            "network": Effect("object.modes", sound.evaluate_network, when=NAMED, knobs=(sound.MODES,)),
            "table": Effect("object.modes", sound.read_table, when=NAMED, knobs=(sound.MODES,)),
        },
    ),
    Effect("object.sound", sound.ring_object, when=SOUND),
    Effect("room.reverberation", sound.reverberate, when=ROOM, bypass="object.sound"),
    Effect("microphone.pressure", sound.record_pressure, when=SOUND),
)

EFFECTS = build_catalogue(
    Effect("object.raster", touch.rasterize_object),
    Effect("touch.height_map", touch.compute_height_map, knobs=(touch.SUPERSAMPLING,)),
    Effect(
        "touch.force",
        force.press_layer,
        knobs=(force.CELLS,),
        choice=force.FORCE,
        ways={
            "winkler": Effect("touch.force", force.press_springs),
            "table": Effect("touch.force", force.look_up_force),
        },
    ),
    Effect("contact.presses", touch.find_presses),
    Effect("object.touch_codes", touch.open_touch_codes, when=NAMED),
    Effect(
        "touch.gel",
        touch.deform_gel,
        knobs=(touch.GEL,),
        choice=touch.SHAPES,
        ways={"network": Effect("touch.gel", touch.decode_gel, when=NAMED)},
    ),
    Effect("touch.colour", touch.render_colour, knobs=(touch.OPTICS,)),
    Effect("touch.darkening", touch.compute_darkening, when=SHADOW),
    Effect("touch.shadow", touch.cast_shadow, when=SHADOW, bypass="touch.colour"),
    Effect("touch.shadow_out_of_table", touch.select_out_of_table, when=SHADOW),
    Effect("touch.marker_motion", touch.move_markers, when=MARKERS, knobs=(touch.MARKER_NODES,)),
    Effect("touch.markers", touch.print_markers, when=MARKERS, bypass="touch.shadow"),
    Effect("touch.noise", touch.add_noise, when=NOISE, bypass="touch.markers"),
    Effect("touch.image", touch.quantize_image, when=TOUCH),
    *SOUND_EFFECTS,
    Effect("object.lit", camera.prepare_object),
    Effect("camera.seen", camera.trace_camera, knobs=(camera.SAMPLES,)),
    Effect("camera.falling", camera.illuminate),
    Effect("camera.shadow", camera.cast_shadow, when=LIGHTS, bypass="camera.falling"),
    Effect("object.vision", camera.open_object_vision, when=NAMED),
    Effect(
        "camera.image",
        camera.gather_image,
        when=CAMERA,
        choice=camera.LOOK,
        ways={"network": Effect("camera.image", camera.render_network, when=NAMED)},
    ),
)

NETWORK = "network"
"""The level of every knob at which an ObjectFile's network stands for the simulation."""

DIALS: Mapping[Modality, Knob[Level]] = {"audio": sound.SHAPES, "touch": touch.SHAPES, "vision": camera.LOOK}
"""The knobs that choose between a network and its simulation, by the part of an ObjectFile."""


def senses_of(scene: SceneFile) -> tuple[Modality, ...]:
    """Return the senses that a scene calls for, by the names of an ObjectFile's parts."""
    sensors = scene.sensors
    wanted: dict[Modality, bool] = {"audio": sensors.sound, "touch": sensors.touch, "vision": sensors.camera}
    return tuple(sense for sense, called_for in wanted.items() if called_for)


def networks_of(of: Description) -> frozenset[Modality]:
    """Return the senses for which an ObjectFile has a network that stands for the simulation."""
    has: dict[Modality, bool] = {
        "audio": of.audio is not None and of.audio.network is not None,
        "touch": of.touch is not None and of.touch.codes is not None,
        "vision": of.vision is not None,
    }
    return frozenset(sense for sense, there in has.items() if there)


def network_levels(scene: SceneFile, of: Description) -> dict[str, Level]:
    """Return the network level of each sense that a scene calls for and an ObjectFile has, by its knob."""
    has = networks_of(of)
    return {DIALS[sense].name: NETWORK for sense in senses_of(scene) if sense in has}


def scene_levels(scene: SceneFile) -> dict[str, Level]:
    """Return the same for the ObjectFile that a scene names; nothing where it names none.

    Raises:
        DataRefused: the ObjectFile is damaged.
    """
    if scene.object.objectfile is None:
        return {}
    return network_levels(scene, named_file(scene).description)
