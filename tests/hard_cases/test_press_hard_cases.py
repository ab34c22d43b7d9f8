"""Presses on which the published simulators crash, or draw something else without a word."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.effects.quantities import Quantities
from harness.effects.touch_press import Press, press_gel, press_heights
from harness.sim.gel.gel import R15_SKIRT, deform, skirt_for
from harness.sim.gel.height_file import Heights, given_heights
from harness.sim.gel.height_map import RasterMesh, height_maps
from harness.sim.gel.press_pose import contact_place, gel_from_object
from harness.sim.optics.known_gel import Gel
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import shipped_calibration

SCENE = scene_from_options("builtin:mug")
PLAIN = Gel(GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"))
SHADOWS = ShadowTable(
    np.linspace(0.0, 6.2, 63), np.full((3, 63, 9), 8), np.full(3 * 63 * 9 * 8, -40.0), 0.4e-3
)
GRAZED = replace(PLAIN, sensor=replace(GELSIGHT_R15, casts_shadow=True), shadow=SHADOWS)


def post(height: float) -> FloatArray:
    heights = np.zeros((120, 160))
    heights[50:70, 70:90] = height
    return heights


def drawn(heights: FloatArray, gel: Gel = GRAZED) -> Press:
    return press_heights(heights, "object", gel, SCENE)


def test_no_contact_with_shadows_on_is_the_untouched_gel() -> None:
    press = drawn(np.zeros((120, 160)))
    assert np.array_equal(press.image, PLAIN.calibration.background)
    assert not press.contact.any()


def test_a_contact_over_the_whole_sensor_throws_no_shadow_and_is_said() -> None:
    press = drawn(np.full((120, 160), 1e-3))
    # A flat face over the whole window shows no slope: only that it reaches the edge tells of it.
    assert np.array_equal(press.image, PLAIN.calibration.background)
    assert press.contact.all()
    assert press.touches_border
    assert press.shadow_out_of_table == 0.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9])
@pytest.mark.parametrize("of", ["object", "gel"])
def test_a_patch_that_is_no_number_is_masked_and_the_gel_hangs_over_it(bad: float, of: Heights) -> None:
    whole = post(1e-3) if of == "object" else deform(post(1e-3)[None], R15_SKIRT)[0]
    holed = whole.copy()
    holed[59:61, 79:81] = bad
    given = given_heights(holed, GELSIGHT_R15, of, "h.npy")
    press = press_heights(given.heights, of, PLAIN, SCENE, missing=given.missing)
    assert press.missing is not None
    assert press.missing.sum() == 4
    sound = press_heights(whole, of, PLAIN, SCENE)
    assert np.array_equal(press.contact, sound.contact & ~press.missing)
    # The gel spans so small a hole: within 3 % of the press, and no wall is drawn about it.
    assert np.abs(press.surface - sound.surface).max() < (0.03e-3 if of == "object" else 1e-9)
    near = slice(50, 70), slice(70, 90)
    assert not np.array_equal(sound.image, PLAIN.calibration.background)
    apart = np.abs(press.image.astype(int) - sound.image)
    assert apart[near].max() < np.abs(sound.image.astype(int) - PLAIN.calibration.background).max()
    apart[near] = 0
    assert not apart.any()


def test_what_a_ray_misses_is_the_gel_whatever_number_says_so() -> None:
    missed = np.where(post(1e-3) > 0.0, 1e-3, -1e9)
    assert not given_heights(missed, GELSIGHT_R15, "object", "h.npy").missing.any()
    assert np.array_equal(drawn(missed).image, drawn(post(1e-3)).image)


def test_deeper_than_the_shadow_table_is_held_and_said_and_deeper_than_the_gel_is_refused() -> None:
    press = drawn(post(2.4e-3))
    assert press.shadow_out_of_table is not None
    assert press.shadow_out_of_table > 0.1
    bare = drawn(post(2.4e-3), PLAIN)
    # The published program throws no shadow at all from there.
    assert (press.image.astype(int) < bare.image).sum() > 300
    with pytest.raises(OutOfDomain, match=r" mm.*2\.5 mm"):
        drawn(post(4e-3))


def test_a_sheer_step_is_drawn_as_the_steepest_slope_known_and_counted() -> None:
    step = np.zeros((120, 160))
    step[40:80, 50:100] = 2.4e-3
    press = press_heights(step, "gel", PLAIN, SCENE)
    assert press.out_of_domain is not None
    assert press.out_of_domain > 0.005
    gentler = press_heights(0.8 * step, "gel", PLAIN, SCENE)
    assert np.array_equal(press.image, gentler.image)


def test_a_contact_at_the_corner_is_drawn_and_said() -> None:
    heights = np.zeros((120, 160))
    heights[:8, :9] = 1e-3
    press = drawn(heights)
    assert press.touches_border
    assert np.array_equal(press.image[60:, 80:], PLAIN.calibration.background[60:, 80:])
    assert not np.array_equal(press.image[:15, :15], PLAIN.calibration.background[:15, :15])


@pytest.mark.parametrize("level", ["exact", "fast", "smooth"])
def test_a_flat_face_is_coloured_as_the_untouched_gel_in_any_pose(level: str) -> None:
    box = trimesh.creation.box(extents=(6e-3, 6e-3, 40e-3))
    turn = rotation_about(np.array([0.6, 0.8, 0.0]), 0.3)
    mesh = Mesh(np.asarray(box.vertices) @ turn.T + 0.1, np.asarray(box.faces))
    place = contact_place(mesh, turn @ np.array([0.0, 0.0, 20e-3]) + 0.1)
    given: Quantities = {
        "object_mesh": mesh,
        "contact_gel_from_object": gel_from_object(place, 1e-3, 0.0, 0.0, 0.4)[None],
    }
    press = press_gel(given, PLAIN, SCENE, [f"touch.optics={level}"])
    within = slice(50, 70), slice(70, 90)
    assert press.heights[within] == pytest.approx(1e-3, abs=1e-15)
    assert np.array_equal(press.image[within], PLAIN.calibration.background[within])


@pytest.mark.parametrize(("finer", "off"), [(1, 1.5), (4, 0.2)])
def test_a_steep_rim_reads_its_slope_the_better_the_finer_the_pixels(finer: int, off: float) -> None:
    ball = trimesh.creation.icosphere(subdivisions=6, radius=4e-3)
    mesh = Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    sensor = TactileSensor("fine", 120 * finer, 160 * finer, GELSIGHT_R15.pitch / finer, 2.5e-3)
    place = contact_place(mesh, np.array([0.0, 0.0, 4e-3]))
    gap = height_maps(RasterMesh(mesh), gel_from_object(place, 0.0, 0.0, 0.0, 0.0)[None], sensor)[0]
    row = gap[60 * finer, 80 * finer :]
    row = row[np.isfinite(row)]
    x = (np.arange(len(row)) + 0.5) * sensor.pitch
    read = np.degrees(np.arctan((row[2:] - row[:-2]) / (2.0 * sensor.pitch)))
    true = np.degrees(np.arcsin(np.minimum(np.hypot(x[1:-1], 0.5 * sensor.pitch) / 4e-3, 1.0)))
    steep = (true > 30.0) & (true < 72.0)
    assert steep.sum() >= 5
    assert np.abs(read - true)[steep].max() < off


def test_a_skirt_hangs_the_same_from_a_post_on_finer_pixels() -> None:
    fine = TactileSensor("fine", 480, 640, GELSIGHT_R15.pitch / 4, 2.5e-3)
    coarse = deform(post(1e-3)[None], skirt_for(GELSIGHT_R15))[0]
    finer = deform(post(1e-3).repeat(4, axis=0).repeat(4, axis=1)[None], skirt_for(fine))[0]
    blocks = finer.reshape(120, 4, 160, 4).mean(axis=(1, 3))
    assert np.abs(blocks - coarse).max() < 0.12e-3
    assert blocks.sum() == pytest.approx(coarse.sum(), rel=0.06)
