"""Pictures of what renderers stumble over: finite, seamless, alike wherever it stands, or a named error."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.appearance_source import builtin_appearance
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball, cuboid, square, together

UP = (0.0, 0.0, 1.0)
GREY = (0.8, 0.5, 0.2)
ASLANT = DirectionalLight(np.array([0.5, -0.6, 0.7]))


def matt(mesh: Mesh) -> LitObject:
    return LitObject(plain(mesh, GREY))


def required_sound(image: LinearImage) -> None:
    for values in (image.colour, image.alpha):
        assert np.isfinite(values).all()
        assert values.min() >= 0.0
    assert image.alpha.max() <= 1.0
    np.testing.assert_array_equal(np.isfinite(image.depth), image.alpha > 0.0)


@pytest.fixture(scope="module")
def mug() -> Mesh:
    return builtin_appearance("mug", edge=8e-3).mesh


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (10.0, -20.0, 5.0)])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.1, 2.0)])
def test_a_picture_does_not_depend_on_where_the_object_stands(
    mug: Mesh, offset: tuple[float, float, float], turn: tuple[float, float, float]
) -> None:
    move = transform(rotation_from_vector(np.array(turn)), np.array(offset))
    camera = Pinhole.looking_at((0.3, -0.25, 0.25), (0.0, 0.0, 0.05), UP, 48, 32, 0.4)
    moved = Pinhole(48, 32, camera.focal_px, camera.centre_px, move @ camera.object_from_camera)
    light = DirectionalLight(move[:3, :3] @ ASLANT.direction)
    one = matt(mug).render(camera, [ASLANT], 3).image
    other = matt(Mesh(apply(move, mug.vertices), mug.faces)).render(moved, [light], 3).image
    # Of 14000 places a few lie on an edge to the last digit, and change sides.
    changed = np.abs(one.colour - other.colour).max(axis=2) > 1e-9
    assert changed.sum() <= 3


@pytest.mark.parametrize("scale", [0.05, 20.0])
def test_a_picture_does_not_depend_on_the_size_of_the_world(mug: Mesh, scale: float) -> None:
    def render(by: float) -> LinearImage:
        camera = Pinhole.looking_at((0.3 * by, -0.25 * by, 0.25 * by), (0, 0, 0.05 * by), UP, 48, 32, 0.4)
        return matt(Mesh(by * mug.vertices, mug.faces)).render(camera, [ASLANT], 3).image

    one, other = render(1.0), render(scale)
    assert (np.abs(one.colour - other.colour).max(axis=2) > 1e-9).sum() <= 3


def test_faces_that_are_there_twice_do_not_shade_each_other() -> None:
    camera = Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), UP, 40, 30, 0.5)
    once = cuboid(0.08, 0.06, 0.05)
    for twice in (together(once, once), together(once, Mesh(once.vertices, once.faces[:, ::-1]))):
        made = LitObject(plain(twice, GREY, crease=0.0))
        shaded, bare = (made.render(camera, [ASLANT], 2, shadow=on).image for on in (True, False))
        np.testing.assert_array_equal(shaded.colour, bare.colour)
        assert shaded.colour.max() > 0.0


@pytest.mark.parametrize("tilt", [1e-1, 1e-3, 1e-6, 0.0])
def test_light_that_grazes_a_plane_lights_it_evenly(tilt: float) -> None:
    light = DirectionalLight(np.array([np.cos(tilt), 0.0, np.sin(tilt)]))
    camera = Pinhole.looking_at((0.0, -0.2, 0.3), (0, 0, 0), UP, 16, 16, 0.4)
    colour = matt(square(2.0)).render(camera, [light], 2).image.colour
    np.testing.assert_allclose(
        colour, np.broadcast_to(np.array(GREY) * np.sin(tilt), (16, 16, 3)), atol=1e-15
    )


@pytest.mark.parametrize("height", [1e-2, 1e-4, 1e-7])
def test_a_camera_that_grazes_a_plane_sees_it_to_the_horizon(height: float) -> None:
    camera = Pinhole.looking_at((0.0, -0.5, height), (0.0, 0.0, height), UP, 32, 32, 0.5)
    image = matt(square(0.2)).render(camera, [DirectionalLight(np.array(UP))], 8).image
    required_sound(image)
    # Its far edge is at height / 0.6 below the horizon, its near one at height / 0.4.
    rows = camera.focal_px * height * (1.0 / 0.4 - 1.0 / 0.6)
    middle = image.alpha[:, 16].sum()
    assert middle == pytest.approx(rows, abs=1.0 / 64 + 1e-12)


def test_inside_corners_have_no_bright_or_dark_line() -> None:
    floor, wall = square(0.2), Mesh(square(0.2).vertices[:, [2, 0, 1]] + [-0.1, 0.0, 0.1], square(0.2).faces)
    made = LitObject(plain(together(floor, wall), GREY, crease=0.0))
    light = DirectionalLight(np.array([1.0, 0.2, 1.0]))
    camera = Pinhole.looking_at((0.2, -0.05, 0.25), (-0.1, 0.0, 0.0), UP, 64, 64, 0.1)
    one, other = (made.render(camera, [light], 4, shadow=on).image for on in (True, False))
    np.testing.assert_array_equal(one.colour, other.colour)
    # Both faces are bright: nothing between them is darker than the darker of them.
    levels = np.array(GREY)[0] * light.direction[[0, 2]]
    assert one.colour[..., 0].min() > 0.999 * levels.min()
    assert one.colour[..., 0].max() < 1.001 * levels.max()


def test_a_shell_of_half_a_millimetre_hides_its_inside() -> None:
    shell = together(ball(0.05, 4), Mesh(ball(0.0495, 4).vertices, ball(0.0495, 4).faces[:, ::-1]))
    camera = Pinhole.looking_at((0.0, -0.3, 0.0), (0, 0, 0), UP, 48, 48, 0.4)
    thin, solid = (matt(mesh).render(camera, [ASLANT], 3).image for mesh in (shell, ball(0.05, 4)))
    np.testing.assert_allclose(thin.colour, solid.colour, atol=1e-12)
    np.testing.assert_allclose(thin.depth, solid.depth, rtol=1e-12)


@pytest.mark.parametrize("eye", [(0.05, 0.0, 0.0), (0.0500001, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_camera_on_or_in_the_surface_gives_a_picture(eye: tuple[float, float, float]) -> None:
    camera = Pinhole.looking_at(eye, (0.01, 0.02, -0.03), UP, 16, 12, 2.5)
    required_sound(matt(ball(0.05, 3)).render(camera, [ASLANT], 2).image)


@pytest.mark.parametrize("fov", [1e-6, 3.1])
@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1)])
def test_pictures_of_odd_shapes_and_angles_are_sound(mug: Mesh, fov: float, size: tuple[int, int]) -> None:
    camera = Pinhole.looking_at((0.3, -0.25, 0.25), (0.0, 0.0, 0.05), UP, *size, fov)
    found = matt(mug).render(camera, [ASLANT], 3).image
    required_sound(found)
    assert found.alpha.shape == size[::-1]


def test_needles_and_faces_without_area_leave_no_hole() -> None:
    # A square cut into needles that meet along lines of pixels' middles, with collapsed faces between.
    x = np.linspace(-0.1, 0.1, 402)
    lower = np.column_stack([x, np.full_like(x, -0.1), np.zeros_like(x)])
    upper = lower * [1.0, -1.0, 1.0]
    k, count = np.arange(401), 402
    faces = np.vstack(
        [
            np.column_stack([k, k + 1, count + k + 1]),
            np.column_stack([k, count + k + 1, count + k]),
            np.column_stack([k, k, count + k]),
        ]
    )
    camera = Pinhole.looking_at((0, 0, 0.5), (0, 0, 0), (0, 1, 0), 50, 50, 0.3)
    image = matt(Mesh(np.vstack([lower, upper]), faces)).render(camera, [ASLANT], 4).image
    np.testing.assert_array_equal(image.alpha, 1.0)
    assert np.ptp(image.colour[..., 0]) < 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_corners_that_are_no_numbers_are_refused(bad: float) -> None:
    vertices: FloatArray = np.array(square(0.1).vertices)
    vertices[0, 0] = bad
    with pytest.raises(MeshRefused, match="finite"):
        LitObject(plain(Mesh(vertices, square(0.1).faces), GREY, crease=0.0))
