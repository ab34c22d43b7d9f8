"""Laws of the world: the same seed is the same world, and only relative positions matter."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, inverse, rotation_about, transform
from harness.bench.gap import load_gap
from mocks.world.world import NominalBench, World

Press = Callable[[float, float, float], FloatArray]
FRONT, HEIGHT = 2.2, 0.05
SEED = 11


@pytest.fixture(scope="module")
def exact(mug_bench: NominalBench) -> World:
    return World(mug_bench, load_gap("none"), SEED)


@pytest.fixture(scope="module")
def gapped(mug_bench: NominalBench) -> World:
    return World(mug_bench, load_gap("default"), SEED)


@pytest.fixture(scope="module")
def met(gapped: World, press: Press) -> float:
    """Metres past the nominal wall at which the displaced object is first touched."""
    low, high = -15e-3, 15e-3
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gapped.penetration(press(middle, FRONT, HEIGHT), 0) else (middle, high)
    return high


def test_the_same_seed_is_the_same_world(
    mug_bench: NominalBench, gapped: World, press: Press, met: float
) -> None:
    again = World(mug_bench, load_gap("default"), SEED)
    pose = press(met + 1.5e-3, FRONT, HEIGHT)
    # Asked in another order, and about other things in between.
    later = again.tactile_image(pose, 4, 1)
    again.tactile_image(pose, 2, 7)
    assert np.array_equal(later, gapped.tactile_image(pose, 4, 1))
    assert np.array_equal(again.contact_wrench(pose, 2), gapped.contact_wrench(pose, 2))
    assert np.array_equal(again.base_from_object, gapped.base_from_object)
    assert again.differences() == gapped.differences()


def test_another_seed_is_another_world(
    mug_bench: NominalBench, gapped: World, press: Press, met: float
) -> None:
    other = World(mug_bench, load_gap("default"), SEED + 1)
    assert not np.allclose(other.base_from_object, gapped.base_from_object, atol=1e-6)
    pose = press(met + 1.5e-3, FRONT, HEIGHT)
    assert not np.array_equal(other.tactile_image(pose, 0, 0), gapped.tactile_image(pose, 0, 0))


def test_noise_belongs_to_the_sample_and_errors_to_the_step(gapped: World, press: Press, met: float) -> None:
    pose = press(met + 2e-3, FRONT, HEIGHT)
    first, second = gapped.tactile_image(pose, 0, 0), gapped.tactile_image(pose, 0, 1)
    assert not np.array_equal(first, second)
    # 0.02 mm a pixel, blurred by the gel, tilts its surface by 0.03 rad: a few grey levels.
    assert 0.3 < np.abs(first.astype(int) - second).mean() < 6.0
    assert gapped.penetration(pose, 0) == gapped.penetration(pose, 0)
    assert gapped.penetration(pose, 0) != gapped.penetration(pose, 1)


def test_without_contact_the_background_is_seen_bit_for_bit(
    exact: World, gapped: World, press: Press
) -> None:
    away = press(-30e-3, FRONT, HEIGHT)
    for world in (exact, gapped):
        assert np.array_equal(world.tactile_image(away, 0, 0), world.background)
        assert np.array_equal(world.tactile_image(away, 3, 2), world.background)
        assert world.penetration(away, 0) == 0.0
        assert not world.contact_wrench(away, 0).any()


def test_deeper_is_a_larger_contact(gapped: World, press: Press, met: float) -> None:
    depths = np.linspace(0.2e-3, 2.4e-3, 6)
    poses = [press(met + depth, FRONT, HEIGHT) for depth in depths]
    pushes = [np.linalg.norm(gapped.contact_wrench(pose, 0)[:3]) for pose in poses]
    reached = [gapped.penetration(pose, 0) for pose in poses]
    changed = [
        np.count_nonzero(np.abs(gapped.tactile_image(pose, 0, 0).astype(int) - gapped.background) > 8)
        for pose in poses
    ]
    assert np.all(np.diff(pushes) > 0.0)
    assert np.diff(reached) == pytest.approx(np.diff(depths), rel=0.05)
    assert np.all(np.diff(changed) > 0)


@settings(max_examples=8, deadline=None)
@given(
    st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.1, 0.3)),
    st.floats(-3.0, 3.0),
)
def test_moving_base_and_object_together_changes_nothing(
    mug_bench: NominalBench, exact: World, press: Press, offset: tuple[float, float, float], yaw: float
) -> None:
    moved = transform(rotation_about(np.array([0.0, 0.0, 1.0]), yaw), np.array(offset))
    bench = replace(mug_bench, base_from_object=moved @ mug_bench.base_from_object)
    other = World(bench, load_gap("none"), SEED)
    pose = press(1.5e-3, FRONT, HEIGHT)
    assert other.penetration(moved @ pose, 2) == pytest.approx(exact.penetration(pose, 2), abs=0.1e-3)
    # With the gap off the arm still errs by 0.02 mm, along base axes that were not turned.
    assert other.true_contact(moved @ pose, 2) == pytest.approx(exact.true_contact(pose, 2), abs=0.1e-3)


def test_shifting_base_and_object_shows_the_same_picture(
    mug_bench: NominalBench, gapped: World, press: Press, met: float
) -> None:
    shift = transform(np.eye(3), np.array([0.25, -0.125, 0.0625]))
    bench = replace(mug_bench, base_from_object=shift @ mug_bench.base_from_object)
    other = World(bench, load_gap("default"), SEED)
    pose = press(met + 1.5e-3, FRONT, HEIGHT)
    here, there = gapped.tactile_image(pose, 1, 0), other.tactile_image(shift @ pose, 1, 0)
    # Sums of other magnitudes round differently; a pixel may fall on the other side of a grey level.
    assert np.mean(here != there) < 1e-3
    assert other.true_contact(shift @ pose, 1) == pytest.approx(gapped.true_contact(pose, 1), abs=1e-9)
    assert other.contact_wrench(shift @ pose, 1) == pytest.approx(gapped.contact_wrench(pose, 1), abs=1e-6)


def test_the_wrench_is_a_push_back_on_the_flange(exact: World, press: Press) -> None:
    pose = press(1e-3, FRONT, HEIGHT)
    wrench = exact.contact_wrench(pose, 0)
    axis = pose[:3, 2]
    assert -wrench[:3] @ axis == pytest.approx(np.linalg.norm(wrench[:3]), rel=1e-9)
    # The push acts in the gel's window, 0.12 m out: about the flange its arm is at most half of it.
    arm = np.linalg.norm(np.cross(axis, wrench[3:])) / np.linalg.norm(wrench[:3])
    assert arm < 0.5 * 0.0199


def test_the_true_contact_is_the_point_under_the_centre(
    mug_bench: NominalBench, exact: World, press: Press
) -> None:
    for azimuth in (0.9, FRONT, -2.0):
        sideways = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        contact = exact.true_contact(press(1e-3, azimuth, HEIGHT), 0)
        assert contact[2] == pytest.approx(HEIGHT, abs=0.2e-3)
        assert contact @ sideways == pytest.approx(0.0, abs=0.2e-3)


def test_a_true_contact_lies_on_the_nominal_surface(
    mug_bench: NominalBench, gapped: World, press: Press, met: float
) -> None:
    """The material point, not where the misshapen object has carried it."""
    for step in range(5):
        contact = gapped.true_contact(press(met + 1e-3, FRONT, HEIGHT), step)
        corners, normals = mug_bench.mesh.corners, mug_bench.mesh.face_normals
        near = np.linalg.norm(corners.mean(axis=1) - contact, axis=1) < 5e-3
        distance = np.einsum("ij,ij->i", contact - corners[near, 0], normals[near])
        assert np.abs(distance).min() < 1e-9


def test_where_the_line_misses_the_nearest_point_is_meant(
    mug_bench: NominalBench, exact: World, press: Press
) -> None:
    top = float(mug_bench.mesh.vertices[:, 2].max())
    pose = press(1e-3, FRONT, top - 0.01)
    pose[2, 3] += 0.01 + 2e-3  # the centre passes 2 mm above the rim
    contact = exact.true_contact(pose, 0)
    assert contact[2] == pytest.approx(top, abs=1.5e-3)
    gel = pose @ mug_bench.flange_from_gel
    centre = apply(inverse(exact.base_from_object), gel[None, :3, 3])[0]
    distances = np.linalg.norm(mug_bench.mesh.vertices - centre, axis=1)
    assert np.linalg.norm(contact - centre) <= distances.min() + 0.1e-3


def test_the_camera_sees_the_tool_come(exact: World, press: Press) -> None:
    near, far = exact.scene_image(press(1e-3, FRONT, HEIGHT)), exact.scene_image(press(-0.1, FRONT, HEIGHT))
    assert near.shape == (240, 320, 3)
    assert near.dtype == np.uint8
    assert 20 < np.count_nonzero(np.any(near != far, axis=2)) < 0.1 * 240 * 320


def test_a_bench_without_a_camera_has_no_picture_of_it(mug_bench: NominalBench) -> None:
    world = World(replace(mug_bench, camera=None), load_gap("none"), SEED)
    with pytest.raises(ValueError, match="camera"):
        world.scene_image(np.eye(4))


def test_the_differences_are_numbers_with_units(gapped: World, exact: World) -> None:
    differences = gapped.differences()
    assert differences["optics_level"] == "exact"
    assert abs(differences["object_yaw_rad"]) < np.radians(10.0)
    assert exact.differences()["object_yaw_rad"] == 0.0
    assert exact.differences()["object_scale"] == 1.0
