"""Path tracing as a level of the picture's effect."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.bench.scene import load_scene
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import evaluate
from harness.effects.plan import plan
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball
from tests.oracles.traced.camera_effects import LIGHT, traced_camera_effects

FACTS = Facts(load_scene(Path(__file__).parents[3] / "scenes" / "mug_touch.toml"), GELSIGHT_R15)
GIVEN: dict[str, Any] = {
    "object.appearance": plain(ball(0.05, 3), (0.8, 0.5, 0.2)),
    "camera": Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), (0, 0, 1), 24, 16, 0.5),
    "camera.lights": (DirectionalLight(np.array([0.5, -0.6, 0.7])),),
}


def test_by_paths_nothing_of_the_direct_level_runs() -> None:
    effects = traced_camera_effects(True)
    accuracy = Accuracy.default(knobs_of(effects)).with_({LIGHT.name: "paths"})
    made = plan(effects, FACTS, ["camera.image"], accuracy)
    assert [step.effect.provides for step in made.ran] == ["object.traced", "camera.image"]
    direct = plan(effects, FACTS, ["camera.image"], Accuracy.default(knobs_of(effects)))
    assert "object.traced" not in [step.effect.provides for step in direct.ran]


def test_paths_give_a_picture_of_the_same_object() -> None:
    pytest.importorskip("mitsuba", reason="the extra 'oracles' is not installed")
    effects = traced_camera_effects(True)
    accuracy = Accuracy.default(knobs_of(effects)).with_({LIGHT.name: "paths", "camera.bounces": 0})
    traced = evaluate(plan(effects, FACTS, ["camera.image"], accuracy), GIVEN)["camera.image"]
    lit = LitObject(GIVEN["object.appearance"])
    direct = lit.render(GIVEN["camera"], GIVEN["camera.lights"], 8)
    assert direct.noise is not None
    difference = np.sqrt(np.mean((traced.image.colour - direct.image.colour) ** 2))
    assert difference < 2.0 * np.hypot(traced.noise, direct.noise)
