"""The catalogue: what a scene calls for runs, by count of kernel calls, and nothing else does."""

from collections import Counter
from dataclasses import replace
from functools import wraps
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import inverse, transform
from harness.basics.mesh import Mesh
from harness.bench.scene import Light, Room, SceneFile, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15, MarkerGrid
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, Facts, build_catalogue, knobs_of
from harness.effects.evaluate import evaluate
from harness.effects.explain import as_json, as_table, left_out, scene_plan
from harness.effects.plan import default_accuracy, plan
from harness.effects.quantities import Quantities
from harness.objects.household import build
from harness.sim.gel.markers import draw_markers
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

SCENE = scene_from_options("builtin:mug")
DOTTED = replace(GELSIGHT_R15, markers=MarkerGrid(7, 9, 2e-3, 0.4e-3))
GRAZED = replace(GELSIGHT_R15, casts_shadow=True)


@pytest.fixture(scope="module")
def mug() -> Mesh:
    return build("mug")


@pytest.fixture(scope="module")
def calibration() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


def press(mesh: Mesh, depth: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """``(1, 4, 4)``: the gel pressed from outside on the wall, opposite the handle."""
    reach = float(mesh.bounds[0, 0])
    rotation = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # gel z along +x
    object_from_gel = transform(rotation, np.array([reach + depth, 0.0, 0.05]))
    return inverse(object_from_gel[None])


def sources(mug: Mesh, calibration: TactileCalibration, *depths: float) -> Quantities:
    return {
        "object_mesh": mug,
        "contact_gel_from_object": np.concatenate([press(mug, depth) for depth in depths]),
        "sensor": GELSIGHT_R15,
        "sensor_calibration": calibration,
        "sensor_noise": 1.5,
        "seed": 3,
    }


def with_sensors(**on: bool) -> SceneFile:
    return SCENE.model_copy(update={"sensors": Sensors(**on)})


def counting(count: Counter[str]) -> tuple[Effect, ...]:
    def wrap(effect: Effect) -> Effect:
        @wraps(effect.compute)
        def compute(**given: Any) -> object:
            count[effect.provides] += 1
            return effect.compute(**given)

        return replace(effect, compute=compute)

    return tuple(wrap(effect) for effect in EFFECTS)


def test_a_touch_scene_computes_no_sound_room_light_or_dynamics() -> None:
    explained = as_json(scene_plan(SCENE, GELSIGHT_R15))
    assert [step["effect"] for step in explained["ran"]] == [
        "object.raster",
        "touch.height_map",
        "touch.gel",
        "touch.colour",
        "touch.image",
    ]
    skipped = {step["effect"]: step["reason"] for step in explained["skipped"]}
    assert skipped["touch.shadow"] == "the sensor casts no shadows; touch.colour passes through"
    assert skipped["touch.markers"] == "the gel has no markers; touch.colour passes through"
    assert skipped["object.modes"] == skipped["object.sound"] == "sensors.sound is false"
    assert skipped["microphone.pressure"] == "sensors.sound is false"
    assert skipped["room.reverberation"] == "the scene has no [room]"
    assert skipped["camera.image"] == "sensors.camera is false"
    assert skipped["camera.shadow"] == "the scene has no [[lights]]"
    assert skipped["touch.force"] == "nothing asked for touch.force"
    assert len(explained["ran"]) + len(explained["skipped"]) == len(EFFECTS)


def test_kernel_calls_are_exactly_the_plan(mug: Mesh, calibration: TactileCalibration) -> None:
    count: Counter[str] = Counter()
    effects = counting(count)
    made = plan(effects, Facts(SCENE, GELSIGHT_R15), ["touch.image"], default_accuracy(effects))
    evaluate(made, sources(mug, calibration, 1e-3, 0.5e-3))
    assert count == {step.effect.provides: 1 for step in made.ran}


def test_a_press_is_seen_where_it_is_and_nothing_elsewhere(
    mug: Mesh, calibration: TactileCalibration
) -> None:
    made = scene_plan(SCENE, GELSIGHT_R15)
    done = evaluate(made, sources(mug, calibration, 1e-3, -5e-3, 2e-3))
    pressed, untouched, _ = done.values["touch_image"]
    deepest = done.values["touch_height_map"].max(axis=(1, 2))
    assert deepest[2] - deepest[0] == pytest.approx(1e-3, abs=1e-12)
    assert deepest[1] == 0.0
    assert np.array_equal(untouched, calibration.background)
    assert np.abs(pressed.astype(int) - calibration.background).max() > 20
    assert done.values["touch_image"].dtype == np.uint8


def test_a_batch_is_the_contacts_one_by_one(mug: Mesh, calibration: TactileCalibration) -> None:
    made = scene_plan(with_sensors(noise=False), GELSIGHT_R15)
    depths = (0.3e-3, 1e-3, 1.7e-3)
    whole = evaluate(made, sources(mug, calibration, *depths)).values["touch_image"]
    each = [evaluate(made, sources(mug, calibration, depth)).values["touch_image"][0] for depth in depths]
    assert np.array_equal(whole, np.array(each))


def test_a_finer_supersampling_converges(mug: Mesh, calibration: TactileCalibration) -> None:
    def heights(rays: int) -> Any:
        accuracy = Accuracy(knobs_of(EFFECTS), {"touch.supersampling": rays})
        return evaluate(scene_plan(SCENE, GELSIGHT_R15, accuracy), sources(mug, calibration, 1e-3))[
            "touch.height_map"
        ]

    finest = heights(3)
    errors = [float(np.abs(heights(rays) - finest).mean()) for rays in (1, 2)]
    assert finest.shape == (1, GELSIGHT_R15.rows, GELSIGHT_R15.columns)
    assert 0.0 < errors[1] < errors[0] < 1e-5


def test_an_estimated_contact_is_held_at_the_gel_s_thickness(
    mug: Mesh, calibration: TactileCalibration
) -> None:
    """Presses that a user requests are refused: ``tests/harness/commands/press`` and ``test_api``."""
    done = evaluate(scene_plan(SCENE, GELSIGHT_R15), sources(mug, calibration, 1e-3, 4e-3))
    assert done.values["touch_height_map"][1].max() > GELSIGHT_R15.gel_thickness
    assert done.values["touch_gel"].max() <= GELSIGHT_R15.gel_thickness


def test_noise_runs_only_where_it_is_asked_for(mug: Mesh, calibration: TactileCalibration) -> None:
    noisy = evaluate(
        scene_plan(with_sensors(noise=True), GELSIGHT_R15), sources(mug, calibration, 1e-3, 1e-3)
    )
    clean = evaluate(scene_plan(SCENE, GELSIGHT_R15), sources(mug, calibration, 1e-3, 1e-3))
    assert noisy.calls["touch.noise"] == 1
    assert "touch.noise" not in clean.calls
    added = noisy.values["touch_noise"] - clean.values["touch_image"]
    assert added.std() == pytest.approx(1.5, rel=0.01)
    assert not np.array_equal(added[0], added[1])
    again = evaluate(scene_plan(with_sensors(noise=True), GELSIGHT_R15), sources(mug, calibration, 1e-3))
    assert np.array_equal(again.values["touch_image"][0], noisy.values["touch_image"][0])


def test_in_the_open_no_room_is_computed_and_in_a_room_it_is_planned() -> None:
    sound = with_sensors(sound=True).model_copy(update={"observe": ("microphone.pressure",)})
    ran = [step.effect.provides for step in scene_plan(sound, GELSIGHT_R15).ran]
    assert ran == ["object.modes", "object.sound", "microphone.pressure"]
    indoors = sound.model_copy(update={"room": Room(size=("4 m", "3 m", "2.5 m"))})  # type: ignore[arg-type]
    assert "room.reverberation" in [step.effect.provides for step in scene_plan(indoors, GELSIGHT_R15).ran]


def shadow_table(level: float) -> ShadowTable:
    """Made up: every pin of every depth holds the colour down to ``level`` for 12 samples."""
    lengths = np.full((3, 63, 9), 12)
    return ShadowTable(np.linspace(0.0, 6.2, 63), lengths, np.full(int(lengths.sum()), level), 0.4e-3)


def test_markers_run_only_where_the_gel_has_them(mug: Mesh, calibration: TactileCalibration) -> None:
    for sensor, times in ((GELSIGHT_R15, 0), (DOTTED, 1)):
        count: Counter[str] = Counter()
        effects = counting(count)
        made = plan(effects, Facts(SCENE, sensor), ["touch.image"], default_accuracy(effects))
        evaluate(made, {**sources(mug, calibration, 1e-3), "sensor": sensor})
        assert (count["touch.marker_motion"], count["touch.markers"]) == (times, times)
        assert count == {step.effect.provides: 1 for step in made.ran}
    scene = SCENE.model_copy(update={"observe": ("touch.marker_motion",)})
    with pytest.raises(WrongUse, match="markers"):
        scene_plan(scene, GELSIGHT_R15)


def test_untouched_dots_are_at_rest_and_pressed_ones_move(mug: Mesh, calibration: TactileCalibration) -> None:
    given: Quantities = {**sources(mug, calibration, -5e-3, 1e-3), "sensor": DOTTED}
    done = evaluate(scene_plan(SCENE, DOTTED), given)
    bare = evaluate(scene_plan(SCENE, GELSIGHT_R15), sources(mug, calibration, -5e-3, 1e-3))
    at_rest = draw_markers(calibration.background[None], np.zeros((1, 63, 2)), DOTTED)
    assert np.array_equal(done.values["touch_image"][0], at_rest[0])
    assert not done.values["touch_marker_motion"][0].any()
    assert np.abs(done.values["touch_marker_motion"][1]).max() > 2e-5
    same = (done.values["touch_image"] == bare.values["touch_image"]).all(axis=-1).mean(axis=(1, 2))
    assert ((same > 0.8) & (same < 0.95)).all()  # 63 dots of 0.4 mm are a tenth of the window


def test_a_sensor_that_casts_shadows_needs_its_table(mug: Mesh, calibration: TactileCalibration) -> None:
    with pytest.raises(WrongUse, match=r"sensor\.shadow_table"):
        evaluate(scene_plan(SCENE, GRAZED), {**sources(mug, calibration, 1e-3), "sensor": GRAZED})


def test_shadows_only_darken_around_what_touches(mug: Mesh, calibration: TactileCalibration) -> None:
    scene = SCENE.model_copy(update={"observe": ("touch.image", "touch.shadow_out_of_table")})
    made = scene_plan(scene, GRAZED)
    depths = (-5e-3, 1e-3)
    given: Quantities = {**sources(mug, calibration, *depths), "sensor": GRAZED}
    done = evaluate(made, {**given, "sensor_shadow_table": shadow_table(-60.0)})
    bare = evaluate(scene_plan(SCENE, GELSIGHT_R15), sources(mug, calibration, *depths)).values["touch_image"]
    assert np.array_equal(done.values["touch_colour"], bare)
    assert np.array_equal(done.values["touch_image"][0], calibration.background)
    assert (done.values["touch_image"] <= bare).all()
    assert (done.values["touch_image"][1] < bare[1]).sum() > 500
    assert done.values["touch_shadow_out_of_table"].shape == (2,)
    assert done.calls == {step.effect.provides: 1 for step in made.ran}
    light = evaluate(made, {**given, "sensor_shadow_table": shadow_table(1e3)})
    assert np.array_equal(light.values["touch_image"], bare)


def test_lights_call_for_shadows_of_the_scene_camera() -> None:
    light = Light(position=("0 m", "0 m", "2 m"))  # type: ignore[arg-type]
    camera = with_sensors(camera=True).model_copy(update={"observe": ("camera.image",)})
    lit = camera.model_copy(update={"lights": (light,)})
    drawn = ["object.lit", "camera.seen", "camera.falling", "camera.image"]
    assert [step.effect.provides for step in scene_plan(camera, GELSIGHT_R15).ran] == drawn
    drawn.insert(3, "camera.shadow")
    assert [step.effect.provides for step in scene_plan(lit, GELSIGHT_R15).ran] == drawn


def test_without_touch_a_tactile_image_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"touch\.image .*sensors\.touch is false"):
        scene_plan(with_sensors(touch=False), GELSIGHT_R15)


