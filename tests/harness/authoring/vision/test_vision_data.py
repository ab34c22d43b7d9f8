"""What is learned from is what a camera would see, and never what is judged by."""

import numpy as np
import pytest

from harness.authoring.vision.data import (
    HeldOutViews,
    around,
    held_out_pictures,
)
from harness.authoring.vision.places import sphere, surface_places
from harness.basics.errors import WrongUse
from harness.sim.light.appearance_source import builtin_appearance
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import cuboid


@pytest.fixture(scope="module")
def mug() -> LitObject:
    return LitObject(builtin_appearance("mug", edge=6e-3))


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
