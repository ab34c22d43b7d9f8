"""The gel as a bed of springs, against shapes whose volume is known."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, inverse, transform
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration
from mocks.world.touch import BED_MODULUS, GelContact

RADIUS = 0.05
WINDOW = (0.02, 0.015)
SPACING = 0.5e-3
REACH = 0.01


@pytest.fixture(scope="module")
def ball() -> Mesh:
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=RADIUS)
    return Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))


def pressed(direction: FloatArray, yaw: float, depth: float) -> FloatArray:
    """``object_from_gel`` of a gel that faces the ball's centre from ``direction``."""
    rotation = frame_facing(-direction, yaw)
    return transform(rotation, direction * (RADIUS - depth))


@settings(max_examples=25, deadline=None)
@given(st.floats(0.3e-3, 0.55e-3), st.floats(-3.0, 3.0), st.floats(0.1, 3.0), st.floats(-3.0, 3.0))
def test_force_is_the_modulus_times_the_volume_of_the_cap(
    ball: Mesh, depth: float, yaw: float, polar: float, azimuth: float
) -> None:
    direction = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    wrench = GelContact(ball, WINDOW, SPACING, REACH).wrench(pressed(direction, yaw, depth))
    cap = np.pi * depth**2 * (RADIUS - depth / 3)
    # The facets lie up to edge^2 / 8 R = 2 um inside the ball: 2 * 2 um / depth of the volume, and
    # the springs' squares round the cap's rim.
    assert -wrench[2] == pytest.approx(BED_MODULUS * cap, rel=0.03)
    assert np.abs(wrench[:2]).max() == 0.0
    assert np.abs(wrench[3:]).max() < 0.02 * -wrench[2] * WINDOW[0]


def test_a_press_beside_the_centre_turns_the_gel(ball: Mesh) -> None:
    pose = pressed(np.array([0.0, 0.0, 1.0]), 0.0, 0.3e-3)
    beside = pose.copy()
    beside[:3, 3] += pose[:3, 0] * 2e-3  # the ball is now at x = -2 mm of the gel
    wrench = GelContact(ball, WINDOW, SPACING, REACH).wrench(beside)
    # (x, y) cross a push along -z: about y, the torque is x times the push.
    assert wrench[4] == pytest.approx(-2e-3 * -wrench[2], rel=0.05)


def test_nothing_pushes_before_contact(ball: Mesh) -> None:
    contact = GelContact(ball, WINDOW, SPACING, REACH)
    for gap in (1e-6, 1e-3, 0.3):
        assert not contact.wrench(pressed(np.array([0.0, 0.0, 1.0]), 0.3, -gap)).any()


def test_deeper_pushes_harder(ball: Mesh) -> None:
    contact = GelContact(ball, WINDOW, SPACING, REACH)
    pushes = [
        -contact.wrench(pressed(np.array([1.0, 0.0, 0.0]), 0.3, depth))[2]
        for depth in np.linspace(0.0, 3e-3, 40)
    ]
    assert np.all(np.diff(pushes) >= 0.0)
    assert pushes[-1] > 3.0


def test_the_springs_feel_what_the_camera_sees() -> None:
    """The same depth as the full picture's z-buffer, through an independent kernel."""
    torus = trimesh.creation.torus(0.04, 0.006, major_sections=90, minor_sections=40)
    mesh = Mesh(np.asarray(torus.vertices), np.asarray(torus.faces))
    random = np.random.default_rng(5)
    contact = GelContact(mesh, GELSIGHT_R15.window, 0.75e-3, 0.05)
    touched = 0
    for _ in range(50):
        vertex = int(random.integers(len(mesh.vertices)))
        axis = -mesh.vertex_normals[vertex] + 0.2 * random.standard_normal(3)
        rotation = frame_facing(axis / np.linalg.norm(axis), random.uniform(-3, 3))
        pose = transform(rotation, mesh.vertices[vertex] + 1e-3 * rotation[:, 2])
        picture = penetration(height_maps(RasterMesh(mesh), inverse(pose)[None], GELSIGHT_R15), GELSIGHT_R15)
        assert contact.indentation(pose).max() <= picture.max() + 0.2e-3
        felt, seen = contact.indentation(pose).mean(), picture.mean()
        assert felt == pytest.approx(seen, rel=0.05, abs=5e-6)
        touched += picture.max() > 0
    assert touched == 50
