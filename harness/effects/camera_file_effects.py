"""A picture by the networks of an ObjectFile: levels of ``camera.image`` beside rays on the mesh.

Sources, beside those of the camera: ``object.file`` (the object's ``ObjectFile``), ``object.mesh`` and
``object.wall``; asked for only where the picture comes from the file.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from harness.effects.accuracy import Knob, Level
from harness.effects.camera_effects import effects_when
from harness.effects.effect import Compute, Condition, Effect, Implementation
from harness.effects.sound_effects import NAMED
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.vision.settings import VisionLevel
    from harness.objectfile.vision.vision import ObjectVision

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

LOOK = Knob(
    "camera.look",
    ("one_sample", "onnx", "network", "direct"),
    "",
    "method",
    "direct",
    "the ObjectFile's networks: at one sample a pixel, by their graph, by our kernel; or rays on the mesh",
)


def _opened(given: Given, _levels: Levels) -> "ObjectVision":
    # Loaded by those alone who take pictures from an ObjectFile.
    from harness.objectfile.vision.level import vision_from

    return vision_from(given["object.file"], walled(given["object.mesh"], given["object.wall"]))


def _from_file(level: "VisionLevel") -> Implementation:
    return Implementation(("object.vision", "camera", "camera.lights"), _picture(level), when=NAMED)


def _picture(level: "VisionLevel") -> Compute:
    def compute(given: Given, _levels: Levels) -> Any:
        from harness.objectfile.vision.settings import RenderSettings

        vision: ObjectVision = given["object.vision"]
        return vision.lit(given["camera"], given["camera.lights"], RenderSettings(level=level))

    return compute


def scene_camera_effects(camera: Condition, lights: Condition) -> tuple[Effect, ...]:
    """The effects of the scene camera's picture.

    Args:
        camera: whether the scene has one.
        lights: whether there are lamps, and so shadows. Without any the object is black before whatever is
            behind it.
    """
    *others, image = effects_when(lights)
    ways: dict[Level, Implementation] = {
        "network": _from_file("fused"),
        "onnx": _from_file("onnx"),
        "one_sample": _from_file("one_sample"),
    }
    return (
        *others,
        Effect("object.vision", ("object.file", "object.mesh", "object.wall"), _opened, when=NAMED),
        replace(image, when=camera, choice=LOOK, ways=ways),
    )
