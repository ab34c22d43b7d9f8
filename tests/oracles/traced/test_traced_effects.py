"""Path tracing as a level of the picture's effect."""

import numpy as np
import pytest

from harness.bench.scene import Light, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import evaluate
from harness.effects.plan import plan
from harness.effects.quantities import Quantities
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball
from tests.oracles.traced.camera_effects import LIGHT, TRACED_EFFECTS
from tests.oracles.traced.path_traced import TracedImage

LAMP = Light(position=("0 m", "0 m", "2 m"))  # type: ignore[arg-type]
SCENE = scene_from_options("builtin:mug").model_copy(
    update={"sensors": Sensors(camera=True), "lights": (LAMP,)}
)
FACTS = Facts(SCENE, GELSIGHT_R15)
GIVEN: Quantities = {
    "object_appearance": plain(ball(0.05, 3), (0.8, 0.5, 0.2)),
    "camera": Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), (0, 0, 1), 24, 16, 0.5),
    "camera_lights": (DirectionalLight(np.array([0.5, -0.6, 0.7])),),
}


def test_by_paths_nothing_of_the_direct_level_runs() -> None:
    accuracy = Accuracy.default(knobs_of(TRACED_EFFECTS)).with_({LIGHT.name: "paths"})
    made = plan(TRACED_EFFECTS, FACTS, ["camera.image"], accuracy)
    assert [step.effect.provides for step in made.ran] == ["object.traced", "camera.image"]
    direct = plan(TRACED_EFFECTS, FACTS, ["camera.image"], Accuracy.default(knobs_of(TRACED_EFFECTS)))
    assert "object.traced" not in [step.effect.provides for step in direct.ran]


def test_paths_give_a_picture_of_the_same_object() -> None:
    pytest.importorskip("mitsuba", reason="the extra 'oracles' is not installed")
    accuracy = Accuracy.default(knobs_of(TRACED_EFFECTS)).with_({LIGHT.name: "paths", "camera.bounces": 0})
    traced = evaluate(plan(TRACED_EFFECTS, FACTS, ["camera.image"], accuracy), GIVEN)["camera.image"]
    assert isinstance(traced, TracedImage)
    lit = LitObject(GIVEN["object_appearance"])
    direct = lit.render(GIVEN["camera"], GIVEN["camera_lights"], 8)
    assert direct.noise is not None
    difference = np.sqrt(np.mean((traced.image.colour - direct.image.colour) ** 2))
    assert difference < 2.0 * np.hypot(traced.noise, direct.noise)
