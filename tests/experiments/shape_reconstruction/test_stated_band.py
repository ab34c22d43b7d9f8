"""Whether stated deviations hold: a band as wide as the error holds it, a narrower one does not."""

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.fits import UNOBSERVED, ShapeEstimate
from experiments.shape_reconstruction.metric import BAND90, BandHeld, band_held, surfaces_apart
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh

RADIUS, OFF = 0.05, 2.0e-3
BALL = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
TRUTH = Mesh(BALL.vertices, BALL.faces)


def held(factors: FloatArray, deviation: FloatArray | float) -> BandHeld:
    """Of the ball with each vertex moved out by a factor."""
    mesh = Mesh(TRUTH.vertices * np.reshape(factors, (-1, 1)), TRUTH.faces)
    count = len(mesh.vertices)
    stated = np.broadcast_to(np.asarray(deviation), count).copy()
    estimate = ShapeEstimate(mesh, stated, np.full(count, UNOBSERVED), (), {}, (), 0.0, "test")
    return band_held(estimate, surfaces_apart(mesh, TRUTH, 3000))


def test_a_band_just_wider_than_the_error_holds_all_and_a_narrower_one_nothing() -> None:
    factor = np.array([1.0 + OFF / RADIUS])
    assert held(factor, 1.05 * OFF / BAND90) == BandHeld(1.0, 1.0)
    assert held(factor, 0.9 * OFF / BAND90) == BandHeld(0.0, 0.0)


def test_a_deviation_counts_where_it_is_stated() -> None:
    upper = TRUTH.vertices[:, 2] > 0.0
    factors = np.where(upper, 1.0 + OFF / RADIUS, 1.0)
    unsure = np.where(upper, 2.0 * OFF, 1e-5)
    assert min(vars(held(factors, unsure)).values()) > 0.95
    # Stated on the wrong half, the deviations hold where nothing is off.
    wrong = held(factors, unsure[::-1] if upper[0] == upper[-1] else np.where(upper, 1e-5, 2.0 * OFF))
    assert max(vars(wrong).values()) < 0.6


def test_honest_normal_errors_are_held_nine_times_in_ten() -> None:
    random = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
    off = OFF * random.normal(size=500)
    # Each patch of the ball is moved by one draw: vertices near each other err together.
    seeds = random.normal(size=(500, 3))
    nearest = np.argmax(mesh.vertices @ (seeds / np.linalg.norm(seeds, axis=1)[:, None]).T, axis=1)
    moved = mesh.vertices * (1.0 + off[nearest] / RADIUS)[:, None]
    count = len(moved)
    estimate = ShapeEstimate(
        Mesh(moved, mesh.faces), np.full(count, OFF), np.full(count, UNOBSERVED), (), {}, (), 0.0, "test"
    )
    share = band_held(estimate, surfaces_apart(estimate.mesh, TRUTH, 4000)).answer
    assert share == pytest.approx(0.9, abs=0.05)
