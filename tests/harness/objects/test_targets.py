"""A ball target is a ball where the gel meets it, stands, is closed, and clears what holds it."""

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.mesh import signed_volume
from harness.objects.builtin import MATERIALS, build
from harness.objects.targets import BALL_RADIUS, ball


@pytest.mark.parametrize("edge", [2.2e-3, 3e-3])
def test_all_that_sinks_into_a_gel_is_a_sphere(edge: float) -> None:
    mesh = ball(edge)
    top = mesh.vertices[:, 2].max()
    centre = np.array([0.0, 0.0, top - BALL_RADIUS])
    upper = mesh.vertices[mesh.vertices[:, 2] > centre[2]]
    assert len(upper) > 3000
    assert np.linalg.norm(upper - centre, axis=1) == pytest.approx(BALL_RADIUS, abs=1e-12)
    # Facets lie inside by the sagitta of their longest edge, e^2 / 8 R.
    corners = mesh.corners[mesh.corners[:, :, 2].min(axis=1) > centre[2]]
    inside = BALL_RADIUS - np.linalg.norm(corners.mean(axis=1) - centre, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    assert 0.0 < inside.max() < longest**2 / (2.0 * BALL_RADIUS)
    assert inside.max() < 1e-6


def test_it_stands_on_zero_and_is_closed() -> None:
    mesh = ball()
    assert mesh.vertices[:, 2].min() == 0.0
    edges = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    whole = 4.0 / 3.0 * np.pi * BALL_RADIUS**3
    assert signed_volume(mesh) > whole


def test_the_stem_stays_behind_the_ball_however_deep_it_is_pressed() -> None:
    mesh = ball()
    below = mesh.vertices[mesh.vertices[:, 2] < 8.0 * BALL_RADIUS]
    assert np.hypot(below[:, 0], below[:, 1]).max() < 0.7 * BALL_RADIUS


def test_no_two_edges_share_vertices() -> None:
    one, other = ball(2.2e-3), ball(3e-3)
    assert len(one.vertices) != len(other.vertices)


def test_it_is_named_beside_the_household_objects_and_is_none_of_them() -> None:
    from harness.objects import household

    assert MATERIALS["ball"] == "steel"
    assert "ball" not in household.MATERIALS
    assert len(build("ball").faces) == len(ball().faces)
    with pytest.raises(WrongUse, match="mug"):
        build("cube")
