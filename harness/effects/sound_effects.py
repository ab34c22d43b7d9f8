"""The effects of sound, from the object's shape to the microphone's reading.

Sources, beside those of the touch: ``object.wall`` (m, or None for a mesh of the material
itself), ``object.file`` (the object's ``ObjectFile``; asked for only where modes come from it),
``strike`` (``Strikes``), ``room`` (``RoomField``), ``microphone`` (``MicrophoneResponse``).
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import AnyArray, FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Compute, Condition, Effect, Implementation
from harness.sim.modal.modal import (
    ELEMENT_SHARE,
    HEARING,
    VERSION,
    default_edge,
    from_arrays,
    modes_of,
    to_arrays,
)
from harness.sim.modal.modes import dampings
from harness.sim.solid.walls import walled
from harness.sim.sound.modal_radiation import radiation
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.room import as_heard, reverberated

if TYPE_CHECKING:
    from harness.objectfile.audio.audio import AudioLevel

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

EDGE = Knob(
    "sound.edge",
    (0.7, 0.5, 0.35, 0.25, 0.18),
    "waves",
    "number",
    ELEMENT_SHARE,
    "an element in shortest waves",
)
MODES = Knob("sound.modes", (16, 32, 64, 128, 256), "modes", "number", 128, "the lowest ones that are kept")
SHAPES = Knob(
    "sound.shapes",
    ("network", "table", "elements"),
    "",
    "method",
    "elements",
    "the ObjectFile's network, its table, or finite elements",
)

SOUND = Condition(lambda f: f.scene.sensors.sound, "sensors.sound is true", "sensors.sound is false")
NAMED = Condition(
    lambda f: f.scene.object.objectfile is not None,
    "the scene names an ObjectFile",
    "the scene names no ObjectFile (objectfile in [object])",
)
ROOM = Condition(lambda f: f.scene.room is not None, "the scene has a [room]", "the scene has no [room]")


def _modes(given: Given, levels: Levels) -> dict[str, AnyArray]:
    solid = walled(given["object.mesh"], given["object.wall"])
    material, most = given["object.material"], int(levels[MODES.name])
    edge = default_edge(solid, material, HEARING, most, float(levels[EDGE.name]))
    return to_arrays(modes_of(solid, material, HEARING, edge, most))


def _modes_of_file(level: "AudioLevel") -> Compute:
    def compute(given: Given, levels: Levels) -> dict[str, AnyArray]:
        # Loaded by those alone who take modes from an ObjectFile.
        from harness.objectfile.audio.sound_level import modes_from

        solid = walled(given["object.mesh"], given["object.wall"])
        material, most = given["object.material"], int(levels[MODES.name])
        return to_arrays(modes_from(given["object.file"], level, solid, material, most, HEARING))

    return compute


def _from_file(level: "AudioLevel") -> Implementation:
    needs = ("object.file", "object.mesh", "object.wall", "object.material")
    return Implementation(needs, _modes_of_file(level), when=NAMED, knobs=(MODES,))


def _sound(given: Given, _levels: Levels) -> FloatArray:
    modes, strike = from_arrays(given["object.modes"]), given["strike"]
    loudness = radiation(modes, given["microphone"].distance)
    gains = modes.gains(strike.points, strike.directions)
    decays = dampings(modes.frequencies, given["object.material"])
    return ring(modes.frequencies, decays, gains * loudness, strike.force, strike.rate)


def _reverberation(given: Given, _levels: Levels) -> FloatArray:
    return reverberated(given["object.sound"], given["room"].response(given["strike"].rate))


def _pressure(given: Given, _levels: Levels) -> FloatArray:
    return as_heard(given["room.reverberation"], given["strike"].rate, given["microphone"])


SOUND_EFFECTS = (
    Effect(
        "object.modes",
        ("object.mesh", "object.wall", "object.material"),
        _modes,
        when=SOUND,
        knobs=(EDGE, MODES),
        version=VERSION,
        stored=True,
        choice=SHAPES,
        ways={"network": _from_file("network"), "table": _from_file("table")},
    ),
    Effect(
        "object.sound",
        ("object.modes", "object.material", "strike", "microphone"),
        _sound,
        when=SOUND,
    ),
    Effect(
        "room.reverberation",
        ("object.sound", "room", "strike"),
        _reverberation,
        when=ROOM,
        bypass="object.sound",
    ),
    Effect("microphone.pressure", ("room.reverberation", "microphone", "strike"), _pressure, when=SOUND),
)
