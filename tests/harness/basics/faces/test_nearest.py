"""The nearest point of a mesh: on it, and nearer than any other point of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest_surface import nearest_point
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import random_points
from tests.samples.synthetic_press import box, stepped_block

HALF = np.array([0.03, 0.02, 0.01])
BOX = box(*(2.0 * HALF))
BLOCK = stepped_block()
DENSE = random_points(BLOCK, 20_000, np.random.default_rng(0))[0]
POSE = transform(rotation_from_vector(np.array([0.6, -1.2, 0.3])), np.array([0.3, -0.2, 0.5]))

places = st.lists(st.floats(-0.06, 0.06), min_size=3, max_size=3).map(np.array)


@given(place=places)
@settings(max_examples=80, deadline=None)
def test_of_a_box_it_is_the_known_one(place: FloatArray) -> None:
    """Outside, the place clipped to the box; inside, the foot on the nearest face."""
    gap = np.linalg.norm(place - nearest_point(BOX, place))
    outside = np.linalg.norm(np.maximum(np.abs(place) - HALF, 0.0))
    inside = max(0.0, float(np.min(HALF - np.abs(place))))
    assert gap == pytest.approx(outside + inside, abs=1e-12)


@given(place=places)
@settings(max_examples=60, deadline=None)
def test_no_other_point_of_the_surface_is_nearer(place: FloatArray) -> None:
    found = nearest_point(BLOCK, place)
    assert np.linalg.norm(place - found) <= np.linalg.norm(DENSE - place, axis=1).min() + 1e-12
    assert nearest_point(BLOCK, found) == pytest.approx(found, abs=1e-12)


@given(place=places)
@settings(max_examples=20, deadline=None)
def test_moving_mesh_and_place_moves_it_along(place: FloatArray) -> None:
    moved = Mesh(apply(POSE, BLOCK.vertices), BLOCK.faces)
    there = nearest_point(moved, apply(POSE, place[None])[0])
    gap = np.linalg.norm(place - nearest_point(BLOCK, place))
    assert np.linalg.norm(apply(POSE, place[None])[0] - there) == pytest.approx(gap, abs=1e-12)


def test_a_face_without_area_is_no_trap() -> None:
    """A sliver whose corners lie in one point still has a nearest point."""
    degenerate = Mesh(np.vstack([BOX.vertices, [[0.2, 0.0, 0.0]]]), np.vstack([BOX.faces, [[8, 8, 8]]]))
    assert nearest_point(degenerate, np.array([0.19, 0.0, 0.0])) == pytest.approx([0.2, 0.0, 0.0])
    assert nearest_point(degenerate, np.array([0.05, 0.0, 0.0])) == pytest.approx([0.03, 0.0, 0.0])
