"""Path tracing as another way to compute a picture: light that bounces, beside the direct level."""

from collections.abc import Sequence
from dataclasses import replace

from harness.effects.accuracy import Knob
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from tests.oracles.traced.path_traced import PathTraced, TracedImage

LIGHT = Knob(
    "camera.image", ("direct", "paths"), "", "method", "direct", "without noise, or by Mitsuba's paths"
)
PATHS = Knob("camera.paths", (16, 64, 256, 1024), "rays", "number", 64, "paths a pixel of the camera")
BOUNCES = Knob("camera.bounces", (0, 1, 2, 4, 8), "bounces", "number", 2, "of light between its places")


def prepare_traced(object_appearance: Appearance) -> PathTraced:
    return PathTraced(object_appearance)


def trace_paths(
    object_traced: PathTraced,
    camera: Pinhole,
    camera_lights: Sequence[DirectionalLight],
    *,
    camera_paths: int,
    camera_bounces: int,
) -> TracedImage:
    return object_traced.render(camera, camera_lights, camera_paths, True, camera_bounces)


PATHS_WAY = Effect("camera.image", trace_paths, knobs=(PATHS, BOUNCES))

TRACED_EFFECTS = (
    *(
        replace(effect, choice=LIGHT, ways={"paths": PATHS_WAY})
        if effect.provides == "camera.image"
        else effect
        for effect in EFFECTS
    ),
    Effect("object.traced", prepare_traced),
)
"""The catalogue, with the level ``paths`` of ``camera.image`` beside ``direct``."""
