"""The effects of one picture of one object: exact visibility, its light, its own shadow.

Sources: ``object.appearance`` (``Appearance``), ``camera`` (``Pinhole``) and ``camera.lights`` (a sequence of
``DirectionalLight``), all in the object's frame. Another light computes no ray of the camera anew, and
without the shadow no ray towards a light is followed.
"""

from collections.abc import Mapping
from typing import Any

from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Condition, Effect
from harness.sim.light.direct_image import DirectImage, LitObject, VisibleSurface, gathered

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

SAMPLES = Knob(
    "camera.samples", (1, 2, 4, 8, 16), "rays a side", "number", 4, "rays a pixel of the camera, each way"
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
