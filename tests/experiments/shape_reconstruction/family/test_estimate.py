"""The estimate's promises: finite, closed, convergent, and honest where nothing limits the object."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.contact_fit import ContactFit, displacement
from experiments.shape_reconstruction.family.estimate import _flags, _outliers, fit_family
from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.posterior import Mixture
from experiments.shape_reconstruction.family.search import LEVELS
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, UNOBSERVED, FamilyFit, ShapeEstimate
from experiments.shape_reconstruction.metric import shape_error
from experiments.shape_reconstruction.thresholds import (
    BLIND_FACTOR,
    MAX_NUISANCE_COST,
    MIN_DEVIATION,
    POOR_CONTACT_COST,
)
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.support.shape_readings import look_at, shape_readings, touch_at, touches_on

COARSE = replace(LEVELS["coarse"], draws=210)


@pytest.fixture(scope="module")
def can() -> Mesh:
    """A cylinder of 66 mm by 90 mm, off its nominal place: in the family, and no class was made for it."""
    made = trimesh.creation.cylinder(0.033, 0.09, sections=96).subdivide_to_size(3e-3)
    return Mesh(np.asarray(made.vertices) + np.array([0.01, -0.004, 0.045]), made.faces)


@pytest.fixture(scope="module")
def readings(can: Mesh) -> ShapeEvidence:
    return shape_readings(touches_on(can, 8, seed=2), look_at(can))


@pytest.fixture(scope="module")
def estimate(readings: ShapeEvidence) -> FamilyFit:
    return fit_family(readings, COARSE)


def require_sound(found: ShapeEstimate) -> None:
    """Finite everywhere, and every edge is shared by two faces."""
    count = len(found.mesh.vertices)
    assert np.isfinite(found.mesh.vertices).all()
    assert found.deviation.shape == (count,)
    assert np.isfinite(found.deviation).all()
    assert (found.deviation > 0.0).all()
    assert found.known_by.shape == (count,)
    assert set(np.unique(found.known_by)) <= {UNOBSERVED, SEEN, TOUCHED}
    edges = np.sort(found.mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_a_can_is_found_by_eight_touches_and_a_picture(estimate: FamilyFit, can: Mesh) -> None:
    require_sound(estimate)
    assert shape_error(estimate.mesh, can, samples=3000).chamfer < 2e-3
    assert estimate.not_bounded == ()
    assert not estimate.doubtful


def test_the_same_seed_gives_the_same_answer(estimate: FamilyFit, readings: ShapeEvidence) -> None:
    again = fit_family(readings, COARSE)
    np.testing.assert_array_equal(again.mesh.vertices, estimate.mesh.vertices)
    np.testing.assert_array_equal(again.deviation, estimate.deviation)


def test_a_can_that_leans_says_so(estimate: FamilyFit, can: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its contacts fit, on a support that would have to be tilted by eight of its standard deviations."""
    turn = trimesh.transformations.rotation_matrix(np.radians(8.0), [0.0, 1.0, 0.0])[:3, :3]  # type: ignore[no-untyped-call]
    leaning = can.vertices @ turn.T
    leaning[:, 2] -= leaning[:, 2].min()
    mesh = Mesh(leaning, can.faces)
    monkeypatch.setattr(
        "experiments.shape_reconstruction.family.estimate.not_bounded",
        lambda _evidence, _mesh, outside: ("y",) if outside else (),
    )
    found = fit_family(shape_readings(touches_on(mesh, 16, seed=2), look_at(mesh)), COARSE)
    assert found.not_bounded == ("y",), "no class limits what no reading does"
    assert found.nuisance.cost > MAX_NUISANCE_COST > 2.0 * estimate.nuisance.cost
    assert found.contact_cost < POOR_CONTACT_COST
    (said,) = [flag for flag in found.flags if "standard deviations" in flag]
    assert said.startswith("outside the family: such a shape fits with its upright off by")
    assert not [flag for flag in estimate.flags if "standard deviations" in flag]


def test_a_search_that_begins_at_an_earlier_answer_is_no_worse(
    estimate: FamilyFit, readings: ShapeEvidence
) -> None:
    few = replace(COARSE, draws=42, seed=5)
    alone, seeded = fit_family(readings, few), fit_family(readings, few, seeds=estimate.mixture.hypotheses)
    assert seeded.mixture.best.cost <= alone.mixture.best.cost + 1e-9


