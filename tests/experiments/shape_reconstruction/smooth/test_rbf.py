"""The surface through contacts: laws that any answer obeys, and the cases in which it must not be sure."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.evidence import GuardedTouch
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, UNOBSERVED, ShapeEstimate
from experiments.shape_reconstruction.metric import shape_error
from experiments.shape_reconstruction.smooth.free_space import (
    CLEARANCE,
    Silhouette,
    all_samples,
    sensor_depth,
    thinned,
)
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.smooth.revolution import find_revolution
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import apply, inverse, rotation_about, transform
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses, touch_of

MUG = build("mug", 5e-3)
TOUCHES = presses(MUG, 32, seed=3)
LOOK = look_at(MUG)
BOTH = evidence_of(TOUCHES, LOOK)


def require_whole(estimate: ShapeEstimate) -> None:
    mesh = estimate.mesh
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert body.is_watertight
    assert body.volume > 0.0
    assert np.isfinite(mesh.vertices).all()
    assert np.isfinite(estimate.deviation).all()
    assert (estimate.deviation > 0.0).all()
    assert len(estimate.deviation) == len(estimate.known_by) == len(mesh.vertices)
    assert set(np.unique(estimate.known_by)) <= {UNOBSERVED, SEEN, TOUCHED}


def moved(touch: GuardedTouch, pose: FloatArray) -> GuardedTouch:
    return replace(
        touch,
        stand_from_gel=pose @ touch.stand_from_gel,
        points=apply(pose, touch.points),
        normals=touch.normals @ pose[:3, :3].T,
    )


@pytest.mark.parametrize("count", [1, 4, 32])
@pytest.mark.parametrize("seen", [False, True])
def test_every_answer_is_a_closed_body_that_says_how_well_it_is_known(count: int, seen: bool) -> None:
    require_whole(fit_rbf(evidence_of(TOUCHES[:count], LOOK if seen else None)))


def test_more_contacts_are_better_and_touched_places_are_known_best() -> None:
    few, many = fit_rbf(evidence_of(TOUCHES[:6])), fit_rbf(evidence_of(TOUCHES))
    errors = [shape_error(one.mesh, MUG, samples=4000).chamfer for one in (few, many)]
    assert errors[1] < errors[0]
    touched = many.known_by == TOUCHED
    assert np.median(many.deviation[touched]) < np.median(many.deviation[~touched])
    assert (few.known_by == TOUCHED).mean() < touched.mean()


def test_the_answer_turns_and_moves_with_the_readings() -> None:
    pose = transform(rotation_about(np.array([0.0, 0.0, 1.0]), 0.7), np.array([0.02, -0.01, 0.0]))
    turned = evidence_of(tuple(moved(touch, pose) for touch in TOUCHES))
    one, other = fit_rbf(evidence_of(TOUCHES)), fit_rbf(turned)
    back = Mesh(apply(inverse(pose), other.mesh.vertices), other.mesh.faces)
    assert shape_error(one.mesh, back, samples=3000).chamfer < 1.5e-3  # a fraction of the grid's pitch


def test_the_order_of_touches_changes_little_and_single_precision_nothing() -> None:
    one = fit_rbf(BOTH).mesh
    again = fit_rbf(replace(BOTH, touches=TOUCHES[::-1])).mesh
    assert shape_error(one, again, samples=3000).chamfer < 1.0e-3
    rounded = tuple(
        replace(touch, points=touch.points.astype(np.float32).astype(np.float64)) for touch in TOUCHES
    )
    same = fit_rbf(replace(BOTH, touches=rounded)).mesh
    assert shape_error(one, same, samples=3000).chamfer < 0.2e-3


def test_nothing_of_the_answer_is_where_the_sensor_was_or_beside_the_silhouette() -> None:
    missed = touch_of(np.zeros((1, 3)), np.array([0.0, 0.0, 1.0]), np.zeros((1, 3)), 99)
    pose = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.05]))
    missed = replace(missed, stand_from_gel=pose, points=np.zeros((0, 3)), normals=np.zeros((0, 3)))
    evidence = replace(BOTH, touches=(*TOUCHES, missed))
    mesh = fit_rbf(evidence).mesh
    assert float(sensor_depth(evidence, mesh.vertices).max()) < CLEARANCE + 2.0e-3
    silhouette = Silhouette.of(LOOK, all_samples(evidence).points)
    assert float(silhouette.outside_metres(mesh.vertices).max()) < 3.5e-3


def test_presses_all_in_one_place_bound_nothing_and_say_so() -> None:
    answer = fit_rbf(evidence_of(tuple(replace(TOUCHES[0], index=k) for k in range(6))))
    require_whole(answer)
    assert len(answer.not_bounded) >= 2
    supposed = answer.known_by == UNOBSERVED
    assert float(answer.deviation[supposed].max()) > 0.03
    assert fit_rbf(evidence_of(TOUCHES)).not_bounded == ()


def test_a_blank_picture_is_no_picture() -> None:
    blank = replace(LOOK, mask=np.zeros_like(LOOK.mask))
    with_it, without = fit_rbf(evidence_of(TOUCHES[:8], blank)), fit_rbf(evidence_of(TOUCHES[:8]))
    assert with_it.mesh.vertices == pytest.approx(without.mesh.vertices)


def test_without_a_contact_there_is_no_answer_by_touch() -> None:
    with pytest.raises(FitRefused, match="0 touches"):
        fit_rbf(evidence_of((), LOOK))


def test_a_slipped_contact_is_named_with_about_how_far_it_is_off() -> None:
    slip = TOUCHES[4]
    normal = slip.normals.mean(axis=0)
    wrong = replace(slip, points=slip.points - 0.012 * normal / np.linalg.norm(normal))
    dense = presses(MUG, 60, seed=11)
    answer = fit_rbf(evidence_of((*dense, replace(wrong, index=77))))
    assert answer.doubtful.get(77, 0.0) > 6e-3


def test_contacts_of_a_round_body_find_its_axis_and_those_of_a_box_do_not() -> None:
    found = find_revolution(thinned(all_samples(evidence_of(TOUCHES))))
    assert found is not None
    centre = MUG.vertices[np.abs(MUG.vertices[:, 2] - 0.06) < 3e-3]
    rim = centre[centre[:, 0] < 0.5 * (centre[:, 0].min() + centre[:, 0].max())]
    radius = np.linalg.norm(rim[:, :2] - found.centre, axis=1)
    assert float(np.ptp(radius)) < 0.012  # both faces of the wall, about one axis
    tray = evidence_of(presses(build("tray", 6e-3), 32, seed=2))
    assert find_revolution(thinned(all_samples(tray))) is None
    wrench = evidence_of(presses(build("wrench", 6e-3), 32, seed=2))
    assert find_revolution(thinned(all_samples(wrench))) is None


@pytest.mark.parametrize(("around", "found"), [(0.8 * np.pi, False), (1.4 * np.pi, True)])
def test_places_on_one_side_of_an_axis_do_not_show_it(around: float, found: bool) -> None:
    """A rounded corner is part of a circle as well."""
    touches = []
    for k, angle in enumerate(np.linspace(0.0, around, 14)):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        across = np.array([-out[1], out[0], 0.0])
        middle = 0.05 * out + np.array([0.0, 0.0, 0.02 + 0.005 * (k % 4)])
        points = middle + np.array([[0.0], [3e-3], [-3e-3]]) * np.array([[0.0, 0.0, 1.0]])
        points = np.concatenate([points, points + 1e-3 * across])
        touches.append(touch_of(points, out, np.repeat(out[None], len(points), axis=0), k))
    axis = find_revolution(thinned(all_samples(evidence_of(tuple(touches)))))
    assert (axis is not None) == found
    if axis is not None:
        assert np.linalg.norm(axis.centre) < 2e-3


def test_a_round_body_s_axis_brings_its_surface_to_where_nothing_was_touched() -> None:
    """Half of it was touched; the other half is as the axis says."""
    body = build("bowl", 6e-3)
    middle = 0.5 * (body.vertices.min(axis=0) + body.vertices.max(axis=0))
    half = tuple(touch for touch in presses(body, 60, seed=5) if touch.points[:, 0].mean() > middle[0] - 0.01)
    evidence = evidence_of(half)
    found = find_revolution(thinned(all_samples(evidence)))
    assert found is not None
    assert np.abs(found.centre - middle[:2]).max() < 6e-3
    with_axis, without = (shape_error(fit_rbf(evidence, each).mesh, body) for each in (True, False))
    assert with_axis.completeness < 0.6 * without.completeness


def test_a_top_that_nobody_touched_may_be_a_mouth_and_is_not_sure() -> None:
    bowl = build("bowl", 6e-3)
    outside = tuple(touch for touch in presses(bowl, 60, seed=2) if touch.normals[:, 2].mean() < 0.3)
    answer = fit_rbf(evidence_of(outside))
    assert any("hollow" in flag for flag in answer.flags)
    top = (answer.mesh.vertex_normals[:, 2] > 0.8) & (answer.mesh.vertices[:, 2] > 0.04)
    assert float(np.median(answer.deviation[top])) > 0.02
    made = trimesh.creation.box((0.07, 0.07, 0.06)).subdivide().subdivide()
    block = Mesh(made.vertices + np.array([0.0, 0.0, 0.03]), made.faces)
    assert fit_rbf(evidence_of(presses(block, 60, seed=2))).flags == ()
