"""The sensor's rigid face meets what passes the gel by, and nothing sooner."""

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.basics.geometry import translation
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from mocks.world.touch import SPACING, STIFFNESS, GelContact, HousingContact

THICK = GELSIGHT_R15.gel_thickness
AWAY = 13.5e-3
"""M from the gel's middle: beyond its window, under the housing."""


@pytest.fixture(scope="module")
def wall() -> Mesh:
    """2 mm thick, along y, its upper edge at z = 0."""
    made = trimesh.creation.box((2e-3, 0.1, 0.06)).subdivide_to_size(8e-3)
    return Mesh(np.asarray(made.vertices) - np.array([0.0, 0.0, 0.03]), np.asarray(made.faces))


def facing_down(x: float, z: float) -> FloatArray:
    """``object_from_gel`` of a gel that looks down."""
    down = np.diag([1.0, -1.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = down, (x, 0.0, z)
    return pose


def test_a_wall_beside_the_gel_is_met_by_the_housing_alone(wall: Mesh) -> None:
    gel = GelContact(wall, GELSIGHT_R15.window, 0.75e-3, 10e-3)
    housing = HousingContact(wall, GELSIGHT_R15)
    assert not housing.wrench(facing_down(AWAY, -THICK + 0.1e-3)).any()
    pose = facing_down(AWAY, -THICK - 0.4e-3)
    assert not gel.wrench(pose).any()
    wrench = housing.wrench(pose)
    assert wrench[2] == pytest.approx(-0.4e-3 * STIFFNESS, rel=1e-6)
    # The wall is at x = -AWAY of the gel: (x, y) cross a push along -z turns about y by x times the push.
    assert wrench[4] == pytest.approx(-AWAY * 0.4e-3 * STIFFNESS, rel=0.1)


def test_the_gel_is_met_first_and_yields_by_its_thickness(wall: Mesh) -> None:
    housing = HousingContact(wall, GELSIGHT_R15)
    assert not housing.wrench(facing_down(0.0, -0.9 * THICK)).any()
    assert housing.wrench(facing_down(0.0, -THICK - 0.1e-3))[2] < 0.0


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_the_force_does_not_depend_on_where_the_world_s_origin_is(wall: Mesh, turn: float) -> None:
    cosine, sine = np.cos(turn), np.sin(turn)
    moved = np.eye(4)
    moved[:2, :2] = [[cosine, -sine], [sine, cosine]]
    moved = translation(np.array([0.2, -0.1, 0.4])) @ moved
    other = Mesh(wall.vertices @ moved[:3, :3].T + moved[:3, 3], wall.faces)
    pose = facing_down(AWAY, -THICK - 0.3e-3)
    here, there = HousingContact(wall, GELSIGHT_R15), HousingContact(other, GELSIGHT_R15)
    found, turned = here.wrench(pose), there.wrench(moved @ pose)
    # Which places of the face an edge covers may differ by one.
    np.testing.assert_allclose(turned, found, atol=-found[2] * SPACING)
