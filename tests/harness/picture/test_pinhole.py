"""A camera: rays and places in the picture are each other's inverse, in metres, for any size of picture."""

from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.picture.pinhole import DirectionalLight, Pinhole

UP = (0.0, 0.0, 1.0)


def seen_from(eye: Any, width: int = 64, height: int = 48, fov: float = 0.6) -> Pinhole:
    return Pinhole.looking_at(eye, (0.01, -0.02, 0.03), UP, width, height, fov)


@pytest.mark.parametrize("size", [(64, 48), (48, 64), (1, 1), (257, 3)])
@pytest.mark.parametrize("offset", [(0.5, 0.5), (0.0, 1.0), (0.125, 0.875)])
def test_points_on_a_pixels_ray_are_projected_back_into_it(
    size: tuple[int, int], offset: tuple[float, float]
) -> None:
    camera = seen_from((0.3, -0.2, 0.25), *size)
    directions = camera.directions(offset).reshape(-1, 3)
    distances = np.random.default_rng(1).uniform(1e-3, 30.0, (len(directions), 1))
    places, depth = camera.project(camera.eye + distances * directions)
    column, row = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    expected = np.column_stack([column.ravel() + offset[0], row.ravel() + offset[1]])
    # 30 m and 1 mm beside an eye at 0.4 m: 1e-16 of 0.4 m over 1 mm, times the focal length.
    np.testing.assert_allclose(places, expected, atol=1e-15 / 1e-3 * camera.focal_px + 1e-10)
    np.testing.assert_allclose(depth, (distances * directions) @ camera.forward, rtol=1e-12, atol=1e-15)


def test_directions_are_unit_and_the_middle_one_looks_at_the_target() -> None:
    camera = seen_from((0.3, -0.2, 0.25), 65, 49)
    directions = camera.directions()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-15)
    target = np.array([0.01, -0.02, 0.03])
    away = (target - camera.eye) / np.linalg.norm(target - camera.eye)
    np.testing.assert_allclose(directions[24, 32], away, atol=1e-15)


def test_x_is_right_and_y_is_down_in_the_picture() -> None:
    camera = Pinhole.looking_at((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), UP, 100, 80, 0.8)
    places, depth = camera.project(np.array([[0.1, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    # Seen from -y with z up, +x is to the right of the middle (50, 40) and +z above it.
    assert places[0, 0] > 50.0
    assert places[0, 1] == pytest.approx(40.0)
    assert places[1, 1] < 40.0
    assert places[1, 0] == pytest.approx(50.0)
    np.testing.assert_allclose(depth, 1.0, rtol=1e-15)


def test_pose_is_right_handed_and_keeps_distances() -> None:
    rotation = seen_from((0.3, -0.2, 0.25)).object_from_camera[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("ratio", [2.0, 10.0, 50.0])
def test_a_thing_is_as_much_smaller_as_it_is_farther(ratio: float) -> None:
    def size(distance: float) -> float:
        camera = Pinhole.looking_at((0, -distance, 0), (0, 0, 0), UP, 200, 100, 0.7)
        places, _ = camera.project(np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]))
        return float(places[1, 0] - places[0, 0])

    assert size(0.5) / size(0.5 * ratio) == pytest.approx(ratio, rel=1e-12)


@pytest.mark.parametrize("fov", [1e-3, 0.6, 3.0])
@pytest.mark.parametrize("size", [(64, 48), (30, 90)])
def test_field_of_view_is_that_between_the_edges_of_the_width(fov: float, size: tuple[int, int]) -> None:
    camera = seen_from((0.3, 0.1, 0.2), *size, fov)
    left, right = camera.directions_at(np.array([[0.0, size[1] / 2], [size[0], size[1] / 2]]))
    between = 2.0 * np.arcsin(0.5 * np.linalg.norm(right - left))
    assert between == pytest.approx(fov, rel=1e-9)
    assert camera.field_of_view == pytest.approx(fov, rel=1e-12)


def test_other_pixels_see_the_same() -> None:
    camera = seen_from((0.3, -0.2, 0.25), 64, 48)
    point = np.array([[0.02, 0.01, 0.05]])
    small, large = camera.project(point)[0], camera.resized(256, 192).project(point)[0]
    np.testing.assert_allclose(large, 4.0 * small, rtol=1e-12)
    taller = camera.resized(64, 148).project(point)[0]
    np.testing.assert_allclose(taller, small + np.array([0.0, 50.0]), rtol=1e-12)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"up": (0, 0, 0)}, "zero"),
        ({"up": (0, -2.0, 0)}, "turned any way"),
        ({"up": (0, 0, np.nan)}, "finite"),
        ({"eye": (0, 0, 0)}, "zero"),
        ({"eye": (0, np.inf, 0)}, "finite"),
        ({"target": (0, 1)}, "finite"),
        ({"field_of_view": 0.0}, "0 and 180"),
        ({"field_of_view": np.pi}, "0 and 180"),
        ({"field_of_view": np.nan}, "0 and 180"),
        ({"width": 0}, "one or more"),
        ({"height": -3}, "one or more"),
    ],
)
def test_a_view_that_is_none_is_refused(changed: dict[str, Any], said: str) -> None:
    view = {"eye": (0, 1, 0), "target": (0, 0, 0), "up": UP, "width": 8, "height": 8, "field_of_view": 0.5}
    with pytest.raises(OutOfDomain, match=said):
        Pinhole.looking_at(**{**view, **changed})


@pytest.mark.parametrize(
    "pose",
    [2.0 * np.eye(4), np.diag([1.0, 1.0, -1.0, 1.0]), np.full((4, 4), np.nan), np.eye(3), np.eye(4)[::-1]],
)
def test_a_pose_that_is_not_rigid_is_refused(pose: FloatArray) -> None:
    with pytest.raises(OutOfDomain, match="pose"):
        Pinhole(8, 8, 10.0, (4.0, 4.0), pose)


@pytest.mark.parametrize("focal", [0.0, -1.0, np.inf, np.nan])
def test_a_focal_length_that_is_none_is_refused(focal: float) -> None:
    with pytest.raises(OutOfDomain, match="focal"):
        Pinhole(8, 8, focal, (4.0, 4.0), np.eye(4))


@pytest.mark.parametrize("z", [0.0, -0.1, np.nan, np.inf])
def test_points_that_are_not_in_front_are_refused(z: float) -> None:
    with pytest.raises(OutOfDomain, match="1 of 2 points"):
        Pinhole(8, 8, 10.0, (4.0, 4.0), np.eye(4)).project(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, z]]))


@pytest.mark.parametrize("length", [1e-200, 1.0, 1e200])
def test_a_light_has_a_unit_direction_whatever_was_given(length: float) -> None:
    light = DirectionalLight(length * np.array([1.0, 2.0, 2.0]))
    np.testing.assert_allclose(light.direction, [1 / 3, 2 / 3, 2 / 3], rtol=1e-15)


@pytest.mark.parametrize(
    ("direction", "irradiance"), [((0, 0, 0), 1.0), ((0, 0, 1), -1.0), ((0, 0, 1), np.nan)]
)
def test_a_light_that_is_none_is_refused(direction: Any, irradiance: float) -> None:
    with pytest.raises(OutOfDomain, match=r"light"):
        DirectionalLight(direction, irradiance)


def test_a_camera_is_not_changed_by_its_caller() -> None:
    pose = np.eye(4)
    camera = Pinhole(8, 8, 10.0, (4.0, 4.0), pose)
    pose[0, 3] = 5.0
    assert camera.eye[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        camera.object_from_camera[0, 3] = 1.0
