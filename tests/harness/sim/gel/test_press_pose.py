"""Where a gel is pressed on: the place is met at the depth asked for, whatever the tilt and the yaw."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.geometry import inverse
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.builtin import build
from harness.sim.gel.height_map import RasterMesh, height_maps
from harness.sim.gel.press_pose import MOST_MOVED, ContactPlace, _nearest, contact_place, gel_from_object
from harness.sim.solid.walls import nearest_on_surface

ANGLES = st.floats(-np.pi, np.pi)


def solid(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


BOX = solid(trimesh.creation.box(extents=(0.08, 0.06, 0.04)))
BALL = solid(trimesh.creation.icosphere(subdivisions=4, radius=0.02))
RASTER = RasterMesh(BOX)


def gap(raster: RasterMesh, pose: FloatArray) -> FloatArray:
    return np.asarray(height_maps(raster, pose[None], GELSIGHT_R15)[0])


@settings(max_examples=40, deadline=None)
@given(
    depth=st.floats(-1e-3, 2e-3),
    tilt=st.floats(0.0, np.radians(40.0)),
    azimuth=ANGLES,
    yaw=ANGLES,
    x=st.floats(-0.02, 0.02),
    y=st.floats(-0.01, 0.01),
)
def test_the_centre_of_the_gel_is_as_deep_as_was_asked(
    depth: float, tilt: float, azimuth: float, yaw: float, x: float, y: float
) -> None:
    place = contact_place(BOX, np.array([x, y, 0.02]))
    seen = gap(RASTER, gel_from_object(place, depth, tilt, azimuth, yaw))
    # The centre lies between four pixels, and a face is straight.
    assert -seen[59:61, 79:81].mean() == pytest.approx(depth, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(tilt=st.floats(0.01, np.radians(60.0)), azimuth=ANGLES, yaw=ANGLES)
def test_tilt_is_the_angle_to_the_normal_and_azimuth_where_it_leans(
    tilt: float, azimuth: float, yaw: float
) -> None:
    place = contact_place(BALL, np.array([0.012, -0.009, 0.0132]))
    upright = inverse(gel_from_object(place, 0.0, 0.0, 0.0, 0.0))[:3, :3]
    leant = inverse(gel_from_object(place, 0.0, tilt, azimuth, yaw))[:3, :3]
    assert np.arccos(-leant[:, 2] @ place.normal) == pytest.approx(tilt, abs=1e-7)
    x, y, _ = upright.T @ leant[:, 2]
    assert np.arctan2(y, x) == pytest.approx(azimuth, abs=1e-9)
    turned = inverse(gel_from_object(place, 0.0, tilt, azimuth, yaw + np.pi))[:3, :3]
    assert turned == pytest.approx(leant * [-1.0, -1.0, 1.0], abs=1e-12)


def test_a_yaw_of_half_a_turn_turns_the_height_map() -> None:
    raster = RasterMesh(BALL)
    place = contact_place(BALL, np.array([0.0, 0.0, 0.02]))
    maps = [
        gap(raster, gel_from_object(place, 1e-3, np.radians(8.0), 0.7, yaw)) for yaw in (0.3, 0.3 + np.pi)
    ]
    met = np.isfinite(maps[0])
    assert np.array_equal(met, np.isfinite(maps[1])[::-1, ::-1])
    assert maps[1][::-1, ::-1][met] == pytest.approx(maps[0][met], abs=1e-9)


def test_a_lean_towards_x_presses_the_other_side_deeper() -> None:
    # The axis that looks into the surface leans to +x, so the face of the gel lifts there.
    place = contact_place(BOX, np.array([0.0, 0.0, 0.02]))
    seen = gap(RASTER, gel_from_object(place, 1e-3, np.radians(5.0), 0.0, 0.0))
    assert seen[60, 40] - seen[60, 120] == pytest.approx(-np.tan(np.radians(5.0)) * 80 * 0.1245e-3, abs=1e-12)


def test_normals_are_smooth_over_bends_and_straight_beside_edges() -> None:
    rng = np.random.default_rng(1)
    for toward in rng.normal(size=(20, 3)):
        unit = toward / np.linalg.norm(toward)
        smooth = contact_place(BALL, 0.0198 * unit).normal
        assert np.degrees(np.arccos(min(1.0, float(smooth @ unit)))) < 0.5  # its faces lean by up to 3
    for x, y in ((0.039, 0.029), (-0.0399, 0.0), (0.02, -0.0299)):
        assert contact_place(BOX, np.array([x, y, 0.02])).normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_a_point_near_the_surface_is_moved_onto_it_and_it_is_said() -> None:
    place = contact_place(BOX, np.array([0.01, 0.01, 0.0212]))
    assert place.moved == pytest.approx(1.2e-3)
    assert place.point == pytest.approx([0.01, 0.01, 0.02])


def test_places_near_and_far_are_the_nearest_of_all() -> None:
    mesh = build("mug")
    low, high = (1.3 * bound for bound in mesh.bounds)
    points = np.random.default_rng(0).uniform(low, high, size=(40, 3))
    points[:20] = mesh.vertices[::400][:20] + 1e-4
    diagonal = np.full(len(points), 2.0 * mesh.diagonal)
    wanted, _ = nearest_on_surface(mesh, points, np.zeros(points.shape), diagonal)
    found, faces = _nearest(mesh, points)
    assert found == pytest.approx(wanted, abs=1e-12)
    assert (faces >= 0).all()


def test_a_point_off_the_surface_is_refused_with_its_distance() -> None:
    off = r"5 mm .* 2 mm.*0.001 0 0.02 "
    with pytest.raises(OutOfDomain, match=off):
        contact_place(BOX, np.array([0.001, 0.0, 0.025]))
    with pytest.raises(OutOfDomain, match="millimetres"):
        contact_place(BOX, np.array([10.0, 10.0, 20.0]))
    assert MOST_MOVED == 2e-3
    for bad in ([0.0, 0.0, np.nan], [0.0, 0.0]):
        with pytest.raises(WrongUse, match="finite"):
            contact_place(BOX, np.array(bad))


@pytest.mark.parametrize(
    ("depth", "tilt", "words"), [(1e-3, -0.1, "--azimuth"), (1e-3, 1.2, "60 deg"), (np.nan, 0.0, "finite")]
)
def test_poses_that_cannot_be_are_refused(depth: float, tilt: float, words: str) -> None:
    place = ContactPlace(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0)
    with pytest.raises(WrongUse, match=words):
        gel_from_object(place, depth, tilt, 0.0, 0.0)