def test_where_the_gel_pressed_counts_as_touched(estimate: FamilyFit, readings: ShapeEvidence) -> None:
    points = readings.contacts[0].points
    gaps = np.linalg.norm(estimate.mesh.vertices[:, None] - points[:1], axis=2).min(axis=1)
    assert (estimate.known_by[gaps < 3e-3] == TOUCHED).all()
    assert (estimate.known_by == SEEN).any()


def test_all_presses_in_one_place_leave_the_object_unbounded(can: Mesh) -> None:
    side = np.array([0.043, -0.004, 0.05])
    touches = tuple(touch_at(can, side, np.array([1.0, 0.0, 0.0]), k) for k in range(4))
    found = fit_family(shape_readings(touches, None), COARSE)
    require_sound(found)
    assert found.not_bounded == ("x", "y", "z")
    far = np.linalg.norm(found.mesh.vertices - side, axis=1) > 40e-3
    near = np.linalg.norm(found.mesh.vertices - side, axis=1) < 8e-3
    assert near.any()
    assert np.median(found.deviation[far]) > 5e-3
    assert np.median(found.deviation[near]) < np.median(found.deviation[far])


def test_a_picture_alone_gives_a_closed_shape_and_a_wide_deviation(
    readings: ShapeEvidence, estimate: FamilyFit
) -> None:
    found = fit_family(replace(readings, touches=()), COARSE)
    require_sound(found)
    assert np.median(found.deviation) > np.median(estimate.deviation)


def test_what_the_object_stands_on_is_less_sure_than_its_side(estimate: FamilyFit) -> None:
    mesh = estimate.mesh
    under = (mesh.vertex_normals[:, 2] < -0.9) & (mesh.vertices[:, 2] < 4e-3)
    side = np.abs(mesh.vertices[:, 2] - 0.045) < 0.02
    assert under.any()
    assert estimate.deviation[under].min() > 1.5e-3
    assert np.median(estimate.deviation[side]) < estimate.deviation[under].min()


def test_without_a_picture_no_place_is_as_sure_as_with_one(readings: ShapeEvidence) -> None:
    touched = fit_family(replace(readings, look=None), COARSE)
    assert touched.deviation.min() > BLIND_FACTOR * MIN_DEVIATION


def test_a_blank_picture_is_no_reading(readings: ShapeEvidence) -> None:
    assert readings.look is not None
    blank = replace(readings.look, mask=np.zeros_like(readings.look.mask))
    with_it = fit_family(replace(readings, look=blank), COARSE)
    without = fit_family(replace(readings, look=None), COARSE)
    np.testing.assert_array_equal(with_it.mesh.vertices, without.mesh.vertices)


def test_nothing_read_is_refused(readings: ShapeEvidence) -> None:
    with pytest.raises(OutOfDomain, match=r"0 touches.*silhouette"):
        fit_family(replace(readings, touches=(), look=None), COARSE)


def test_a_body_of_no_class_is_said_to_be_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "experiments.shape_reconstruction.family.estimate.not_bounded",
        lambda _evidence, _mesh, outside: ("y",) if outside else (),
    )

    arms = [trimesh.creation.box((0.12, 0.02, 0.1)), trimesh.creation.box((0.02, 0.12, 0.1))]
    cross = trimesh.boolean.union(arms, engine="manifold").subdivide_to_size(4e-3)
    mesh = Mesh(np.asarray(cross.vertices) + np.array([0.0, 0.0, 0.05]), cross.faces)
    found = fit_family(shape_readings(touches_on(mesh, 14, seed=0), look_at(mesh)), COARSE)
    require_sound(found)
    assert any("outside the family" in flag for flag in found.flags)
    assert found.contact_cost > POOR_CONTACT_COST
    assert found.not_bounded == ("y",), "no class limits what no reading does"


