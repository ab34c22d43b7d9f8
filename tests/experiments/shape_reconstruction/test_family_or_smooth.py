"""A household shape where one fits, the smooth surface where none does: and the answer says which."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction import family_or_smooth
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import LEVELS, FamilySettings
from experiments.shape_reconstruction.family_or_smooth import (
    BESIDE,
    ENOUGH,
    MANY,
    by_family,
    deviations_apart,
)
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.support.shape_readings import look_at, shape_readings, touches_on


@pytest.fixture(scope="module")
def readings() -> ShapeEvidence:
    mesh = build("mug")
    return shape_readings(touches_on(mesh, MANY, seed=0), look_at(mesh))


@pytest.mark.parametrize(
    ("foreign", "beyond", "contacts", "sighted", "smooth"),
    [
        (True, 0.0, 8, True, True),
        (True, 0.0, 3, True, False),
        (False, 0.0, 8, True, False),
        (False, 0.02, MANY, False, True),  # presses would have met what is supposed beyond them
        (False, 0.02, MANY, True, False),  # the picture says that it is there
        (False, 0.02, 8, False, False),
        (False, 0.005, MANY, False, False),
    ],
)
def test_the_surface_is_smooth_where_no_class_fits_enough_contacts(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    foreign: bool,
    beyond: float,
    contacts: int,
    sighted: bool,
    smooth: bool,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts], look=readings.look if sighted else None)
    by_rbf = by_hermite(part, symmetric=False)
    fitted: ShapeEstimate = replace(
        by_rbf,
        mesh=_away(by_rbf.mesh, 0.1),
        details={"foreign": foreign, "beyond_m": beyond},
        not_bounded=("y",),
        doubtful={1: 0.004},
        flags=("off",),
    )
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    found = by_family(part)
    assert found.doubtful == {1: 0.004}
    assert found.flags[0] == "off"
    assert "y" in found.not_bounded
    if smooth:
        assert "by rbf" in found.flags[-1]
        assert set(by_rbf.not_bounded) <= set(found.not_bounded)
        np.testing.assert_array_equal(found.mesh.vertices, by_rbf.mesh.vertices)
    else:
        assert found.mesh is fitted.mesh
        # Contacts that could not have told say so.
        assert ("supposed" in " ".join(found.flags)) is (contacts < ENOUGH)


def test_without_a_contact_nothing_is_said_of_contacts(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = replace(readings, touches=readings.touches[:0])
    fitted = replace(
        by_hermite(readings, symmetric=False), details={"foreign": False, "beyond_m": 0.0}, flags=("off",)
    )
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    assert by_family(part).flags == ("off",)


@pytest.mark.parametrize(
    ("contacts", "first", "second", "answer"),
    [
        (8, "away", "fits", "search 1"),
        (8, "away", "away", "by rbf"),
        (8, "away", "beside", "search 1"),
        (8, "beside", "fits", "search 0"),  # what stands beside the smooth surface has the right form
        (8, "fits", "fits", "search 0"),
        (3, "away", "fits", "search 0"),  # too few contacts to tell that none fits
    ],
)
def test_where_no_class_fits_other_draws_are_searched_once_more(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    first: str,
    second: str,
    answer: str,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts])
    by_rbf, seeds = by_hermite(part, symmetric=False), list[int]()

    def searched(_: ShapeEvidence, settings: FamilySettings) -> ShapeEstimate:
        kind, turn = (first, second)[len(seeds)], len(seeds)
        seeds.append(settings.seed)
        details = {"foreign": kind != "fits", "beyond_m": 0.0}
        mesh = _away(by_rbf.mesh, 0.1) if kind == "away" else by_rbf.mesh
        return replace(by_rbf, mesh=mesh, details=details, flags=(f"search {turn}",), seconds=1.0)

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    found = by_family(part)
    assert answer in " ".join(found.flags)
    assert ("by rbf" in found.flags[-1]) is (answer == "by rbf")
    assert len(set(seeds)) == len(seeds)  # by draws of its own
    assert found.seconds >= len(seeds)  # the time of all is stated


@pytest.mark.parametrize(
    ("away", "sighted", "smooth"),
    [
        (0.5, True, False),
        (2.0, True, True),
        (0.5, False, True),  # nothing says how far the household shape may go on
    ],
)
def test_a_household_shape_that_the_smooth_surface_leaves_open_is_kept_though_it_fits_badly(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch, away: float, sighted: bool, smooth: bool
) -> None:
    part = replace(readings, look=readings.look if sighted else None)
    by_rbf = by_hermite(part, symmetric=False)
    # Along z by so many limits: some of the surface is only slid along itself, so that no shift is exact.
    height = by_rbf.mesh.vertices[:, 2].max()
    held = replace(by_rbf, deviation=np.full(len(by_rbf.mesh.vertices), height / BESIDE))
    fitted = replace(
        held,
        mesh=_away(held.mesh, away * height),
        details={"foreign": True, "beyond_m": 0.0},
        flags=(),
    )
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    monkeypatch.setattr(family_or_smooth, "by_hermite", lambda *_, **__: held)
    found = by_family(part)
    expected = held if smooth else fitted
    np.testing.assert_array_equal(found.mesh.vertices, expected.mesh.vertices)


def test_a_household_shape_that_is_kept_is_nowhere_less_sure_than_the_smooth_surface(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_rbf = by_hermite(readings, symmetric=False)
    random = np.random.default_rng(0)
    unsure = random.uniform(0.5, 2.0, len(by_rbf.mesh.vertices)) * by_rbf.deviation
    fitted = replace(by_rbf, deviation=unsure, details={"foreign": True, "beyond_m": 0.0})
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    found = by_family(readings)
    np.testing.assert_array_equal(found.deviation, np.minimum(unsure, by_rbf.deviation))


def test_two_surfaces_are_apart_by_their_distance_over_the_stated_deviation(
    readings: ShapeEvidence,
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    inner = Mesh(np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64))
    outer = Mesh(1.2 * inner.vertices, inner.faces)
    stated = replace(by_hermite(readings), mesh=inner, deviation=np.full(len(inner.vertices), 5.0e-3))
    # 10 mm apart; an icosphere of radius 50 mm has faces up to 0.1 mm within it.
    assert deviations_apart(replace(stated, mesh=outer), stated) == pytest.approx(2.0, abs=0.03)


def _away(mesh: Mesh, by: float) -> Mesh:
    """The same, farther along z by some m."""
    return Mesh(mesh.vertices + np.array([0.0, 0.0, by]), mesh.faces)


def test_contacts_of_no_object_at_all_are_foreign_to_the_family(readings: ShapeEvidence) -> None:
    random = np.random.default_rng(0)
    scattered = tuple(
        replace(touch, points=touch.points + random.uniform(-0.03, 0.03, 3), normals=-touch.normals)
        for touch in readings.touches[:8]
    )
    few = replace(LEVELS["coarse"], draws=42)
    assert family_estimate(replace(readings, touches=scattered), few).details["foreign"]
    right = replace(readings, touches=readings.touches[:8])
    assert not family_estimate(right, few).details["foreign"]