def measure_brightness(touch_image: ByteArray) -> FloatArray:
    return np.asarray(touch_image.mean(axis=(1, 2, 3)))


def test_a_toy_effect_is_a_function_and_a_row(mug: Mesh, calibration: TactileCalibration) -> None:
    effects = build_catalogue(*EFFECTS, Effect("toy.brightness", measure_brightness))
    made = plan(effects, Facts(SCENE, GELSIGHT_R15), ["toy.brightness"], default_accuracy(effects))
    assert as_json(made)["ran"][-1] == {"effect": "toy.brightness", "reason": "it is asked for", "levels": {}}
    done = evaluate(made, sources(mug, calibration, 1e-3))
    assert done["toy.brightness"] == pytest.approx([done.values["touch_image"].mean()])


def test_knobs_are_unique() -> None:
    chosen = [effect.choice for effect in EFFECTS if effect.choice is not None]
    knobs = [*chosen, *(knob for effect in EFFECTS for knob in effect.knobs)]
    assert len({knob.name for knob in knobs}) == len(knobs) == len(knobs_of(EFFECTS))


def test_the_table_has_a_row_for_every_effect() -> None:
    assert as_table(scene_plan(SCENE, GELSIGHT_R15)).row_count == len(EFFECTS)


def test_what_runs_has_a_row_and_each_reason_not_to_run_a_sentence() -> None:
    made = scene_plan(SCENE, GELSIGHT_R15)
    assert as_table(made, left_out=False).row_count == len(made.ran)
    sentences = dict(sentence.split(": ") for sentence in left_out(made))
    named = [name for names in sentences.values() for name in names.split(", ")]
    assert sorted(named) == sorted(skipped.effect.provides for skipped in made.skipped)
    assert len(sentences) < len(named)
    assert "touch.shadow" in sentences["the sensor casts no shadows"]
    assert "touch.force" in sentences["nothing asked for it"]