def test_a_thin_board_that_stands_keeps_its_two_sides_apart() -> None:
    made = trimesh.creation.box((0.12, 0.004, 0.1)).subdivide_to_size(4e-3)
    board = Mesh(np.asarray(made.vertices) + np.array([0.0, 0.0, 0.05]), made.faces)
    found = fit_family(shape_readings(touches_on(board, 8, seed=0), look_at(board)), COARSE)
    require_sound(found)
    assert shape_error(found.mesh, board, samples=3000).chamfer < 5e-3


def test_displacements_meet_their_places_and_die_away() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    offsets = np.array([[0.0, 0.0, 2e-3], [1e-3, 0.0, 0.0]])
    sigma = np.full(2, 1e-6)
    np.testing.assert_allclose(displacement(places, offsets, sigma, places), offsets, atol=1e-8)
    assert np.abs(displacement(places, offsets, sigma, places + np.array([0.0, 0.3, 0.0]))).max() < 1e-9
    assert displacement(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), places).tolist() == [[0.0] * 3] * 2


def test_a_mug_s_handle_is_in_the_answer() -> None:
    mug = build("mug", 4e-3)
    found = fit_family(shape_readings(touches_on(mug, 10, seed=0), look_at(mug)), LEVELS["coarse"])
    require_sound(found)
    assert shape_error(found.mesh, mug, samples=3000).chamfer < 4e-3


def test_a_picture_alone_does_not_bound_what_is_along_the_line_of_sight() -> None:
    mug = build("mug")
    look = look_at(mug)
    found = fit_family(shape_readings((), look), COARSE)
    sight = np.abs(look.stand_from_camera[:3, 2])
    assert found.not_bounded == tuple(name for name, share in zip("xyz", sight, strict=True) if share > 0.5)
    assert found.not_bounded
    assert any("picture alone" in flag for flag in found.flags)
    towards = found.mesh.vertex_normals @ look.stand_from_camera[:3, 2]
    behind = (towards > 0.7) & (found.known_by == 0)
    assert found.deviation[behind].mean() > 10.0e-3


def test_a_body_that_is_off_alike_is_moved_between_its_contacts_too() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.06, 0.0, 0.0]])
    offsets, sigma = np.tile([2e-3, 0.0, 0.0], (2, 1)), np.full(2, 1e-6)
    between = np.array([[0.03, 0.0, 0.0]])
    near = displacement(places, offsets, sigma, between)[0, 0]
    both = displacement(places, offsets, sigma, between, far=4e-3)[0, 0]
    assert near < 0.7e-3
    assert both > 1.4e-3


@pytest.mark.parametrize(
    ("count", "doubtful", "rejected"), [(8, 1, 1), (8, 3, 0), (32, 4, 4), (6, 1, 0), (0, 0, 0)]
)
def test_few_contacts_that_do_not_fit_are_outliers_and_many_are_not(
    count: int, doubtful: int, rejected: int
) -> None:
    fit = ContactFit(np.ones(count), np.zeros(count), np.arange(count) < doubtful, 0.0)
    assert _outliers(fit).sum() == rejected


@pytest.mark.parametrize(
    ("doubtful", "finer", "reason", "hint"),
    [
        (0, True, "", False),
        (1, True, r"rejected as outliers: 0 \(4.0 mm\), where the others fit to 0.3 mm", False),
        (3, True, r"0 \(4.0 mm\), 1 \(4.0 mm\), 2 \(4.0 mm\); they are too many to have slipped", True),
        (3, False, "too many to have slipped and all count", False),
    ],
)
def test_a_contact_that_does_not_fit_is_named_with_the_reason(
    doubtful: int, finer: bool, reason: str, hint: bool
) -> None:
    bad = np.arange(8) < doubtful
    fit = ContactFit(np.ones(8), np.where(bad, 4e-3, 0.3e-3), bad, 0.0)
    evidence = cast(ShapeEvidence, SimpleNamespace(contacts=[SimpleNamespace(index=k) for k in range(8)]))
    mixture, settings = cast(Mixture, SimpleNamespace(by_class=dict)), LEVELS["coarse" if finer else "fine"]
    flags = " ".join(_flags(evidence, mixture, fit, NuisanceCost(0.0, ""), np.zeros(8), settings))
    assert re.search(reason, flags)
    assert bool(flags) == (doubtful > 0)
    assert ("shape.method=family-fine" in flags) == hint
