"""Baselines of the shape table: closed bodies that state how well they are known, worse than touch."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from experiments.paper.shape_baselines import (
    _RATE,
    _READING,
    _with_deviation,
    by_average,
    by_hull,
    by_visual_hull,
    glance_points,
    interpolate,
)
from experiments.paper.shape_table import points_error
from experiments.shape_reconstruction.fits import UNOBSERVED
from experiments.shape_reconstruction.metric import shape_error
from experiments.shape_reconstruction.smooth.free_space import (
    all_samples,
    beyond_deviation,
    known_by,
    limited_sides,
)
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from harness.basics.errors import FitRefused
from harness.basics.faces.mesh_rays import is_inside
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.smooth.test_knowledge import touched
from tests.experiments.shape_reconstruction.smooth.test_rbf import BOTH, LOOK, MUG, TOUCHES, require_whole
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, touch_of


@pytest.mark.parametrize("count", [4, 32])
def test_a_hull_is_a_closed_body_and_needs_contacts_out_of_one_plane(count: int) -> None:
    require_whole(by_hull(evidence_of(TOUCHES[:count])))
    up = np.array([0.0, 0.0, 1.0])
    points = np.random.default_rng(0).normal(size=(9, 3)) * [5e-3, 5e-3, 0.0]
    with pytest.raises(FitRefused, match=r"9 contact.*plane"):
        by_hull(evidence_of((touch_of(points, up, np.tile(up, (9, 1)), 0),)))
    with pytest.raises(FitRefused, match="0 touches"):
        by_hull(evidence_of((), LOOK))


def test_a_hull_too_thin_for_its_grid_is_refused_by_what_was_touched() -> None:
    y, z = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.1, 8), np.linspace(0.01, 0.1, 8)))
    sides = []
    for k, side in enumerate((1.0, -1.0)):
        normal = np.array([side, 0.0, 0.0])
        points = np.column_stack([np.full(y.size, 0.2e-3 * side), y, z])
        sides.append(touch_of(points, normal, np.repeat(normal[None], y.size, axis=0), k))
    with pytest.raises(FitRefused, match=r"2 contacts .*4 mm"):
        by_hull(evidence_of(tuple(sides)))


def test_the_surface_through_contacts_is_better_than_their_hull() -> None:
    evidence = evidence_of(TOUCHES)
    ours = shape_error(fit_rbf(evidence).mesh, MUG, samples=4000)
    assert ours.chamfer < shape_error(by_hull(evidence).mesh, MUG, samples=4000).chamfer


def test_the_visual_hull_holds_what_is_seen_and_does_not_know_how_deep_it_is() -> None:
    answer = by_visual_hull(evidence_of((), LOOK))
    require_whole(answer)
    within = is_inside(0.95 * MUG.vertices[::40] + [0.0, 0.0, 0.002], answer.mesh.corners)
    assert float(within.mean()) > 0.75
    assert "x" in answer.not_bounded  # the camera looks along it
    assert "y" not in answer.not_bounded
    with pytest.raises(FitRefused, match="picture"):
        by_visual_hull(evidence_of((), replace(LOOK, mask=np.zeros_like(LOOK.mask))))


def test_the_average_shape_looks_at_nothing_and_is_worse_than_touch() -> None:
    answer = by_average(evidence_of(()))
    require_whole(answer)
    assert np.array_equal(answer.mesh.vertices, by_average(BOTH).mesh.vertices)
    assert answer.not_bounded == ("x", "y", "z")
    touched = shape_error(fit_rbf(evidence_of(TOUCHES[:8])).mesh, MUG, samples=3000).chamfer
    assert shape_error(answer.mesh, MUG, samples=3000).chamfer > touched


@pytest.mark.parametrize("name", ["mug", "plate", "wrench"])
def test_points_of_the_prior_are_nearer_than_a_centimetre(name: str) -> None:
    mesh = build(name, 6e-3)
    assert points_error(glance_points(evidence_of((), look_at(mesh))), mesh, 3000).chamfer < 10e-3


def test_points_between_neighbours_lie_on_the_surface_to_second_order_and_fill_its_gaps() -> None:
    sphere = np.random.default_rng(0).normal(size=(16_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    off, gaps = [], []
    for count in (500, 4000):
        points = interpolate(sphere[:count], 8)
        assert points.shape == (9 * count, 3)
        np.testing.assert_array_equal(points[:count], sphere[:count])
        off.append(np.abs(np.linalg.norm(points, axis=1) - 1.0).mean())
        gaps.append([np.mean(cKDTree(some).query(sphere)[0]) for some in (sphere[:count], points)])
    assert off[1] == pytest.approx(off[0] / 8.0, rel=0.2)  # eight times as many: the square of the spacing
    assert all(after < 0.7 * before for before, after in gaps)


def test_a_plain_body_is_as_unsure_as_it_is_far_from_contacts_and_as_its_open_sides_leave_it() -> None:
    top, up = float(MUG.bounds[1, 2]), np.array([0.0, 0.0, 1.0])
    evidence = touched((np.array([0.0, 0.0, top]), up))
    samples = all_samples(evidence)
    found = _with_deviation(evidence, samples, None, MUG, "box", 0.0)
    far = np.linalg.norm(MUG.vertices[:, None] - samples.points[None], axis=2).min(axis=1)
    known, sides = known_by(MUG, samples, None), limited_sides(MUG, samples, None)
    beyond = beyond_deviation(MUG, known, sides, evidence.largest)
    assert beyond.max() > 40e-3  # x and y may reach as far as the stated size
    np.testing.assert_allclose(found.deviation**2, (_RATE * far) ** 2 + _READING**2 + beyond**2, rtol=1e-9)
    bounded = replace(evidence, largest=1e-3)
    sure = _with_deviation(bounded, samples, None, MUG, "box", 0.0).deviation
    open_side = (known == UNOBSERVED) & (MUG.vertex_normals[:, 0] > 0.9)
    assert (found.deviation[open_side] > 2.0 * sure[open_side]).all()
    touched_there = far < 1e-3
    assert sure[touched_there] == pytest.approx(_READING, rel=0.2)
