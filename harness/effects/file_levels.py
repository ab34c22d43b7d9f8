"""Which networks of an ObjectFile stand for the simulation where nobody chooses."""

from collections.abc import Mapping

from harness.bench.scene import SceneFile
from harness.effects.accuracy import Knob, Level
from harness.effects.camera_effects import LOOK
from harness.effects.scene_object import named_file
from harness.effects.sound_effects import SHAPES as SOUND
from harness.effects.touch_file_effects import SHAPES as TOUCH
from harness.objectfile.description import Description
from harness.objectfile.entries import Modality

NETWORK = "network"
"""The level of every dial at which an ObjectFile's network stands for the simulation."""

DIALS: Mapping[Modality, Knob[Level]] = {"audio": SOUND, "touch": TOUCH, "vision": LOOK}
"""By the part of an ObjectFile that a level of them is."""


def senses_of(scene: SceneFile) -> tuple[Modality, ...]:
    """Those that a scene calls for, by the names of an ObjectFile's parts."""
    sensors = scene.sensors
    wanted: dict[Modality, bool] = {
        "audio": sensors.sound,
        "touch": sensors.touch,
        "vision": sensors.camera,
    }
    return tuple(sense for sense, called_for in wanted.items() if called_for)


def networks_of(of: Description) -> frozenset[Modality]:
    """The senses that an ObjectFile has a network of, which stands for the simulation."""
    has: dict[Modality, bool] = {
        "audio": of.audio is not None and of.audio.network is not None,
        "touch": of.touch is not None and of.touch.codes is not None,
        "vision": of.vision is not None,
    }
    return frozenset(sense for sense, there in has.items() if there)


def network_levels(scene: SceneFile, of: Description) -> dict[str, Level]:
    """The network of each sense that a scene calls for and an ObjectFile has, by the name of its dial."""
    has = networks_of(of)
    return {DIALS[sense].name: NETWORK for sense in senses_of(scene) if sense in has}


def scene_levels(scene: SceneFile) -> dict[str, Level]:
    """The same of the ObjectFile that a scene names; none where it names none.

    Raises:
        DataRefused: the ObjectFile is damaged.
    """
    if scene.object.objectfile is None:
        return {}
    return network_levels(scene, named_file(scene).description)
