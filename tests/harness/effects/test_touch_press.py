"""One press drawn: the catalogue's own pictures, what is given instead, and what limits them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, DataRefused, OutOfDomain, WrongUse
from harness.basics.geometry import inverse, transform
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15, MarkerGrid, described_sensor
from harness.effects.evaluate import evaluate
from harness.effects.explain import scene_plan
from harness.effects.quantities import Quantities
from harness.effects.touch_press import press_gel, press_heights
from harness.objects.household import build
from harness.sim.gel.gel import deform
from harness.sim.gel.height_file import Heights
from harness.sim.optics.known_gel import Gel, known_gel
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import shipped_calibration

SCENE = scene_from_options("builtin:mug")
BENCH = Gel(GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"))
SHADOWS = ShadowTable(
    np.linspace(0.0, 6.2, 63), np.full((3, 63, 9), 8), np.full(3 * 63 * 9 * 8, -40.0), -0.2e-3
)


def bump(deepest: float, at: tuple[float, float] = (60.0, 80.0)) -> FloatArray:
    y, x = np.mgrid[:120, :160] - np.array(at)[:, None, None]
    return np.asarray(deepest * np.maximum(0.0, 1.0 - (x * x + y * y) / 500.0))


def mug_press(depth: float) -> Quantities:
    """The gel pressed from outside on the wall, opposite the handle."""
    mug = build("mug")
    rotation = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    at = transform(rotation, np.array([mug.bounds[0, 0] + depth, 0.0, 0.05]))
    return {"object_mesh": mug, "contact_gel_from_object": inverse(at[None])}


@pytest.fixture(scope="module")
def pressed_mug() -> Quantities:
    return mug_press(0.8e-3)


def test_a_mesh_is_drawn_as_the_catalogue_draws_it(pressed_mug: Quantities) -> None:
    given: Quantities = {**pressed_mug, "sensor": BENCH.sensor, "sensor_calibration": BENCH.calibration}
    directly = evaluate(scene_plan(SCENE, GELSIGHT_R15), given)
    press = press_gel(pressed_mug, BENCH, SCENE)
    assert np.array_equal(press.image, directly.values["touch_image"][0])
    assert np.array_equal(press.heights, directly.values["touch_height_map"][0])
    assert press.deepest == directly.values["touch_height_map"].max()
    assert 0.0 < press.deepest < press.gel.sensor.gel_thickness


def test_the_height_map_of_a_mesh_is_drawn_as_the_mesh(pressed_mug: Quantities) -> None:
    press = press_gel(pressed_mug, BENCH, SCENE)
    again = press_heights(press.heights, "object", BENCH, SCENE)
    assert np.array_equal(again.image, press.image)
    given_gel = press_heights(press.surface, "gel", BENCH, SCENE)
    assert np.array_equal(given_gel.image, press.image)


def test_only_what_the_sensor_calls_for_is_computed(pressed_mug: Quantities) -> None:
    ran = {step.effect.provides for step in press_gel(pressed_mug, BENCH, SCENE).plan.ran}
    own = {"touch.drawn", "touch.colour", "touch.saturated", "touch.extrapolated", "touch.image"}
    assert ran == {"object.raster", "touch.height_map", "touch.gel"} | own
    given = press_heights(bump(1e-3), "object", BENCH, SCENE)
    assert {step.effect.provides for step in given.plan.ran} == {"touch.gel"} | own
    dotted = replace(BENCH, sensor=replace(GELSIGHT_R15, markers=MarkerGrid(7, 9, 2e-3, 0.4e-3)))
    more = {step.effect.provides for step in press_heights(bump(1e-3), "object", dotted, SCENE).plan.ran}
    assert more == {"touch.gel", "touch.marker_motion", "touch.markers"} | own
    grazed = replace(BENCH, sensor=replace(GELSIGHT_R15, casts_shadow=True), shadow=SHADOWS)
    more = {step.effect.provides for step in press_heights(bump(1e-3), "object", grazed, SCENE).plan.ran}
    assert more == {"touch.gel", "touch.darkening", "touch.shadow", "touch.shadow_out_of_table"} | own


@pytest.mark.parametrize("level", ["exact", "fast", "smooth"])
@pytest.mark.parametrize("of", ["object", "gel"])
@pytest.mark.parametrize("dome", [False, True])
def test_no_contact_is_the_background_to_the_bit(level: str, of: Any, dome: bool) -> None:
    y, x = np.mgrid[:120, :160] - np.array([59.5, 79.5])[:, None, None]
    rest = -np.sqrt(28.43e-3**2 - (x * x + y * y) * GELSIGHT_R15.pitch**2)
    gel = replace(BENCH, rest=rest) if dome else BENCH
    gel = replace(gel, sensor=replace(GELSIGHT_R15, casts_shadow=True), shadow=SHADOWS)
    nothing = np.zeros((120, 160))
    reached = nothing if of == "gel" else None
    press = press_heights(nothing, of, gel, SCENE, [f"touch.optics={level}"], reached)
    assert np.array_equal(press.image, BENCH.calibration.background)
    assert not press.contact.any()
    assert (press.deepest, press.saturated, press.touches_border) == (0.0, 0, False)
    assert press.shadow_out_of_table == 0.0


def test_a_press_on_a_measured_dome_is_one_on_the_sensors_own() -> None:
    domed = replace(GELSIGHT_R15, gel_radius=28.43e-3)
    y, x = np.mgrid[:120, :160] - np.array([59.5, 79.5])[:, None, None]
    rest = -np.sqrt(28.43e-3**2 - (x * x + y * y) * GELSIGHT_R15.pitch**2)
    given = mug_press(0.8e-3)
    own = press_gel(given, replace(BENCH, sensor=domed), SCENE)
    measured = press_gel(given, replace(BENCH, rest=rest), SCENE)
    # A measured surface has no apex between its four middle pixels: it starts 0.1 um lower.
    assert measured.heights == pytest.approx(own.heights, abs=2.5e-7)
    apart = np.abs(measured.image.astype(int) - own.image)
    assert (apart.max(axis=-1) > 1).mean() < 0.03  # slopes that lie at a bin's edge
    fine = press_gel(given, replace(BENCH, rest=rest), SCENE, ["touch.supersampling=2"])
    assert np.abs(fine.heights - measured.heights).max() < 30e-6


def test_shadows_over_a_measured_dome_fall_downhill_of_the_dome_too() -> None:
    grazed = replace(BENCH, sensor=replace(GELSIGHT_R15, casts_shadow=True), shadow=SHADOWS)
    smooth = ["touch.optics=smooth"]  # which has no bins at whose edge a slope may lie
    flat = press_heights(bump(1e-3), "object", grazed, SCENE, smooth)
    lifted = replace(grazed, rest=np.full((120, 160), 7e-3))
    level = press_heights(bump(1e-3), "object", lifted, SCENE, smooth)
    assert np.abs(flat.image.astype(int) - level.image).max() <= 1
    for lean, lower in ((40e-3, slice(0, 80)), (-40e-3, slice(80, 160))):
        slope = np.repeat(np.linspace(0.0, lean, 160)[None], 120, axis=0)
        tipped = press_heights(bump(1e-3), "object", replace(grazed, rest=slope), SCENE)
        dark = tipped.evaluation.values["touch_darkening"][0][0].sum(axis=-1) > 1.0
        assert dark[:, lower].sum() > 0.55 * dark.sum() > 300


@pytest.mark.parametrize("of", ["object", "gel"])
def test_heights_deeper_than_the_gel_are_refused(of: Heights) -> None:
    with pytest.raises(OutOfDomain, match=r"4 mm.*2\.5 mm"):
        press_heights(bump(4e-3), of, BENCH, SCENE)
    press_heights(bump(GELSIGHT_R15.gel_thickness), of, BENCH, SCENE)


def test_what_reached_deeper_than_the_gel_is_refused() -> None:
    with pytest.raises(OutOfDomain, match=r"4 mm.*2\.5 mm"):
        press_heights(bump(1e-3), "gel", BENCH, SCENE, reached=bump(4e-3))


def test_a_part_that_is_where_the_sensor_would_be_is_refused() -> None:
    mug = build("mug")
    inwards = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # The gel is at the axis, the wall before it is behind its face.
    at = transform(inwards, np.array([0.0, 0.0, 0.05]))
    given: Quantities = {"object_mesh": mug, "contact_gel_from_object": inverse(at[None])}
    with pytest.raises(OutOfDomain, match=r" mm.*2\.5 mm"):
        press_gel(given, BENCH, SCENE)


def test_flags_say_what_the_picture_cannot_show() -> None:
    wall = np.zeros((120, 160))
    wall[40:80, 50:100] = 2.4e-3
    steep = press_heights(wall, "gel", BENCH, SCENE)
    assert steep.out_of_domain is not None
    assert 0.005 < steep.out_of_domain < 0.05
    gentle = press_heights(bump(0.2e-3), "object", BENCH, SCENE)
    assert gentle.out_of_domain == 0.0
    assert not gentle.touches_border
    assert press_heights(bump(0.2e-3, (60.0, 5.0)), "object", BENCH, SCENE).touches_border
    white = replace(BENCH.calibration, background=np.full((120, 160, 3), 255, np.uint8))
    assert press_heights(wall, "gel", Gel(GELSIGHT_R15, white), SCENE).saturated > 100
    unknown = replace(BENCH.calibration, header=replace(BENCH.calibration.header, slope_limit=1.0))
    assert press_heights(wall, "gel", Gel(GELSIGHT_R15, unknown), SCENE).out_of_domain is None


def test_what_touches_is_where_the_object_reaches_or_what_it_shapes() -> None:
    press = press_heights(bump(1e-3), "object", BENCH, SCENE)
    assert np.array_equal(press.contact, bump(1e-3) > 0.0)
    gel = deform(bump(1e-3)[None], BENCH.calibration.header.skirt)[0]
    shaped = press_heights(gel, "gel", BENCH, SCENE).contact
    assert np.array_equal(shaped, gel >= BENCH.calibration.header.skirt.core * gel.max())


def test_shadows_of_a_gel_start_where_the_object_is_said_to_reach() -> None:
    grazed = replace(BENCH, sensor=replace(GELSIGHT_R15, casts_shadow=True), shadow=SHADOWS)
    heights = bump(1e-3)
    whole = press_heights(heights, "object", grazed, SCENE)
    told = press_heights(whole.surface, "gel", grazed, SCENE, (), heights)
    assert np.array_equal(told.image, whole.image)
    assert np.array_equal(told.contact, whole.contact)
    with pytest.raises(WrongUse, match="--reached"):
        press_heights(whole.surface, "gel", grazed, SCENE)


def test_noise_runs_only_where_it_is_asked_for_and_is_the_seeds() -> None:
    loud = SCENE.model_copy(update={"sensors": SCENE.sensors.model_copy(update={"noise": True})})
    gels = [replace(BENCH, noise=3.0, seed=seed) for seed in (1, 1, 2)]
    seen = [press_heights(bump(1e-3), "object", gel, loud).image for gel in gels]
    assert np.array_equal(seen[0], seen[1])
    assert not np.array_equal(seen[0], seen[2])
    quiet = press_heights(bump(1e-3), "object", BENCH, SCENE).image
    assert np.std(seen[0].astype(float) - quiet) == pytest.approx(3.0, rel=0.05)


def test_levels_are_turned_or_refused() -> None:
    press = press_heights(bump(1e-3), "object", BENCH, SCENE, ["touch.optics=smooth", "touch.gel=fast"])
    assert press.plan.levels == {"touch.shapes": "reference", "touch.optics": "smooth", "touch.gel": "fast"}
    for level, words in (
        ("touch.optics=exat", "'exat'.*'exact'"),
        ("touch.lens=1", "no knob"),
        ("exact", "KNOB=LEVEL"),
        ("touch.supersampling=2", "touch.supersampling"),
        ("sound.modes=10", "no knob"),
    ):
        with pytest.raises(WrongUse, match=words):
            press_heights(bump(1e-3), "object", BENCH, SCENE, [level])
    table_only = replace(BENCH.calibration, smooth=np.empty((0, 3)))
    with pytest.raises(CalibrationRefused, match="smooth"):
        press_heights(bump(1e-3), "object", Gel(GELSIGHT_R15, table_only), SCENE, ["touch.optics=smooth"])


def test_a_calibration_of_another_camera_is_refused() -> None:
    with pytest.raises(DataRefused, match=r"120 x 160 pixels.*480 x 640"):
        Gel(described_sensor("taxim-gelsight").sensor, BENCH.calibration)


def test_gels_are_put_together_from_what_is_said() -> None:
    assert known_gel(None, None).calibration.sha256 == BENCH.calibration.sha256
    assert known_gel(None, "gelsight_r15_world").sensor == GELSIGHT_R15
    assert known_gel("gelsight-r1.5", None, thickness=3e-3).sensor.gel_thickness == 3e-3
    fresh = np.zeros((120, 160, 3), np.uint8)
    assert not known_gel(None, None, background=fresh).calibration.background.any()
    cases: list[tuple[type[Exception], str, tuple[str | None, str | None], dict[str, Any]]] = [
        (WrongUse, "'gelsight-r15'.*'gelsight-r1.5'", ("gelsight-r15", None), {}),
        (WrongUse, "--pitch 0.0295mm", ("taxim-gelsight", None), {}),
        (WrongUse, "0.2 mm", (None, None), {"pitch": 0.2e-3}),
        (WrongUse, "table of shadows", (None, None), {"shadow": True}),
        (WrongUse, "0.0295 mm", ("taxim-gelsight", "gelsight_r15_world"), {}),
        (CalibrationRefused, "'gelsight_r16'.*gelsight_r15_bench", (None, "gelsight_r16"), {}),
        (WrongUse, "absent.npz", (None, "absent.npz"), {}),
        (CalibrationRefused, "50 x 160", (None, None), {"background": fresh[:50]}),
    ]
    for error, words, who, more in cases:
        with pytest.raises(error, match=words):
            known_gel(*who, **more)
