"""Tests of the stated knowledge of a plain answer and of its unlimited extents."""

from itertools import product

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.smooth.free_space import (
    all_samples,
    limited_sides,
    not_bounded,
)
from harness.basics.arrays import FloatArray
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, touch_of

MUG = build("mug", 5e-3)


def touched(*places: tuple[FloatArray, FloatArray]) -> ShapeEvidence:
    across = 1e-3 * np.random.default_rng(0).normal(size=(9, 3))
    return evidence_of(
        tuple(
            touch_of(at + across, normal, np.tile(normal, (9, 1)), k) for k, (at, normal) in enumerate(places)
        )
    )


@pytest.mark.parametrize("limited", list(product((True, False), repeat=2)))
@pytest.mark.parametrize("axis", range(3))
def test_an_axis_is_bounded_where_both_of_its_sides_are(axis: int, limited: tuple[bool, bool]) -> None:
    sides = {(name, sign): True for name in "xyz" for sign in (-1, 1)}
    sides["xyz"[axis], -1], sides["xyz"[axis], 1] = limited
    assert not_bounded(sides) == (() if all(limited) else ("xyz"[axis],))


@pytest.mark.parametrize("signs", [(), (1,), (-1,), (-1, 1)])
def test_contacts_at_both_ends_bound_an_axis(signs: tuple[int, ...]) -> None:
    up, high = np.array([0.0, 0.0, 1.0]), float(MUG.bounds[1, 2])
    sides = [
        (np.array([MUG.bounds[max(sign, 0), 0], 0.0, 0.5 * high]), sign * np.eye(3)[0]) for sign in signs
    ]
    evidence = touched((np.array([0.0, 0.0, high]), up), *sides)
    found = not_bounded(limited_sides(MUG, all_samples(evidence), None))
    assert found == (("y",) if len(signs) == 2 else ("x", "y"))
