"""A picture by the networks of an ObjectFile: levels of ``camera.image`` beside rays on the mesh.

Sources, beside those of the camera: ``object.file`` (the object's ``ObjectFile``), ``object.mesh`` and
``object.wall``; asked for only where the picture comes from the file.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from harness.effects.accuracy import Knob, Level
from harness.effects.camera_effects import effects_when
from harness.effects.effect import Condition, Effect, Implementation
from harness.effects.sound_effects import NAMED
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.vision.render import ObjectVision

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

LOOK = Knob(
    "camera.look",
    ("network", "direct"),
    "",
    "method",
    "direct",
    "the ObjectFile's networks, one sample a ray; or rays on the mesh",
    removed=dict.fromkeys(("one_sample", "onnx"), "take network, which is one sample a ray by the graph"),
)


def _opened(given: Given, _levels: Levels) -> "ObjectVision":
    """Open the look of an object out of its ObjectFile.

    Raises:
        WrongUse: an ObjectFile of another object; what differs is said.
        DataRefused: it has no look, or a file of it is damaged.
    """
    # Loaded by those alone who take pictures from an ObjectFile.
    from harness.basics.errors import DataRefused
    from harness.objectfile.same_object import require_same_shape
    from harness.objectfile.vision.render import open_vision

    of, instead = given["object.file"], f"{LOOK.name} = direct"
    if of.description.vision is None:
        raise DataRefused(
            f"{of.folder} has no vision; add it with `touchstone object build --only vision`, or take "
            f"{instead}"
        )
    require_same_shape(of, walled(given["object.mesh"], given["object.wall"]), instead)
    return open_vision(of)


def _picture(given: Given, _levels: Levels) -> Any:
    vision: ObjectVision = given["object.vision"]
    return vision.lit(given["camera"], given["camera.lights"])


def scene_camera_effects(camera: Condition, lights: Condition) -> tuple[Effect, ...]:
    """The effects of the scene camera's picture.

    Args:
        camera: whether the scene has one.
        lights: whether there are lamps, and so shadows. Without any the object is black before whatever is
            behind it.
    """
    *others, image = effects_when(lights)
    network = Implementation(("object.vision", "camera", "camera.lights"), _picture, when=NAMED)
    return (
        *others,
        Effect("object.vision", ("object.file", "object.mesh", "object.wall"), _opened, when=NAMED),
        replace(image, when=camera, choice=LOOK, ways={"network": network}),
    )
