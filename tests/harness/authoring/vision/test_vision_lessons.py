"""What networks of a look learn from lies on the surface, and is clear of what is kept back."""

import numpy as np
import pytest

from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.lessons import AHEAD, Lessons, draw_lamps, draw_lessons
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball, square, together
from tests.samples.taught_ball import NOTHING, RADIUS, lit_ball


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


def test_lessons_lie_along_views_of_the_surface() -> None:
    """On a ball the distance to the surface is known: colours are near it, and depth is what it says."""
    voxel = RADIUS / 30.0
    fine = LitObject(plain(ball(RADIUS, 4), (0.7, 0.4, 0.1)))
    lessons = draw_lessons(fine, 3000, voxel, 1, NOTHING)
    behind = (RADIUS - np.linalg.norm(lessons.points, axis=1)) / voxel
    coloured = lessons.weight == 1.0
    assert np.all(np.abs(behind[coloured]) < 0.85)
    # A view goes straight where the ball curves away, by 4^2 / 60 voxels at most; faces lean by 0.05.
    clear = np.abs(lessons.depth) < 1.0
    assert lessons.depth[clear] == pytest.approx(behind[clear] + AHEAD, abs=0.5)
    assert np.all(lessons.depth[behind < -1.6] == -1.0)
    assert np.all(lessons.colours == np.array([0.7, 0.4, 0.1], np.float32))


def test_lessons_and_lamps_are_clear_of_what_is_kept_back(lit: LitObject) -> None:
    held_out = held_out_pictures(lit.appearance.mesh, 3, 32, 32, 5, apart=np.radians(20.0))
    lamps = draw_lamps(500, 1, held_out).astype(np.float64)
    kept = np.stack([light.direction for light in held_out.lights])
    assert np.abs(lamps @ kept.T).max() < np.cos(held_out.apart) + 1e-6
    everywhere = held_out_pictures(lit.appearance.mesh, 200, 32, 32, 5, apart=np.radians(44.0))
    with pytest.raises(OutOfDomain, match=r"of 500 lamps"):
        draw_lamps(500, 1, everywhere)


def test_lamps_of_a_place_light_it(lit: LitObject) -> None:
    """A ball is in the way of no lamp that its place faces; those kept back light nothing."""
    held_out = held_out_pictures(lit.appearance.mesh, 3, 32, 32, 5, apart=np.radians(20.0))
    lessons = draw_lessons(lit, 2000, 1e-3, 2, held_out, lamps=4)
    cosine = np.einsum("nx,nx->n", lessons.normals, lessons.lamps)
    assert np.count_nonzero(cosine < 0.0) > 50
    faced = cosine > 0.1
    lit_by = cosine[faced, None] * np.array([0.7, 0.4, 0.1])
    assert lessons.colours[faced] == pytest.approx(lit_by, abs=1e-5)
    assert not lessons.colours[cosine < -1e-6].any()
    assert held_out.clear_of_lights(lessons.lamps.astype(np.float64)).all()
    assert np.all(np.unique(lessons.points, axis=0, return_counts=True)[1] <= 4)


def test_what_no_camera_sees_is_not_learned() -> None:
    both = together(ball(0.03, 2), ball(0.05, 2))
    lessons = draw_lessons(LitObject(plain(both, (0.8, 0.5, 0.2))), 3000, 1e-3, 9, NOTHING)
    assert np.linalg.norm(lessons.points, axis=1).min() > 0.04


def test_an_open_sheet_is_learned_from_both_sides() -> None:
    lessons = draw_lessons(LitObject(plain(square(0.1), (0.8, 0.5, 0.2))), 2000, 1e-3, 10, NOTHING)
    assert 0.4 < (lessons.normals[:, 2] > 0.0).mean() < 0.6
    assert (np.einsum("nx,nx->n", lessons.normals, lessons.views) < 0.0).all()


def test_an_object_inside_out_is_refused() -> None:
    mesh = ball(0.05, 2)
    turned = LitObject(plain(Mesh(mesh.vertices, mesh.faces[:, ::-1]), (0.8, 0.5, 0.2)))
    with pytest.raises(OutOfDomain, match=r"\b0 of \d+ places"):
        draw_lessons(turned, 10, 1e-3, 0, NOTHING)


def test_fewer_lessons_are_the_first_of_more(lit: LitObject) -> None:
    few, many = (draw_lessons(lit, count, 1e-3, 6, NOTHING) for count in (100, 300))
    for name in Lessons.__dataclass_fields__:
        assert np.array_equal(getattr(few, name), getattr(many, name)[:100])
