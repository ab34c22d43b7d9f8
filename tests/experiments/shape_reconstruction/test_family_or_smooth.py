"""A household shape where one fits, the smooth surface where none does: and the answer says which."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction import family_or_smooth
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import LOOSE, RIVAL, family_estimate
from experiments.shape_reconstruction.family.settings import CONTINUED, LEVELS, FamilySettings
from experiments.shape_reconstruction.family.strain import STRAINED
from experiments.shape_reconstruction.family_or_smooth import (
    BESIDE,
    BEYOND,
    ENOUGH,
    MANY,
    UNEASY,
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


def details_of(foreign: bool, beyond: float = 0.0, strain: float = 0.0) -> dict[str, object]:
    """What the family's estimate tells beside its surface."""
    typical = 3.0 * LOOSE if foreign else 0.1 * LOOSE
    return {
        "foreign": foreign, "beyond_m": beyond, "cost": 1.0, "contact_cost": typical, "strain": strain,
        "hypotheses": [], "classes": {"mug": 1.0},
    }  # fmt: skip


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
        details=details_of(foreign, beyond),
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


@pytest.mark.parametrize(
    ("contacts", "by", "foreign", "smooth"),
    [
        (8, 1.1, False, True),  # though its contacts fit
        (8, 1.1, True, True),  # though it is no farther from the smooth surface than it may be
        (8, 0.9, False, False),
        (ENOUGH - 1, 1.1, False, False),
    ],
)
def test_what_fits_only_on_a_bench_that_is_off_beyond_belief_is_no_household_shape(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    by: float,
    foreign: bool,
    smooth: bool,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts])
    by_rbf, made = by_hermite(part, symmetric=False), list[int]()

    def searched(_: ShapeEvidence, settings: FamilySettings, previous: object = ()) -> ShapeEstimate:
        made.append(settings.seed)
        return replace(by_rbf, details=details_of(foreign, strain=by * STRAINED), flags=())

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    assert ("by rbf" in " ".join(by_family(part).flags)) is smooth
    assert len(made) == (1 if by < 1.0 else family_or_smooth.SEARCHES)  # other draws may fit as it stands


def test_without_a_contact_nothing_is_said_of_contacts(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = replace(readings, touches=readings.touches[:0])
    fitted = replace(by_hermite(readings, symmetric=False), details=details_of(False), flags=("off",))
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    assert by_family(part).flags == ("off",)


@pytest.mark.parametrize(
    ("contacts", "costs", "made", "taken"),
    [
        (8, (9.0, 1.0, 1.0), 3, 1),  # of equals the first
        (8, (9.0, 5.0, 3.0), 3, 2),
        (8, (3.0, 5.0, 9.0), 3, 0),
        (8, (-1.0, -9.0, -9.0), 1, 0),  # what fits is the answer
        (8, (9.0, -1.0, -9.0), 2, 1),
        (1, (9.0, 5.0, 3.0), 3, 2),  # too few to tell that no shape fits, enough to try
    ],
)
def test_of_ill_fits_that_whose_contacts_fit_best_is_taken_and_of_good_ones_the_cheapest(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    costs: tuple[float, ...],
    made: int,
    taken: int,
) -> None:
    """Below zero, here, are costs of what fits well; others say how ill contacts fit, at less cost."""
    part = replace(readings, touches=readings.touches[:contacts])
    by_rbf, seeds = by_hermite(part, symmetric=False), list[int]()

    def searched(_: ShapeEvidence, settings: FamilySettings, previous: tuple[()] = ()) -> ShapeEstimate:
        assert previous == ()
        cost, turn = costs[len(seeds)], len(seeds)
        seeds.append(settings.seed)
        good = {"cost": cost, "contact_cost": 0.5 * LOOSE}
        ill = {"cost": -1e3 - cost, "contact_cost": LOOSE * (1.1 + 1e-3 * cost)}
        details = details_of(False) | (good if cost < 0.0 else ill)
        return replace(by_rbf, details=details, flags=(f"search {turn}",), seconds=1.0)

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    found = by_family(part)
    assert found.flags[0] == f"search {taken}"
    assert len(seeds) == len(set(seeds)) == made  # by draws of its own
    assert found.seconds == made  # the time of all is stated


@pytest.mark.parametrize(
    ("contacts", "rival", "strain", "searches"),
    [
        (ENOUGH, RIVAL, 0.0, 2),
        (ENOUGH, 0.9 * RIVAL, 1.1 * UNEASY, 1),
        (ENOUGH - 1, 0.9 * RIVAL, 1.1 * UNEASY, 2),
        (ENOUGH - 1, RIVAL, 0.9 * UNEASY, 1),  # few contacts leave several classes as they should
    ],
)
def test_what_two_classes_fit_alike_or_what_strains_by_few_contacts_is_searched_once_more(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    rival: float,
    strain: float,
    searches: int,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts])
    by_rbf, seeds = by_hermite(part, symmetric=False), list[int]()

    def searched(_: ShapeEvidence, settings: FamilySettings, previous: object = ()) -> ShapeEstimate:
        seeds.append(settings.seed)
        details = details_of(False, strain=strain)
        details |= {"classes": {"mug": 1.0 - rival, "jug": rival}, "cost": 10.0 - len(seeds)}
        return replace(by_rbf, details=details, flags=(f"search {len(seeds)}",))

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    assert by_family(part).flags[0] == f"search {searches}"  # of good fits the cheapest
    assert len(set(seeds)) == searches


