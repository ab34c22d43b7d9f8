"""What is learned from is what a camera would see, and never what is judged by."""

import numpy as np
import pytest

from harness.authoring.vision.data import (
    HeldOutViews,
    around,
    draw_tuples,
    draw_views,
    held_out_pictures,
)
from harness.authoring.vision.places import sphere, surface_places
from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.mesh import Mesh
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.appearance_source import builtin_appearance
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball, cuboid, square, together

NOTHING = HeldOutViews((), ())
GREY = (0.8, 0.5, 0.2)


@pytest.fixture(scope="module")
def mug() -> LitObject:
    return LitObject(builtin_appearance("mug", edge=6e-3))


def angle(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(a - b, axis=-1), 1.0)))


def test_a_tuple_is_what_a_camera_sees_there(mug: LitObject) -> None:
    drawn = draw_tuples(mug, 400, 1, NOTHING)
    size = mug.appearance.mesh.diagonal
    for k in range(0, 400, 8):
        view = drawn.views[k]
        up = np.eye(3)[np.argmin(np.abs(view))]
        camera = Pinhole.looking_at(drawn.points[k] - 3.0 * size * view, drawn.points[k], up, 1, 1, 1e-9)
        found = mug.render(camera, [DirectionalLight(drawn.lights[k])], 1)
        assert found.image.depth[0, 0] == pytest.approx(3.0 * size, rel=1e-9)
        # The ray ends as near to the place as a camera's place is rounded: on a print's edge that shows.
        np.testing.assert_allclose(found.image.colour[0, 0], drawn.colours[k], atol=1e-6)
        np.testing.assert_allclose(found.normal[0, 0], drawn.normals[k], atol=1e-6)


def test_what_is_unlit_is_black_and_what_is_lit_is_not(mug: LitObject) -> None:
    drawn = draw_tuples(mug, 20_000, 2, NOTHING)
    np.testing.assert_array_equal(drawn.colours[~drawn.visible], 0.0)
    assert (drawn.colours[drawn.visible] > 0.0).all()
    assert 0.1 < drawn.visible.mean() < 0.95
    for unit in (drawn.views, drawn.lights, drawn.normals):
        np.testing.assert_allclose(np.linalg.norm(unit, axis=1), 1.0, rtol=1e-12)


def test_nothing_is_drawn_within_the_angle_of_what_is_kept_back(mug: LitObject) -> None:
    apart = np.radians(8.0)
    kept = held_out_pictures(mug.appearance.mesh, 10, 32, 32, 3, apart=apart)
    free = draw_tuples(mug, 20_000, 3, NOTHING)
    drawn = draw_tuples(mug, 20_000, 3, kept)

    def nearest(points: FloatArray, views: FloatArray) -> FloatArray:
        ways = [points - camera.eye for camera in kept.cameras]
        units = [way / np.linalg.norm(way, axis=1)[:, None] for way in ways]
        return np.asarray(np.min([angle(unit, views) for unit in units], axis=0))

    lamps = [light.direction for light in kept.lights]
    assert nearest(free.points, free.views).min() < apart
    assert nearest(drawn.points, drawn.views).min() > apart * (1.0 - 1e-9)
    assert min(angle(drawn.lights, lamp).min() for lamp in lamps) > apart * (1.0 - 1e-9)
    for camera, light in draw_views(mug.appearance.mesh, 20, 8, 8, 3, kept):
        middle = mug.appearance.mesh.bounds.mean(axis=0)
        assert nearest(middle[None], camera.forward[None])[0] > apart * (1.0 - 1e-6)
        assert min(float(angle(light.direction, lamp)) for lamp in lamps) > apart * (1.0 - 1e-9)


def test_a_seed_gives_the_same_and_more_begin_like_fewer(mug: LitObject) -> None:
    few, many, other = (
        draw_tuples(mug, 50, 5, NOTHING),
        draw_tuples(mug, 90_000, 5, NOTHING),
        draw_tuples(mug, 50, 6, NOTHING),
    )
    np.testing.assert_array_equal(few.colours, many.colours[:50])
    np.testing.assert_array_equal(few.views, many.views[:50])
    assert len(many) == 90_000
    assert not np.array_equal(few.points, other.points)
    assert len(draw_tuples(mug, 0, 5, NOTHING)) == 0


