"""The hull of contacts is closed, holds them all, and says how far from a touch it is."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.answer import known
from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.hull import hull_estimate
from experiments.shape_reconstruction.surface import TOUCHED
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import frame_facing, transform

NOTHING = np.zeros((0, 3))
signed_distance: Any = trimesh.proximity.signed_distance


def touch(index: int, place: FloatArray, normal: FloatArray) -> GuardedTouch:
    """Twelve points on a disc of 5 mm."""
    frame = frame_facing(-normal, 0.0)
    turns = np.arange(12) * np.pi / 6.0
    disc = 5e-3 * np.column_stack([np.cos(turns), np.sin(turns), np.zeros(12)]) @ frame.T
    return GuardedTouch(
        transform(frame, place), 0.1, place + disc, np.tile(normal, (12, 1)), 6e-4, 0.04, index
    )


def evidence(*touches: GuardedTouch) -> ShapeEvidence:
    return ShapeEvidence(touches, None, (0.034, 0.030), 2.5e-3, 0.12, 0.02, 1e-3, 0.3)


def cube(side: float) -> ShapeEvidence:
    """Touched in the middle of five sides."""
    up = np.array([0.0, 0.0, 0.5 * side])
    ways = [np.array([1.0, 0, 0]), np.array([-1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, -1.0, 0])]
    sides = [touch(k, up + 0.5 * side * way, way) for k, way in enumerate(ways)]
    return evidence(*sides, touch(4, 2.0 * up, np.array([0.0, 0.0, 1.0])))


def test_it_is_closed_and_holds_every_contact() -> None:
    given = cube(0.1)
    found = hull_estimate(given)
    made = trimesh.Trimesh(found.mesh.vertices, found.mesh.faces, process=False)
    assert made.is_watertight
    assert made.volume > 0.0
    for one in given.contacts:
        assert signed_distance(made, one.points).min() > -1e-9
    assert found.not_bounded == ()
    assert (found.known_by == TOUCHED).any()


def test_turning_and_moving_the_contacts_turns_and_moves_it() -> None:
    given, c, s = cube(0.1), np.cos(0.4), np.sin(0.4)
    turn, by = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([0.02, -0.03, 0.0])
    moved = [
        replace(one, points=one.points @ turn.T + by, normals=one.normals @ turn.T) for one in given.touches
    ]
    before, after = hull_estimate(given).mesh, hull_estimate(evidence(*moved)).mesh
    volumes = [trimesh.Trimesh(mesh.vertices, mesh.faces).volume for mesh in (before, after)]
    # The mark under their middle does not turn with them: it is far inside.
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-9)


def test_contacts_in_one_place_bound_nothing_and_promise_little() -> None:
    side = np.array([1.0, 0.0, 0.0])
    near = [touch(k, np.array([0.05, 1e-4 * k, 0.05]), side) for k in range(6)]
    found = hull_estimate(evidence(*near))
    assert set(found.not_bounded) == {"x", "y", "z"}
    assert found.deviation.max() > 0.02
    assert np.isfinite(found.deviation).all()


def test_a_place_far_from_any_contact_is_known_worse() -> None:
    found = hull_estimate(cube(0.1))
    assert found.deviation[found.known_by == TOUCHED].max() < found.deviation.max()


def test_nothing_touched_is_refused_with_what_to_do_next() -> None:
    missed = replace(cube(0.1).touches[0], points=NOTHING, normals=NOTHING)
    with pytest.raises(FitRefused, match="press"):
        hull_estimate(evidence(missed))
    with pytest.raises(FitRefused, match="1 ways of the gel met nothing; check where"):
        known(evidence(missed))
