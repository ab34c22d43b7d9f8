"""The effects of one picture of one object: exact visibility, its light, its own shadow.

Sources: ``object.appearance`` (``Appearance``), ``camera`` (``Pinhole``) and ``camera.lights`` (a sequence of
``DirectionalLight``), all in the object's frame. Another light computes no ray of the camera anew, and
without the shadow no ray towards a light is followed.

A picture by the networks of an ObjectFile is a level of ``camera.image`` next to rays on the mesh. Its
sources are those of the camera and ``object.file`` (the object's ``ObjectFile``), ``object.mesh`` and
``object.wall``.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Condition, Effect, Implementation
from harness.effects.sound_effects import NAMED
from harness.sim.light.direct_image import DirectImage, LitObject, VisibleSurface, gathered
from harness.sim.solid.walls import walled

Given = Mapping[str, Any]
Levels = Mapping[str, Level]
SAMPLES = Knob(
    "camera.samples", (1, 2, 4, 8, 16), "rays a side", "number", 4, "rays a pixel of the camera, each way"
)

if TYPE_CHECKING:
    from harness.objectfile.vision.render import ObjectVision
LOOK = Knob(
    "camera.look",
    ("network", "direct"),
    "",
    "method",
    "direct",
    "the ObjectFile's networks, one sample a ray; or rays on the mesh",
    removed={"one_sample": "network", "onnx": "network"},
)


def _lit(given: Given, _levels: Levels) -> LitObject:
    return LitObject(given["object.appearance"])


def _seen(given: Given, levels: Levels) -> VisibleSurface:
    lit: LitObject = given["object.lit"]
    return lit.seen(given["camera"], int(levels[SAMPLES.name]))


def _falling(given: Given, _levels: Levels) -> FloatArray:
    lit: LitObject = given["object.lit"]
    return lit.falling(given["camera.seen"], given["camera.lights"])


def _shadow(given: Given, _levels: Levels) -> FloatArray:
    lit: LitObject = given["object.lit"]
    return lit.shadowed(given["camera.seen"], given["camera.lights"], given["camera.falling"])


def _image(given: Given, _levels: Levels) -> DirectImage:
    return gathered(given["camera.seen"], given["camera.shadow"])


def camera_effects(shadow: bool) -> tuple[Effect, ...]:
    """The effects of a picture.

    Args:
        shadow: whether the object is in its own light's way.
    """
    return effects_when(Condition(lambda _: shadow, "shadows are asked for", "no shadow is asked for"))


def effects_when(shadow: Condition) -> tuple[Effect, ...]:
    """The effects of a picture, the last of which is the picture.

    Args:
        shadow: when the object is in its own light's way.
    """
    return (
        Effect("object.lit", ("object.appearance",), _lit),
        Effect("camera.seen", ("object.lit", "camera"), _seen, knobs=(SAMPLES,)),
        Effect("camera.falling", ("object.lit", "camera.seen", "camera.lights"), _falling),
        Effect(
            "camera.shadow",
            ("camera.falling", "object.lit", "camera.seen", "camera.lights"),
            _shadow,
            when=shadow,
            bypass="camera.falling",
        ),
        Effect("camera.image", ("camera.seen", "camera.shadow"), _image),
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
