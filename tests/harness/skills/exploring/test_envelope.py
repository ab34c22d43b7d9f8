"""The space that travels avoid holds all that is as near as its margin, in every direction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.skills.exploring.unknown_space import around

SUPPORT = 0.25
ROUNDOFF = 1e-12


def farthest_outside(space: Mesh, places: FloatArray) -> float:
    """M by which the worst of ``(n, 3)`` places leaves a convex space; negative where all are inside."""
    sides = ConvexHull(space.vertices).equations
    return float((places @ sides[:, :3].T + sides[:, 3]).max())


def thing(seed: int) -> FloatArray:
    """Some places of an object of 20 cm that stands on the support."""
    places = np.random.default_rng(seed).uniform(-0.1, 0.1, (12, 3))
    places[:, 2] += SUPPORT - places[:, 2].min()
    return places


def everywhere(seed: int) -> FloatArray:
    """``(n, 3)`` unit vectors all over the sphere."""
    ways = np.random.default_rng(seed).standard_normal((2000, 3))
    return np.asarray(ways / np.linalg.norm(ways, axis=1)[:, None])


@settings(max_examples=12)  # each of a million places
@given(seed=st.integers(0, 2**31), off=st.floats(0.0, 0.06), margin=st.floats(1e-3, 0.03))
def test_all_that_is_within_the_margin_is_inside_in_every_direction(
    seed: int, off: float, margin: float
) -> None:
    """Off along the support by the one length, and from there in any direction by the other."""
    places, ways = thing(seed), everywhere(seed)
    level = ways[:500, :2] / np.linalg.norm(ways[:500, :2], axis=1)[:, None]
    space = around(places, off, margin, SUPPORT)
    for place in places:
        moved = place + off * np.column_stack([level, np.zeros(len(level))])
        near = np.concatenate([place + margin * ways, *(moved[::50, None] + margin * ways[::20])])
        near[:, 2] = np.maximum(near[:, 2], SUPPORT)
        assert farthest_outside(space, near) < ROUNDOFF


def test_the_space_ends_at_the_support_and_is_no_wider_than_an_eighth_of_its_margin_more() -> None:
    places, ways = thing(3), everywhere(4)
    space = around(places, 0.0, 0.02, SUPPORT)
    assert space.vertices[:, 2].min() == pytest.approx(SUPPORT)
    wider = around(places, 0.0, 0.02 * 1.13, SUPPORT - 1.0)
    assert farthest_outside(wider, space.vertices) < ROUNDOFF
    reach = (space.vertices @ ways.T).max(axis=0) - (places @ ways.T).max(axis=0)
    assert reach.max() < 0.02 * 1.13
