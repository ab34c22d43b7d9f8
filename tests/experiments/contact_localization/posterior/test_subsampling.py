"""What fills a grid stays within what each of its hypotheses stands for, and leaves none of that empty."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.spatial import cKDTree

from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.grid import between_samples
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray

SPACING = 2e-3
STEP = np.radians(2.0)
INDENTATION = 0.8e-3


def a_run(axis: FloatArray, observable: bool = True) -> Search:
    """Two contacts, the second of which carries the hypotheses, by a tool along ``axis``."""
    run = SimpleNamespace(
        prior=Prior(np.eye(3), "unknown"),
        positions=np.array([[0.0, 0.0, 0.0], [0.05, -0.02, 0.01]]),
        axes=np.array([[0.0, 0.0, -1.0], axis]),
        contacts=[SimpleNamespace(indentation=INDENTATION)] * 2,
        surface=SimpleNamespace(spacing=SPACING),
        yaw_step=STEP,
        yaw_observable=observable,
    )
    return cast(Search, run)


def places_of(run: Search, at: Hypotheses) -> FloatArray:
    """``(n, 3)`` where the second contact is, in the object's frame."""
    reach = run.positions[1] - INDENTATION * run.axes[1]
    return np.asarray(at.gels + run.prior.object_from_base(at.yaws) @ reach)


AXES = [np.array(a) / np.linalg.norm(a) for a in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, -0.9, 0.2))]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("copies", [2, 7, 16])
def test_copies_stay_where_their_hypothesis_stands_for(axis: FloatArray, copies: int) -> None:
    run, rng = a_run(axis), np.random.default_rng(0)
    at = Hypotheses(rng.normal(size=(50, 3)) * 0.1, rng.uniform(0.0, 6.0, 50), rng.normal(size=50))
    found = between_samples(run, 1, at, copies)
    parents = np.repeat(np.arange(50), copies)
    off = places_of(run, found) - places_of(run, at)[parents]
    tools = run.prior.object_from_base(found.yaws) @ axis
    assert np.sum(off * tools, axis=1) == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(off, axis=1).max() <= SPACING / np.sqrt(2.0) + 1e-12
    assert np.abs(found.yaws - at.yaws[parents]).max() <= 0.5 * STEP
    assert np.array_equal(found.log_weights, at.log_weights[parents])


def test_no_part_of_what_a_grid_stands_for_is_left_empty() -> None:
    """Of a square of samples: no place and yaw in it is farther from a copy than evenly spread ones allow."""
    run = a_run(np.array([0.0, 0.0, -1.0]))
    steps = SPACING * np.arange(6)
    gels = np.stack(np.meshgrid(steps, steps, [0.0]), axis=-1).reshape(-1, 3)
    at = Hypotheses(gels, np.zeros(len(gels)), np.zeros(len(gels)))
    found = between_samples(run, 1, at, 16)
    units = np.column_stack([places_of(run, found)[:, :2] / SPACING, found.yaws / STEP])
    middle = places_of(run, at)[:, :2].min(axis=0) / SPACING
    asked = np.random.default_rng(1).uniform(0.0, 1.0, (4000, 3)) * (5.0, 5.0, 1.0) - (0.0, 0.0, 0.5)
    asked[:, :2] += middle
    # Sixteen in a unit cube: each has a cube of side 0.4; twice its half diagonal is generous to no hole.
    assert np.max(cKDTree(units).query(asked)[0]) < 0.7


def test_a_yaw_that_nothing_shows_is_left_alone() -> None:
    run = a_run(np.array([0.0, 0.0, -1.0]), observable=False)
    at = Hypotheses(np.zeros((3, 3)), np.array([0.0, 0.1, 0.2]), np.zeros(3))
    assert np.array_equal(between_samples(run, 1, at, 4).yaws, np.repeat(at.yaws, 4))
