"""The true object's surface: refined without cracks, deviating by as much as the gap says."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.mesh import Mesh
from mocks.world.gap_draw import ShapeDeviation, split_long_edges


def box_mesh(size: tuple[float, float, float]) -> Mesh:
    box = trimesh.creation.box(size)
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces))


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(0.01, 0.2)] * 3), st.floats(0.008, 0.05))
def test_splitting_keeps_the_surface_whole(size: tuple[float, float, float], longest: float) -> None:
    box = box_mesh(size)
    split = split_long_edges(box, longest)
    solid = trimesh.Trimesh(split.vertices, split.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume == pytest.approx(np.prod(size), rel=1e-9)
    edges = split.corners - np.roll(split.corners, 1, axis=1)
    assert np.linalg.norm(edges, axis=-1).max() <= longest * (1 + 1e-12)


def test_a_fine_mesh_is_left_alone() -> None:
    box = box_mesh((0.1, 0.1, 0.1))
    assert split_long_edges(box, 1.0).faces.tolist() == box.faces.tolist()


def test_a_deviation_has_the_stated_size_and_length() -> None:
    sigma, length = 0.25e-3, 25e-3
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (4000, 3))
    step = np.array([[length, 0.0, 0.0]])
    here, there = [], []
    for seed in range(6):
        field = ShapeDeviation.draw(1.0, np.zeros(3), sigma, length, np.random.default_rng(seed))
        here.append(field.applied(points) - points)
        there.append(field.applied(points + step) - points - step)
    a, b = np.concatenate(here), np.concatenate(there)
    assert np.std(a, axis=0) == pytest.approx([sigma] * 3, rel=0.1)
    # Squared exponential: a correlation of exp(-1/2) at one length.
    assert np.sum(a * b) / np.sum(a * a) == pytest.approx(np.exp(-0.5), abs=0.1)


def test_scale_alone_leaves_the_centre() -> None:
    centre = np.array([0.1, -0.2, 0.3])
    field = ShapeDeviation.draw(1.02, centre, 0.0, 25e-3, np.random.default_rng(0))
    assert np.allclose(field.applied(centre[None]), centre, atol=1e-15)
    assert np.allclose(field.applied(centre[None] + 1.0) - centre, 1.02)
