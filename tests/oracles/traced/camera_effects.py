"""Path tracing as another way to compute a picture: light that bounces, beside the direct level."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from harness.effects.accuracy import Knob, Level
from harness.effects.camera_effects import camera_effects
from harness.effects.effect import Compute, Effect, Implementation
from tests.oracles.traced.path_traced import PathTraced, TracedImage

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

LIGHT = Knob(
    "camera.image", ("direct", "paths"), "", "method", "direct", "without noise, or by Mitsuba's paths"
)
PATHS = Knob("camera.paths", (16, 64, 256, 1024), "rays", "number", 64, "paths a pixel of the camera")
BOUNCES = Knob("camera.bounces", (0, 1, 2, 4, 8), "bounces", "number", 2, "of light between its places")


def traced_camera_effects(shadow: bool) -> tuple[Effect, ...]:
    """The effects of ``camera_effects``, with the level ``paths`` of ``camera.image`` beside ``direct``.

    Args:
        shadow: whether the object is in its own light's way.
    """
    *others, image = camera_effects(shadow)
    paths = Implementation(
        ("object.traced", "camera", "camera.lights"), _traced(shadow), knobs=(PATHS, BOUNCES)
    )
    return (
        *others,
        Effect(
            "object.traced", ("object.appearance",), lambda given, _: PathTraced(given["object.appearance"])
        ),
        replace(image, choice=LIGHT, ways={"paths": paths}),
    )


def _traced(shadow: bool) -> Compute:
    def compute(given: Given, levels: Levels) -> TracedImage:
        traced: PathTraced = given["object.traced"]
        paths, bounces = int(levels[PATHS.name]), int(levels[BOUNCES.name])
        return traced.render(given["camera"], given["camera.lights"], paths, shadow, bounces)

    return compute
