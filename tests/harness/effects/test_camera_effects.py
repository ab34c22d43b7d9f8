"""A picture as effects: the same as rendered at once, and nothing computed that is not called for."""

import numpy as np
import pytest

from harness.bench.scene import Light, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.camera import SAMPLES
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.plan import plan
from harness.effects.quantities import Quantities
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import DirectImage, LitObject
from tests.oracles.seen_shapes import ball

GIVEN: Quantities = {
    "object_appearance": plain(ball(0.05, 3), (0.8, 0.5, 0.2)),
    "camera": Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), (0, 0, 1), 24, 16, 0.5),
    "camera_lights": (DirectionalLight(np.array([0.5, -0.6, 0.7])),),
}


def evaluated(shadow: bool, samples: int = 2) -> Evaluation:
    """With a shadow where the scene has a lamp."""
    lamps = (Light(position=("0 m", "0 m", "2 m")),) if shadow else ()  # type: ignore[arg-type]
    update = {"sensors": Sensors(camera=True), "lights": lamps}
    facts = Facts(scene_from_options("builtin:mug").model_copy(update=update), GELSIGHT_R15)
    accuracy = Accuracy(knobs_of(EFFECTS), {SAMPLES.name: samples})
    return evaluate(plan(EFFECTS, facts, ["camera.image"], accuracy), GIVEN)


@pytest.mark.parametrize("shadow", [True, False])
def test_effects_give_the_picture_that_is_rendered_at_once(shadow: bool) -> None:
    found = evaluated(shadow).picture.image
    assert isinstance(found, DirectImage)
    lit = LitObject(GIVEN["object_appearance"])
    expected = lit.render(GIVEN["camera"], GIVEN["camera_lights"], 2, shadow)
    np.testing.assert_array_equal(found.image.colour, expected.image.colour)
    np.testing.assert_array_equal(found.image.depth, expected.image.depth)
    assert found.noise == expected.noise


def test_without_shadows_no_ray_towards_a_light_is_followed() -> None:
    assert "camera.shadow" in evaluated(True).calls
    assert "camera.shadow" not in evaluated(False).calls


def test_every_effect_tells_its_seconds() -> None:
    drawn = {"object.lit", "camera.seen", "camera.falling", "camera.shadow", "camera.image"}
    assert set(evaluated(True).seconds) == drawn