def test_places_are_uniform_over_the_surface() -> None:
    box = cuboid(0.1, 0.2, 0.3)
    faces, weights = surface_places(box, 60_000, np.random.default_rng(7))
    expected = 60_000 * box.face_areas / box.face_areas.sum()
    counts = np.bincount(faces, minlength=12)
    assert (np.abs(counts - expected) < 5.0 * np.sqrt(expected)).all()
    assert weights.min() >= 0.0
    assert weights.sum(axis=1).max() <= 1.0
    # The mean place of a triangle is its middle, to five standard errors of a uniform share.
    np.testing.assert_allclose(weights.mean(axis=0), 1.0 / 3.0, atol=5.0 * 0.24 / np.sqrt(60_000))


def test_views_of_a_ball_are_as_pixels_see_it() -> None:
    drawn = draw_tuples(LitObject(plain(ball(0.05, 4), GREY)), 40_000, 8, NOTHING)
    cosine = -np.einsum("nx,nx->n", drawn.views, drawn.normals)
    # Seen by pixels, the square of the cosine is uniform.
    np.testing.assert_allclose(np.mean(cosine**2), 0.5, atol=5.0 * 0.29 / np.sqrt(40_000) + 1e-3)


def test_what_no_camera_sees_is_not_learned() -> None:
    inner, outer = ball(0.03, 2), ball(0.05, 2)
    drawn = draw_tuples(LitObject(plain(together(inner, outer), GREY)), 3000, 9, NOTHING)
    assert np.linalg.norm(drawn.points, axis=1).min() > 0.04


def test_an_open_sheet_is_learned_from_both_sides() -> None:
    drawn = draw_tuples(LitObject(plain(square(0.1), GREY)), 2000, 10, NOTHING)
    assert 0.4 < (drawn.normals[:, 2] > 0.0).mean() < 0.6
    assert (np.einsum("nx,nx->n", drawn.normals, drawn.views) < 0.0).all()


def test_an_object_inside_out_is_refused() -> None:
    mesh = ball(0.05, 2)
    with pytest.raises(OutOfDomain, match=r"\b0 of \d+ places"):
        draw_tuples(LitObject(plain(Mesh(mesh.vertices, mesh.faces[:, ::-1]), GREY)), 10, 0, NOTHING)


@pytest.mark.parametrize("size", [(32, 32), (48, 20), (20, 48)])
def test_a_whole_object_is_in_the_picture(mug: LitObject, size: tuple[int, int]) -> None:
    mesh = mug.appearance.mesh
    for way in [*sphere(8, np.random.default_rng(11)), np.eye(3)[2], -np.eye(3)[2]]:
        places, _ = around(mesh, way, *size, 2.0).project(mesh.vertices)
        assert places.min() > 0.0
        assert (places < size).all()


def test_pictures_kept_back_are_lit_from_the_side_of_the_camera(mug: LitObject) -> None:
    kept = held_out_pictures(mug.appearance.mesh, 16, 24, 24, 4)
    middle = mug.appearance.mesh.bounds.mean(axis=0)
    for camera, light in zip(kept.cameras, kept.lights, strict=True):
        assert (camera.eye - middle) @ light.direction > 0.0
        assert mug.render(camera, [light], 1).image.colour.max() > 0.0


def test_bad_questions_are_refused(mug: LitObject) -> None:
    mesh = mug.appearance.mesh
    with pytest.raises(WrongUse, match=r"\b0 pictures"):
        held_out_pictures(mesh, 0, 8, 8, 0)
    with pytest.raises(WrongUse, match=r"0\.4 diagonals"):
        held_out_pictures(mesh, 1, 8, 8, 0, distance=0.4)
    with pytest.raises(WrongUse, match=r"1 cameras.*0 lights"):
        HeldOutViews(held_out_pictures(mesh, 1, 8, 8, 0).cameras, ())
    with pytest.raises(WrongUse, match="45 deg"):
        HeldOutViews((), (), 1.0)
    everywhere = held_out_pictures(mesh, 200, 8, 8, 0, apart=0.7)
    with pytest.raises(OutOfDomain, match=r"\b0 of 1 views.*200 .* deg"):
        draw_views(mesh, 1, 8, 8, 0, everywhere)
