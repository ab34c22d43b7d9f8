"""Laws of ways that the housing ended: the shape touches the housing's face, and does not keep off it."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.contact_rows import contact_row_count, nearest_on_face
from experiments.shape_reconstruction.family.distance import distances, prepare
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.observed import HOUSING_FACTOR, MODEL, observe
from experiments.shape_reconstruction.family.residuals import (
    active_rows,
    evaluate,
    fill_frozen,
    hold_rays,
    make_rows,
    prepared_buffer,
)
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing
from tests.support.family_readings import ended_at
from tests.support.family_shapes import SHAPES, drawn, surface_of


def faces_around(middle: FloatArray, count: int, seed: int) -> list[FloatArray]:
    """Rectangles of a housing's size anywhere near a place."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        away = random.standard_normal(3)
        frame = frame_facing(away / np.linalg.norm(away), random.uniform(0.0, 6.0))
        found.append(np.array([middle + 0.04 * away, 0.5 * 34e-3 * frame[:, 0], 0.5 * 30e-3 * frame[:, 1]]))
    return found


@pytest.mark.parametrize("name", SHAPES)
def test_the_nearest_place_of_a_face_is_that_of_all_its_places(name: str) -> None:
    shape = drawn(name)
    q, place = prepared_buffer(), np.empty(3)
    prepare(shape.code, shape.theta, q)
    share = np.linspace(-1.0, 1.0, 41)
    a, b = (one.reshape(-1, 1) for one in np.meshgrid(share, share))
    off = []
    for face in faces_around(surface_of(shape).vertices.mean(axis=0), 60, seed=1):
        found = nearest_on_face(shape.code, q, face, place)
        every = distances(shape.code, shape.theta, face[0] + a * face[1] + b * face[2])
        assert found == pytest.approx(distances(shape.code, shape.theta, place[None])[0], abs=1e-12)
        off.append(found - every.min())
    assert np.quantile(np.abs(off), 0.9) < 0.6e-3  # the grid's own places are 0.8 mm apart
    assert np.max(off) < 4e-3  # where two places are as near, and the other was followed


def housing_rows(shape: FamilyShape, evidence: ShapeEvidence) -> FloatArray:
    """``(faces,)`` in standard deviations."""
    seen, q = observe(evidence), prepared_buffer()
    out = make_rows(seen)
    evaluate(shape.code, shape.theta, seen, False, out, q, np.inf)
    first = contact_row_count(seen)
    return out.values[first : first + len(seen.faces)].copy()


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("gap", [-3e-3, 0.0, 3e-3])
def test_a_shape_before_the_face_disagrees_as_one_within_it_does(name: str, gap: float) -> None:
    shape, evidence = ended_at(name, gap)
    sigma = HOUSING_FACTOR * np.hypot(evidence.touches[-1].sigma, MODEL)
    rows = housing_rows(shape, evidence) * sigma
    assert len(rows) == 3
    # Within a thin wall no place is as deep as the face went.
    assert np.all(np.abs(rows) < abs(gap) + 0.5e-3)
    assert np.all(rows > 0.6 * gap - 0.1e-3 if gap > 0.0 else rows < 0.5e-3)
    kept_off = replace(evidence, touches=tuple(replace(one, stopped=False) for one in evidence.touches))
    seen, loose = observe(evidence), observe(kept_off)
    q = prepared_buffer()
    cost = evaluate(shape.code, shape.theta, seen, False, make_rows(seen), q, np.inf)
    without = evaluate(shape.code, shape.theta, loose, False, make_rows(loose), q, np.inf)
    assert cost - without == pytest.approx(0.5 * np.sum((rows / sigma) ** 2))


def test_a_face_that_nothing_is_near_costs_no_more_than_in_proportion() -> None:
    shape, evidence = ended_at("mug", 0.05)
    far = housing_rows(shape, evidence)
    seen, q = observe(evidence), prepared_buffer()
    out = make_rows(seen)
    evaluate(shape.code, shape.theta, seen, False, out, q, np.inf)
    first = contact_row_count(seen)
    assert far.min() > 10.0
    assert np.all(out.weights[first : first + 3] * far <= 3.0 + 1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_a_face_is_held_where_it_is_met_and_moves_with_the_gel(name: str) -> None:
    shape, evidence = ended_at(name, 2e-3)
    seen, q = observe(evidence), prepared_buffer()
    theta = shape.theta.copy()
    theta[layout.GEL : layout.GEL + 3] = [0.4e-3, -0.3e-3, 0.6e-3]
    out = make_rows(seen)
    evaluate(shape.code, theta, seen, False, out, q, np.inf)
    rows, first = active_rows(seen, out.values), contact_row_count(seen)
    faces = (rows >= first) & (rows < first + len(seen.faces))
    assert faces.sum() == 3
    base, moved = np.empty(len(rows)), np.empty(len(rows))
    hold_rays(shape.code, theta, seen, rows, out, q)
    fill_frozen(shape.code, theta, seen, rows, out, False, q, base)
    np.testing.assert_allclose(base[faces], out.values[rows][faces], atol=1e-9)
    deeper = theta.copy()
    deeper[layout.GEL + 2] += 0.2e-3
    fill_frozen(shape.code, deeper, seen, rows, out, False, q, moved)
    nearer = (base - moved)[faces] * seen.face_sigma
    assert np.all(nearer > 0.05e-3)  # the sensor is farther on, so that the shape is nearer
    assert np.all(nearer < 0.2e-3 + 1e-9)


def test_draws_are_laid_without_the_faces() -> None:
    evidence = ended_at("mug", 0.0)[1]
    assert len(observe(evidence, coarse=True).faces) == 0
    assert len(observe(evidence).faces) == 3
