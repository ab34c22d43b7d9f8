"""Pictures without noise: closed forms, convergence, and cases in which a renderer goes wrong."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.appearance_source import builtin_appearance
from harness.sim.light.direct_image import LitObject, pixel_places
from tests.oracles.seen_shapes import ball, cuboid, square, together

UP = (0.0, 0.0, 1.0)
GREY = (0.8, 0.5, 0.2)
FROM_ABOVE = DirectionalLight(np.array([0.0, 0.0, 1.0]))
ASLANT = DirectionalLight(np.array([0.5, -0.6, 0.7]))


def matt(mesh: Mesh) -> LitObject:
    return LitObject(plain(mesh, GREY))


def seen_from(eye: tuple[float, float, float], size: int = 64, fov: float = 0.4) -> Pinhole:
    return Pinhole.looking_at(eye, (0, 0, 0), UP, size, size, fov)


def ball_in_closed_form(camera: Pinhole, radius: float, light: DirectionalLight, samples: int) -> FloatArray:
    """``(rows, columns)``: a white ball about the origin, at ``samples`` places a side of each pixel."""
    total = np.zeros((camera.height, camera.width))
    for offset, _ in pixel_places(samples):
        ways = camera.directions(offset)
        along = ways @ camera.eye
        under = along**2 - (camera.eye @ camera.eye - radius**2)
        points = camera.eye + (-along - np.sqrt(np.maximum(under, 0.0)))[..., None] * ways
        total += np.where(under > 0, np.maximum(points @ light.direction, 0.0) / radius, 0.0)
    return np.asarray(total * light.irradiance / np.pi / samples**2)


@pytest.mark.parametrize("light", [ASLANT, FROM_ABOVE, DirectionalLight(np.array([1.0, 0.1, 0.1]), 1.5)])
def test_a_ball_is_lamberts_and_converges_to_him(light: DirectionalLight) -> None:
    camera = seen_from((0.0, -0.3, 0.1), 48, 0.5)
    expected = ball_in_closed_form(camera, 0.05, light, 4)
    whole, inner = [], []
    for subdivisions in (3, 4, 5):
        found = matt(ball(0.05, subdivisions)).render(camera, [light], 4).image
        squares = (found.colour - expected[..., None] * GREY) ** 2
        whole.append(float(np.sqrt(squares.mean())))
        # Where the ball turns away its facets' steps are seen: the light there is near zero, not smooth.
        lit = (expected > 0.1) & (found.alpha == 1.0) & ~_beside(found.alpha < 1.0)
        inner.append(float(np.sqrt(squares[lit].mean())))
    # Facets are off by the square of their size, their mean normals, where they are uneven, by the size
    # itself: between 4 and 16 for a quarter of it. Of samples beside the outline, as many as the facets are
    # off by change all their light, and the root of that goes with the size.
    assert inner[0] / inner[2] > 6.0
    assert whole[0] / whole[2] > 3.5
    # Corners 2 degrees apart: the outline, 16 pixels from the middle, is 2.4e-3 pixels in; of its 1600
    # samples a pixel wide less than four are missed, each 0.8 / 16 of a pixel of 2304.
    assert whole[2] < 0.8 / 16 * np.sqrt(4.0 / 2304.0) * light.irradiance / np.pi


def _beside(chosen: BoolArray) -> BoolArray:
    return np.asarray(binary_dilation(chosen, np.ones((3, 3), np.bool_)), np.bool_)


def test_a_plane_has_the_light_of_its_slope_and_no_more() -> None:
    for light in (FROM_ABOVE, ASLANT, DirectionalLight(np.array([3.0, 0.0, 0.01]), 2.0)):
        image = matt(square(1.0)).render(seen_from((0.0, -0.2, 0.4), 16), [light], 2).image
        expected = np.array(GREY) * light.irradiance / np.pi * light.direction[2]
        np.testing.assert_allclose(image.colour, np.broadcast_to(expected, (16, 16, 3)), rtol=1e-12)
        np.testing.assert_array_equal(image.alpha, 1.0)


def test_depth_of_a_plane_is_along_the_axis_not_along_the_ray() -> None:
    camera = Pinhole.looking_at((0, 0, 0.4), (0, 0, 0), (0, 1, 0), 31, 17, 0.9)
    found = matt(square(10.0)).render(camera, [FROM_ABOVE], 2)
    np.testing.assert_allclose(found.image.depth, 0.4, rtol=1e-12)
    np.testing.assert_allclose(found.normal, np.broadcast_to([0.0, 0.0, 1.0], (17, 31, 3)), atol=1e-12)


def test_a_square_shades_a_plane_where_its_shadow_falls() -> None:
    light = DirectionalLight(np.array([1.0, 0.0, 1.0]))
    made = matt(together(square(1.0), square(0.1, z=0.05)))
    camera = Pinhole.looking_at((0, 0, 4.0), (0, 0, 0), (0, 1, 0), 200, 200, 0.1)
    shaded, bright = (made.render(camera, [light], 4, shadow=shadow).image for shadow in (True, False))
    # Half of the shadow, that of x from -0.1 to 0, is under the square in part: seen are -0.1 to -0.05.
    dark = np.sum(np.where(bright.colour[..., 0] > 0, 1 - shaded.colour[..., 0] / bright.colour[..., 0], 0.0))
    pixel = 4.0 * 2.0 * np.tan(0.05) / 200
    # The square hides from the camera a little more than itself: it is nearer by 1/80.
    hidden = 0.05 * (4.0 / (4.0 - 0.05))
    expected = (0.1 - hidden) * 0.1
    assert dark * pixel**2 == pytest.approx(expected, rel=2e-3)


def test_coverage_of_a_disc_is_its_area() -> None:
    camera = seen_from((0.0, -2.0, 0.0), 40, 0.08)
    found = matt(ball(0.05, 5)).render(camera, [], 8)
    # The outline of a ball seen from d is a disc of the angle asin(r / d).
    radius_px = camera.focal_px * np.tan(np.arcsin(0.05 / 2.0))
    assert found.image.alpha.sum() == pytest.approx(np.pi * radius_px**2, rel=1e-3)
    np.testing.assert_array_equal(found.image.colour, 0.0)


@pytest.mark.slow  # a statistic of many pictures
@pytest.mark.parametrize("name", ["mug", "wrench"])
def test_more_samples_come_nearer_and_the_stated_noise_is_true(name: str) -> None:
    made = LitObject(builtin_appearance(name, edge=5e-3))
    camera = Pinhole.looking_at((0.3, -0.25, 0.25), made.appearance.mesh.bounds.mean(axis=0), UP, 48, 48, 0.4)
    best = made.render(camera, [ASLANT], 24).image
    errors, stated = [], []
    for samples in (2, 4, 8):
        found = made.render(camera, [ASLANT], samples)
        errors.append(float(np.sqrt(np.mean((found.image.colour - best.colour) ** 2))))
        assert found.noise is not None
        stated.append(found.noise)
    # Edges: between 1/N (places without order) and 1/N^1.5 for N a side.
    assert errors[0] / errors[2] > 4.0
    # An estimate, of a picture of a few thousand samples beside edges, some of them long and straight.
    for error, said in zip(errors, stated, strict=True):
        assert 0.4 * said < error < 1.25 * said


def test_an_upright_edge_is_covered_to_one_sample_of_all() -> None:
    for shift in np.linspace(0.0, 0.9, 7):
        pose = np.diag([1.0, -1.0, -1.0, 1.0])
        pose[2, 3] = 1.0
        camera = Pinhole(8, 8, 100.0, (4.0 + shift, 4.0), pose)
        # The square's left edge is at x = 0: the pixels beside column 4 + shift are covered to their right.
        half_plane = Mesh(square(1.0).vertices + np.array([0.5, 0.0, 0.0]), square(1.0).faces)
        alpha = matt(half_plane).render(camera, [], 4).image.alpha
        assert alpha[4].sum() == pytest.approx(8 - 4.0 - shift, abs=0.5 / 16 + 1e-9)


def test_two_lights_add() -> None:
    made, camera = matt(cuboid(0.1, 0.08, 0.05)), seen_from((0.2, -0.3, 0.25), 32)
    both = made.render(camera, [ASLANT, FROM_ABOVE]).image.colour
    one, other = (made.render(camera, [light]).image.colour for light in (ASLANT, FROM_ABOVE))
    np.testing.assert_allclose(both, one + other, atol=1e-15)


@pytest.mark.parametrize("factor", [2.0, 0.1])
def test_brightness_follows_the_light_and_not_the_distance(factor: float) -> None:
    made = matt(square(10.0))
    near = made.render(seen_from((0, -0.2, 0.4), 8), [ASLANT], 1).image
    brighter = DirectionalLight(ASLANT.direction, factor * ASLANT.irradiance)
    far = made.render(seen_from((0, -0.8, 1.6), 8), [brighter], 1).image
    np.testing.assert_allclose(far.colour, factor * near.colour, rtol=1e-12)


@pytest.mark.parametrize("distance", [0.3, 0.6, 25.0])
def test_an_object_twice_as_far_covers_a_quarter(distance: float) -> None:
    made = matt(ball(0.05, 4))
    angle = 4.0 * np.arcsin(0.05 / distance)
    camera = seen_from((0.0, -distance, 0.0), 40, angle)
    found = made.render(camera, [], 6).image.alpha.sum() / 1600
    expected = np.pi / 4.0 * (np.tan(angle / 4.0) / np.tan(angle / 2.0)) ** 2
    assert found == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("light", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.02), (-1.0, 1.0, 0.3)])
def test_a_convex_surface_casts_no_shadow_on_itself(light: tuple[float, float, float]) -> None:
    camera = seen_from((0.15, -0.2, 0.1), 64, 0.5)
    lights = [DirectionalLight(np.array(light))]
    for mesh in (ball(0.05, 2), ball(0.05, 4), cuboid(0.05, 0.06, 0.07)):
        one, other = (matt(mesh).render(camera, lights, 3, shadow=on).image for on in (True, False))
        np.testing.assert_array_equal(one.colour, other.colour)


def test_behind_the_light_is_black() -> None:
    away = DirectionalLight(np.array([0.0, 1.0, 0.0]))
    found = matt(cuboid(0.1, 0.1, 0.1)).render(seen_from((0.0, -0.5, 0.0), 16), [away], 2).image
    assert found.alpha.max() == 1.0
    np.testing.assert_array_equal(found.colour, 0.0)


def test_a_thin_wall_is_dark_behind_and_bright_before() -> None:
    wall = matt(cuboid(0.1, 5e-4, 0.1))
    light = DirectionalLight(np.array([0.1, -1.0, 0.2]))
    bright = wall.render(seen_from((0.0, -0.5, 0.0), 16, 0.1), [light], 2).image.colour
    dark = wall.render(seen_from((0.0, 0.5, 0.0), 16, 0.1), [light], 2).image.colour
    np.testing.assert_allclose(bright, np.broadcast_to(np.array(GREY) * -light.direction[1], (16, 16, 3)))
    np.testing.assert_array_equal(dark, 0.0)


def test_an_open_sheet_is_seen_and_lit_from_both_sides() -> None:
    sheet = matt(square(1.0))
    below = DirectionalLight(np.array([0.0, 0.0, -1.0]))
    lit = sheet.render(seen_from((0.1, -0.1, -0.5), 8), [below], 1).image.colour
    np.testing.assert_allclose(lit, np.broadcast_to(GREY, (8, 8, 3)))
    np.testing.assert_array_equal(
        sheet.render(seen_from((0.1, -0.1, -0.5), 8), [FROM_ABOVE], 1).image.colour, 0.0
    )


def test_inside_a_closed_object_it_is_dark_and_all_is_covered() -> None:
    camera = Pinhole.looking_at((0.01, 0.0, 0.0), (0.0, 0.02, 0.0), UP, 12, 12, 2.0)
    found = matt(ball(0.05, 3)).render(camera, [ASLANT], 2)
    np.testing.assert_array_equal(found.image.alpha, 1.0)
    np.testing.assert_array_equal(found.image.colour, 0.0)
    assert np.isfinite(found.image.depth).all()
    assert (matt(ball(0.05, 3)).render(camera, [ASLANT], 2, shadow=False).image.colour.max()) > 0.0


def test_an_object_out_of_sight_gives_an_empty_picture() -> None:
    camera = Pinhole.looking_at((0.0, -1.0, 0.0), (0.0, -2.0, 0.0), UP, 20, 10, 0.5)
    found = matt(ball(0.05, 2)).render(camera, [ASLANT], 3)
    assert found.image.colour.shape == (10, 20, 3)
    for black in (found.image.colour, found.image.alpha, found.normal):
        np.testing.assert_array_equal(black, 0.0)
    np.testing.assert_array_equal(found.image.depth, np.inf)
    assert found.noise == 0.0
    np.testing.assert_array_equal(found.image.over(0.25), 0.25)


def test_white_on_white_and_black_on_black_keep_their_outline_in_alpha_only() -> None:
    camera = (
        seen_from((0.0, 0.0, 0.5), 24)
        if False
        else Pinhole.looking_at((0, 0, 0.5), (0, 0, 0), (0, 1, 0), 24, 24, 0.4)
    )
    white = LitObject(plain(square(0.1), (1.0, 1.0, 1.0))).render(camera, [FROM_ABOVE], 4).image
    np.testing.assert_allclose(white.over(1.0), 1.0, rtol=1e-12)
    black = LitObject(plain(square(0.1), (0.0, 0.0, 0.0))).render(camera, [FROM_ABOVE], 4).image
    np.testing.assert_array_equal(black.over(0.0), 0.0)
    np.testing.assert_array_equal(white.alpha, black.alpha)


@pytest.mark.parametrize("name", ["mug", "bowl", "pitcher"])
def test_pictures_of_hollow_things_are_finite_from_anywhere(name: str) -> None:
    made = LitObject(builtin_appearance(name, edge=8e-3))
    centre = made.appearance.mesh.bounds.mean(axis=0)
    random = np.random.default_rng(7)
    for _ in range(6):
        away, to_light = random.standard_normal((2, 3))
        eye = centre + away * 10 ** random.uniform(-2, 1.4) / np.linalg.norm(away)
        camera = Pinhole.looking_at(eye, centre, random.standard_normal(3), 16, 9, 1.0)
        found = made.render(camera, [DirectionalLight(to_light)], 2)
        assert np.isfinite(found.image.colour).all()
        assert found.image.colour.min() >= 0.0
        assert ((found.image.alpha >= 0.0) & (found.image.alpha <= 1.0)).all()
        np.testing.assert_array_equal(np.isfinite(found.image.depth), found.image.alpha > 0.0)


def test_a_silhouette_is_where_the_projected_vertices_are() -> None:
    made = LitObject(builtin_appearance("mug", edge=3e-3))
    camera = Pinhole.looking_at((0.3, -0.25, 0.25), (0.0, 0.0, 0.05), UP, 128, 96, 0.5)
    covered = made.render(camera, [], 4).image.alpha > 0.0
    places, _ = camera.project(made.appearance.mesh.vertices)
    column, row = np.floor(places).astype(int).T
    assert _beside(covered)[row, column].all()
    rows, columns = np.nonzero(covered)
    for axis, seen in ((0, columns), (1, rows)):
        assert abs(seen.min() - places[:, axis].min()) <= 1.0
        assert abs(seen.max() + 1 - places[:, axis].max()) <= 1.0


def test_seconds_are_told_by_what_was_done() -> None:
    made, camera = matt(ball(0.05, 1)), seen_from((0.0, -0.5, 0.0), 8)
    assert list(made.render(camera, [ASLANT], 1).seconds) == ["hits", "light", "shadow", "gather"]
    assert list(made.render(camera, [ASLANT], 1, shadow=False).seconds) == ["hits", "light", "gather"]
    assert made.render(camera, [ASLANT], 1).noise is None


@pytest.mark.parametrize("samples", [0, -1, 65])
def test_samples_out_of_range_are_refused(samples: int) -> None:
    with pytest.raises(OutOfDomain, match="samples"):
        matt(ball(0.05, 1)).render(seen_from((0.0, -0.5, 0.0), 8), [ASLANT], samples)
