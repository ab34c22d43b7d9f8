"""A picture as effects: the same as rendered at once, and nothing computed that is not called for."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.bench.scene import load_scene
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.camera_effects import SAMPLES, camera_effects
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.plan import plan
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball

FACTS = Facts(load_scene(Path(__file__).parents[3] / "scenes" / "mug_touch.toml"), GELSIGHT_R15)
GIVEN: dict[str, Any] = {
    "object.appearance": plain(ball(0.05, 3), (0.8, 0.5, 0.2)),
    "camera": Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), (0, 0, 1), 24, 16, 0.5),
    "camera.lights": (DirectionalLight(np.array([0.5, -0.6, 0.7])),),
}


def evaluated(shadow: bool, samples: int = 2) -> Evaluation:
    effects = camera_effects(shadow)
    accuracy = Accuracy.default(knobs_of(effects)).with_({SAMPLES.name: samples})
    return evaluate(plan(effects, FACTS, ["camera.image"], accuracy), GIVEN)


@pytest.mark.parametrize("shadow", [True, False])
def test_effects_give_the_picture_that_is_rendered_at_once(shadow: bool) -> None:
    found = evaluated(shadow)["camera.image"]
    lit = LitObject(GIVEN["object.appearance"])
    expected = lit.render(GIVEN["camera"], GIVEN["camera.lights"], 2, shadow)
    np.testing.assert_array_equal(found.image.colour, expected.image.colour)
    np.testing.assert_array_equal(found.image.depth, expected.image.depth)
    assert found.noise == expected.noise


def test_without_shadows_no_ray_towards_a_light_is_followed() -> None:
    assert "camera.shadow" in evaluated(True).calls
    assert "camera.shadow" not in evaluated(False).calls


def test_every_effect_tells_its_seconds() -> None:
    assert set(evaluated(True).seconds) == {effect.provides for effect in camera_effects(True)}
