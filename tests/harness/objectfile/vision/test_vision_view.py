"""Cameras and lights that nobody chose: all of the object is seen, in metres, and turns as a whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.objectfile.vision.view import camera_for, light_for, require_outside, require_size, turned
from harness.objects.household import build
from tests.oracles.seen_shapes import ball, cuboid, square, together

BOX = cuboid(0.1, 0.08, 0.06)
MUG = build("mug", 8e-3)


@given(
    scale=st.floats(1e-3, 1e3),
    size=st.tuples(st.integers(1, 400), st.integers(1, 400)),
    degrees=st.floats(1.0, 150.0),
)
def test_all_of_the_object_is_in_the_picture(scale: float, size: tuple[int, int], degrees: float) -> None:
    mesh = Mesh(scale * (BOX.vertices + np.array([0.3, -0.2, 0.1])), BOX.faces)
    camera = camera_for(mesh, *size, field_of_view=np.radians(degrees))
    places, depth = camera.project(mesh.vertices)
    assert (places >= 0.0).all()
    assert (places <= size).all()
    assert (depth > 0.0).all()
    assert camera.field_of_view == pytest.approx(np.radians(degrees))


def test_an_object_twice_as_large_is_looked_at_from_twice_as_far() -> None:
    near = camera_for(BOX, 32, 24)
    far = camera_for(Mesh(2.0 * BOX.vertices, BOX.faces), 32, 24)
    np.testing.assert_allclose(far.eye, 2.0 * near.eye, rtol=1e-12)
    np.testing.assert_allclose(far.forward, near.forward, atol=1e-12)


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.5), (0.0, 0.0, -0.5), (1e-9, 0.0, 0.5), (0.3, 0.2, 0.0)])
def test_nothing_is_up_along_the_view(eye: tuple[float, float, float]) -> None:
    camera = camera_for(BOX, 8, 8, eye)
    np.testing.assert_allclose(camera.eye, eye)
    assert np.isfinite(camera.object_from_camera).all()


def test_the_lamp_that_nobody_chose_lights_what_is_seen() -> None:
    camera = camera_for(BOX, 8, 8)
    assert light_for(camera).direction @ -camera.forward > 0.5


@given(angle=st.floats(-20.0, 20.0))
def test_camera_and_lamp_turn_together_about_the_axis(angle: float) -> None:
    camera = camera_for(BOX, 8, 8, (0.3, 0.1, 0.2))
    lamp, about = light_for(camera), np.array([0.05, 0.02, 0.0])
    moved, light = turned(camera, lamp, about, angle)
    assert light.direction @ moved.forward == pytest.approx(lamp.direction @ camera.forward, abs=1e-9)
    assert moved.eye[2] == pytest.approx(camera.eye[2])
    assert np.hypot(*(moved.eye - about)[:2]) == pytest.approx(np.hypot(*(camera.eye - about)[:2]))
    back, _ = turned(moved, light, about, -angle)
    np.testing.assert_allclose(back.object_from_camera, camera.object_from_camera, atol=1e-9)


def test_an_eye_in_the_hollow_of_a_mug_is_outside_and_one_in_its_wall_is_not() -> None:
    low, high = MUG.bounds
    rim = float(high[2])
    require_outside(MUG, np.array([0.0, 0.0, 0.5 * rim]))
    with pytest.raises(OutOfDomain, match=r"\(.*\) mm.* mm"):
        require_outside(MUG, np.array([0.0, low[1] + 1e-3, 0.5 * rim]))
    require_outside(MUG, np.array([0.0, low[1] - 1e-3, 0.5 * rim]))


@pytest.mark.parametrize("sheet", [square(0.1), together(square(0.1), square(0.1, 0.02))])
def test_open_surfaces_have_no_inside(sheet: Mesh) -> None:
    require_outside(sheet, np.array([0.0, 0.0, 0.01]))
    require_outside(sheet, np.zeros(3))


def test_inside_is_told_on_the_whole_way_through_a_ball() -> None:
    made = ball(0.05, 2)
    for share in (0.0, 0.5, 0.9):
        with pytest.raises(OutOfDomain, match="100 x 100 x 100 mm"):
            require_outside(made, np.array([0.0, 0.05 * share, 0.0]))


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (8193, 1), (2049, 2048), (-1, 3)])
def test_pictures_that_are_not_drawn(size: tuple[int, int]) -> None:
    with pytest.raises(OutOfDomain, match="4194304"):
        require_size(*size)
    require_size(2048, 2048)
    require_size(8192, 512)
