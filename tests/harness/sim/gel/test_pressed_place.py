"""A pose of a gel is taken apart into the press that it was made from."""

import numpy as np
import pytest

from harness.authoring.touch.data import draw_presses
from harness.basics.errors import OutOfDomain
from harness.basics.geometry import inverse, transform
from harness.objectfile.surface_search import SurfaceSearch
from harness.sim.gel.press_pose import Presses, presses_of
from tests.samples import touch_bench as tb

MESH = tb.peg()
ROUNDING = 1e-9
"""m and rad: 1e6 times what float64 loses of 0.1 m, for lengths of rays and normals between three corners."""


def drawn(count: int = 60) -> Presses:
    return draw_presses(tb.peg(), SurfaceSearch(tb.peg()).spread(count, 5)[0], 2)


def test_a_press_comes_back_from_its_pose() -> None:
    asked = drawn()
    found = presses_of(MESH, inverse(asked.object_from_gel))
    np.testing.assert_allclose(found.points, asked.points, atol=ROUNDING)
    np.testing.assert_allclose(found.depths, asked.depths, atol=ROUNDING)
    same = np.abs(found.normals - asked.normals).max(axis=1) < ROUNDING
    # On an edge either face's normal is the place's own.
    assert np.count_nonzero(same) >= 0.95 * len(asked)
    np.testing.assert_allclose(found.tilts[same], asked.tilts[same], atol=ROUNDING)
    turns = (found.yaws - asked.yaws)[same] / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.rint(turns), atol=ROUNDING)


def test_the_press_of_a_pose_has_that_pose() -> None:
    poses = drawn().object_from_gel
    np.testing.assert_allclose(presses_of(MESH, inverse(poses)).object_from_gel, poses, atol=ROUNDING)


@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-8])
@pytest.mark.parametrize("yaw", [-3.0, 0.0, 2.5])
def test_an_upright_gel_keeps_its_yaw(tilt: float, yaw: float) -> None:
    asked = drawn(1)
    upright = Presses.one(asked.points[0], asked.normals[0], 1e-3, tilt, 1.2, yaw)
    found = presses_of(MESH, inverse(upright.object_from_gel))
    np.testing.assert_allclose(found.object_from_gel, upright.object_from_gel, atol=ROUNDING)
    assert found.tilts[0] < tilt + ROUNDING


def test_a_gel_beside_the_object_presses_no_place() -> None:
    away = transform(np.eye(3), np.array([1.0, 1.0, 1.0]))
    poses = inverse(np.concatenate([drawn(1).object_from_gel, away[None]]))
    with pytest.raises(OutOfDomain, match=r"gel 2 of 2 .*touch\.shapes = reference"):
        presses_of(MESH, poses)
