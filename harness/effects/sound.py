"""The effects of sound, from the object's shape to the microphone's reading."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.effects.accuracy import Knob
from harness.objectfile.file import ObjectFile
from harness.sim.modal.modal import ELEMENT_SHARE, HEARING, default_edge, from_arrays, modes_of, to_arrays
from harness.sim.modal.modes import dampings
from harness.sim.solid.walls import walled
from harness.sim.sound.modal_sound import Strikes, radiation, ring
from harness.sim.sound.room import MicrophoneResponse, RoomField, as_heard, reverberated

if TYPE_CHECKING:
    from harness.objectfile.audio.audio import AudioLevel

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


def solve_modes(
    object_mesh: Mesh,
    object_wall: float | None,
    object_material: Material,
    *,
    sound_edge: float,
    sound_modes: int,
) -> Mapping[str, AnyArray]:
    """Solve the object's modes by finite elements."""
    solid = walled(object_mesh, object_wall)
    edge = default_edge(solid, object_material, HEARING, sound_modes, sound_edge)
    return to_arrays(modes_of(solid, object_material, HEARING, edge, sound_modes))


def evaluate_network(
    object_file: ObjectFile,
    object_mesh: Mesh,
    object_wall: float | None,
    object_material: Material,
    *,
    sound_modes: int,
) -> Mapping[str, AnyArray]:
    """Evaluate the modes from the network of an ObjectFile."""
    return _modes_of_file(
        object_file, "network", walled(object_mesh, object_wall), object_material, sound_modes
    )


def read_table(
    object_file: ObjectFile,
    object_mesh: Mesh,
    object_wall: float | None,
    object_material: Material,
    *,
    sound_modes: int,
) -> Mapping[str, AnyArray]:
    """Read the modes from the table of an ObjectFile."""
    return _modes_of_file(
        object_file, "table", walled(object_mesh, object_wall), object_material, sound_modes
    )


def _modes_of_file(
    of: ObjectFile, level: "AudioLevel", solid: Mesh, material: Material, most: int
) -> Mapping[str, AnyArray]:
    # Loaded only where modes come from an ObjectFile.
    from harness.objectfile.audio.sound_level import modes_from

    return to_arrays(modes_from(of, level, solid, material, most, HEARING))


def ring_object(
    object_modes: Mapping[str, AnyArray],
    object_material: Material,
    strike: Strikes,
    microphone: MicrophoneResponse,
) -> FloatArray:
    """Compute the pressure of the struck modes at the microphone's distance, in the open."""
    modes = from_arrays(object_modes)
    loudness = radiation(modes, microphone.distance)
    gains = modes.gains(strike.points, strike.directions)
    decays = dampings(modes.frequencies, object_material)
    return ring(modes.frequencies, decays, gains * loudness, strike.force, strike.rate)


def reverberate(object_sound: FloatArray, room: RoomField, strike: Strikes) -> FloatArray:
    """Add the room's reverberation."""
    return reverberated(object_sound, room.response(strike.rate))


def record_pressure(
    room_reverberation: FloatArray, microphone: MicrophoneResponse, strike: Strikes
) -> FloatArray:
    """Filter the sound as the microphone does."""
    return as_heard(room_reverberation, strike.rate, microphone)