@pytest.mark.parametrize(("contacts", "searches"), [(ENOUGH, 2), (ENOUGH - 1, 1)])
def test_without_a_picture_two_searches_are_made_though_the_first_fits(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch, contacts: int, searches: int
) -> None:
    blind = replace(readings, touches=readings.touches[:contacts], look=None)
    by_rbf, seeds = by_hermite(blind, symmetric=False), list[int]()

    def searched(_: ShapeEvidence, settings: FamilySettings, previous: object = ()) -> ShapeEstimate:
        seeds.append(settings.seed)
        details = details_of(False) | {"cost": 10.0 - len(seeds)}
        return replace(by_rbf, details=details, flags=(f"search {len(seeds)}",))

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    assert by_family(blind).flags[0] == f"search {searches}"
    assert len(set(seeds)) == searches
    went_on = by_family(blind, previous=by_rbf)  # where the arm waits there is one
    assert went_on.flags[0] == f"search {searches + 1}"


@pytest.mark.parametrize(
    ("typical", "strain", "beyond", "begun"),
    [
        (2.0, 0.0, 0.0, 2),
        (0.5, 1.1, 0.0, 2),
        (0.5, 0.0, 2.0, 2),  # the smooth surface would answer
        (0.5, 0.9, 0.5, 1),
    ],
)
def test_where_what_goes_on_fits_ill_it_is_begun_anew_beside_it(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    typical: float,
    strain: float,
    beyond: float,
    begun: int,
) -> None:
    """All that was likely before may be of a wrong form, however well it goes on from press to press."""
    blind = replace(readings, look=None)
    by_rbf, made = by_hermite(blind, symmetric=False), list[tuple[int, tuple[ShapeEstimate, ...]]]()

    def searched(
        _: ShapeEvidence, settings: FamilySettings, previous: tuple[ShapeEstimate, ...] = ()
    ) -> ShapeEstimate:
        made.append((settings.draws, previous))
        first = len(made) == 1
        details = details_of(False, beyond * BEYOND * first, strain * STRAINED * first)
        details["contact_cost"] = typical * LOOSE if first else 0.0
        return replace(by_rbf, details=details, flags=(str(len(made)),), seconds=1.0)

    monkeypatch.setattr(family_or_smooth, "family_estimate", searched)
    before = replace(by_rbf, flags=("0",))
    found = by_family(blind, CONTINUED, before)
    assert found.flags[0] == str(begun)
    assert found.seconds == begun  # the time of both is stated
    assert len(made) == begun
    (few, (given,)), *anew = made
    assert given.flags == ("0",)
    for many, (beside,) in anew:
        assert many > few
        assert beside.flags == ("1",)


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
        details=details_of(True),
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
    fitted = replace(by_rbf, deviation=unsure, details=details_of(True))
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
