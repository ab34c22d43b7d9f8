from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.objects.household import build
from harness.sim.solid.intake import take_in

OURS = {"mug": 1, "bowl": 0, "plate": 0, "pitcher": 1, "tray": 4, "wrench": 1}
REAL = {
    "ycb_isaac/025_mug/textured.obj": ("cm", 1),
    "ycb_ocrtoc/bowl/textured.obj": ("m", 0),
    "contactdb_objects/wineglass.stl": ("m", 0),
    "contactdb_objects/teapot.stl": ("m", 1),
    "contactdb_objects/fryingpan.stl": ("m", 1),
}

points = st.lists(st.floats(-0.2, 0.2), min_size=3, max_size=3).map(np.array)


@cache
def symmetry_of(name: str) -> SymmetryGroup:
    """Return the symmetry of an object of ours."""
    return find_symmetries(build(name))


def solid(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def prism(sides: int) -> Mesh:
    return solid(trimesh.creation.cylinder(radius=0.05, height=0.13, sections=sides))


@pytest.mark.parametrize(("name", "fold"), OURS.items())
def test_built_in_objects_have_the_symmetry_they_were_given(name: str, fold: int) -> None:
    group = symmetry_of(name)
    assert group.fold == fold
    assert group.flip is None
    if fold != 1:
        assert abs(group.axis[2]) > np.cos(np.radians(0.2))
        assert np.linalg.norm(group.centre[:2]) < 0.2e-3


@pytest.mark.slow  # measured data that do not change
@pytest.mark.parametrize(("name", "expected"), REAL.items())
def test_scanned_objects_are_symmetric_as_people_say(
    shared_data: Path, name: str, expected: tuple[str, int]
) -> None:
    units, fold = expected
    assert find_symmetries(take_in(shared_data / "meshes" / name, units).mesh).fold == fold


@pytest.mark.parametrize("sides", [3, 4, 5, 6])
def test_a_prism_has_as_many_rotations_as_sides_and_turns_over(sides: int) -> None:
    group = find_symmetries(prism(sides))
    assert group.fold == sides
    assert group.flip is not None


def test_a_cylinder_turns_by_any_angle_and_over_but_a_cone_not_over() -> None:
    cylinder = find_symmetries(solid(trimesh.creation.cylinder(radius=0.03, height=0.1, sections=120)))
    cone = find_symmetries(solid(trimesh.creation.cone(radius=0.03, height=0.1, sections=120)))
    assert (cylinder.fold, cone.fold) == (0, 0)
    assert cylinder.flip is not None
    assert cone.flip is None


@pytest.mark.parametrize("name", ["tray", "bowl", "mug"])
def test_moving_the_object_moves_its_symmetry_along(name: str) -> None:
    mesh = build(name)
    pose = transform(rotation_from_vector(np.array([0.7, -1.1, 0.4])), np.array([0.3, -0.2, 0.5]))
    here, there = symmetry_of(name), find_symmetries(Mesh(apply(pose, mesh.vertices), mesh.faces))
    assert here.fold == there.fold
    a, b = mesh.vertices[5], mesh.vertices[900]
    moved = apply(pose, np.array([a, b]))
    assert there.distance(moved[0], moved[1]) == pytest.approx(here.distance(a, b), abs=0.2e-3)


@pytest.fixture(scope="module", params=["mug", "bowl", "tray", "prism"])
def group(request: pytest.FixtureRequest) -> SymmetryGroup:
    return find_symmetries(prism(6)) if request.param == "prism" else symmetry_of(request.param)


@given(a=points, b=points)
@settings(max_examples=30)
def test_the_distance_is_symmetric_and_at_most_the_straight_one(
    group: SymmetryGroup, a: FloatArray, b: FloatArray
) -> None:
    there, back = group.distance(a, b), group.distance(b, a)
    assert there == pytest.approx(back, abs=1e-12)
    assert 0.0 <= there <= np.linalg.norm(a - b) + 1e-12


@given(a=points, b=points)
@settings(max_examples=30)
def test_images_of_a_point_are_no_distance_apart_and_equally_far_from_any_other(
    group: SymmetryGroup, a: FloatArray, b: FloatArray
) -> None:
    images = group.images(a)
    assert group.distances(images, a) == pytest.approx(0.0, abs=1e-9)
    assert group.distances(images, b) == pytest.approx(group.distance(a, b), abs=1e-9)


def test_opposite_corners_of_a_tray_are_one_place_and_a_handle_is_none() -> None:
    tray, mug = symmetry_of("tray"), symmetry_of("mug")
    corner = np.array([0.09, 0.09, 0.03])
    assert tray.distance(corner, -corner * [1.0, 1.0, -1.0]) < 0.1e-3
    assert tray.distance(corner, np.array([0.09, 0.0, 0.03])) == pytest.approx(0.09, abs=0.2e-3)
    assert mug.distance(np.array([0.04, 0.0, 0.05]), np.array([-0.04, 0.0, 0.05])) == pytest.approx(0.08)
