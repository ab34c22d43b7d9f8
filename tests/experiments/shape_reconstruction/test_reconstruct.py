"""Number of searches of the family, the fit that is kept, and its competitors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction import reconstruct as reconstruction
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.kinds import draw_shape
from experiments.shape_reconstruction.family.search import CONTINUED, FamilySettings, Hypothesis
from experiments.shape_reconstruction.fits import FamilyFit, ShapeEstimate, SmoothSurface
from experiments.shape_reconstruction.prior.network import shipped, with_prior_points
from experiments.shape_reconstruction.reconstruct import reconstruct, reconstruct_with_prior
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.thresholds import (
    MAX_NUISANCE_COST,
    MAX_NUISANCE_OF_FEW,
    MAX_OUTLINE_ERROR,
    MAX_SEARCHES,
    MIN_CONTACTS,
    MIN_RIVAL_WEIGHT,
    POOR_CONTACT_COST,
)
from harness.basics.errors import FitRefused, OutOfDomain
from harness.objects.builtin import build
from tests.support.family_shapes import family_fit, mixture_of
from tests.support.shape_readings import look_at, shape_readings, touches_on

MUG = build("mug")
READINGS = shape_readings(touches_on(MUG, 12, seed=0), look_at(MUG))
SMOOTH = fit_rbf(READINGS, symmetric=False)


def part(contacts: int, sighted: bool = True) -> ShapeEvidence:
    return replace(READINGS, touches=READINGS.touches[:contacts], look=READINGS.look if sighted else None)


SHAPES = tuple(draw_shape(name, np.random.default_rng(0)) for name in ("mug", "can"))


def fit_of(residual: float = 0.1, nuisance: float = 0.0, rival: float = 0.0, cost: float = 1.0) -> FamilyFit:
    """A fit whose contacts are off by so many times ``POOR_CONTACT_COST``."""
    return family_fit(
        mixture_of(*SHAPES, weights=(1.0 - rival, rival), cost=cost),
        mesh=SMOOTH.mesh,
        deviation=SMOOTH.deviation,
        known_by=SMOOTH.known_by,
        contact_cost=residual * POOR_CONTACT_COST,
        nuisance=NuisanceCost(nuisance, ""),
    )


class Family:
    """Stands for the family's search; every search has a number, which is its estimate's flag."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *found: FamilyFit) -> None:
        self.found, self.seeds, self.given = found, list[int](), list[ShapeEvidence]()
        self.begun: list[Sequence[Hypothesis]] = []
        self.outline = 0.0
        monkeypatch.setattr(reconstruction, "fit_family", self)
        monkeypatch.setattr(reconstruction, "outline_error", lambda *_: self.outline)
        monkeypatch.setattr(reconstruction, "predict_left_out", lambda *_: np.zeros(0))
        monkeypatch.setattr(
            reconstruction,
            "_smooth",
            lambda evidence: replace(SMOOTH, left_out=np.zeros(len(evidence.contacts))),
        )

    def __call__(
        self, evidence: ShapeEvidence, settings: FamilySettings, seeds: Sequence[Hypothesis] = ()
    ) -> FamilyFit:
        number = len(self.seeds)
        self.given.append(evidence)
        self.begun.append(seeds)
        self.seeds.append(settings.seed)
        found = self.found[min(number, len(self.found) - 1)]
        return replace(
            found,
            left_out=np.zeros(len(evidence.contacts)),
            sighted=evidence.sighted,
            flags=(f"search {number}",),
        )


GOOD, POOR = fit_of(), fit_of(residual=2.0)


@pytest.mark.parametrize(
    ("contacts", "sighted", "found", "made", "kept"),
    [
        (8, True, [GOOD], 1, 0),
        (8, False, [GOOD], 2, 0),  # without a picture the cost has more local minima
        (5, False, [GOOD], 1, 0),
        (8, True, [POOR], MAX_SEARCHES, 0),  # of equals the first
        (8, True, [POOR, GOOD], 2, 1),
        (8, True, [POOR, fit_of(residual=1.5, cost=9.0), POOR], MAX_SEARCHES, 1),
        (1, True, [POOR, GOOD], 2, 1),
        (8, True, [fit_of(nuisance=1.1 * MAX_NUISANCE_COST), GOOD], 2, 1),
        (8, True, [fit_of(rival=1.1 * MIN_RIVAL_WEIGHT), fit_of(cost=0.5)], 2, 1),
        (5, True, [fit_of(rival=1.1 * MIN_RIVAL_WEIGHT)], 1, 0),
        (5, True, [fit_of(nuisance=1.1 * MAX_NUISANCE_OF_FEW), fit_of(cost=0.5)], 2, 1),
        (8, True, [fit_of(nuisance=1.1 * MAX_NUISANCE_OF_FEW)], 1, 0),
    ],
)
def test_a_poor_or_undecided_fit_is_searched_again_and_the_best_is_kept(
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    sighted: bool,
    found: list[FamilyFit],
    made: int,
    kept: int,
) -> None:
    family = Family(monkeypatch, *found)
    answer = reconstruct(part(contacts, sighted))
    assert answer.flags[0] == f"search {kept}"
    assert len(family.seeds) == len(set(family.seeds)) == made  # each by draws of its own
    assert answer.seconds == pytest.approx(made + SMOOTH.seconds)


def test_a_fit_beside_the_outline_is_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    family = Family(monkeypatch, GOOD)
    family.outline = 1.1 * MAX_OUTLINE_ERROR
    answer = reconstruct(part(8))
    assert len(family.seeds) == MAX_SEARCHES
    assert "of the outline" in answer.flags[-1]
    assert isinstance(answer, SmoothSurface)
    assert answer.rejected is not None  # the next press begins at its hypotheses
    assert answer.details()["hypotheses_left"] == answer.rejected.mixture.as_json()


@pytest.mark.parametrize(
    ("first", "again"), [(POOR, True), (fit_of(nuisance=1.1 * MAX_NUISANCE_COST), True), (GOOD, False)]
)
def test_between_presses_a_poor_fit_is_searched_again_beside_its_hypotheses(
    monkeypatch: pytest.MonkeyPatch, first: FamilyFit, again: bool
) -> None:
    family = Family(monkeypatch, first, GOOD)
    before = replace(SMOOTH, rejected=fit_of(cost=7.0))
    answer = reconstruct(part(8), CONTINUED, before)
    assert answer.flags[0] == f"search {int(again)}"
    assert [begun[0].cost for begun in family.begun] == [7.0, first.mixture.best.cost][: 1 + again]


@pytest.mark.parametrize(
    ("contacts", "supposed"), [(1, True), (MIN_CONTACTS - 1, True), (MIN_CONTACTS, False)]
)
def test_few_contacts_are_helped_by_the_prior(
    monkeypatch: pytest.MonkeyPatch, contacts: int, supposed: bool
) -> None:
    family = Family(monkeypatch, GOOD)
    reconstruct(part(contacts))
    expected = with_prior_points(READINGS).prior_points if supposed else np.zeros((0, 3))
    np.testing.assert_array_equal(family.given[0].prior_points, expected)


def test_the_prior_s_points_are_those_of_the_network_and_none_without_a_picture() -> None:
    assert READINGS.look is not None
    np.testing.assert_array_equal(with_prior_points(READINGS).prior_points, shipped().points(READINGS.look))
    assert len(with_prior_points(part(1, sighted=False)).prior_points) == 0


def test_without_a_contact_the_prior_answers_and_during_a_run_the_family(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    family = Family(monkeypatch, GOOD)
    monkeypatch.setattr(reconstruction, "_smooth", lambda _: None)
    assert reconstruct_with_prior(part(0)).estimator == "glance"
    assert not family.seeds
    assert reconstruct(part(0)).flags[0] == "search 0"  # the next press needs its hypotheses


def test_without_a_household_shape_at_the_stated_place_the_smooth_surface_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Family(monkeypatch, GOOD)

    def refuse(*_: object) -> ShapeEstimate:
        raise FitRefused("too long")

    monkeypatch.setattr(reconstruction, "fit_family", refuse)
    assert "no household shape at the stated place" in reconstruct(part(2)).flags[-1]
    monkeypatch.setattr(reconstruction, "_smooth", lambda _: None)
    with pytest.raises(FitRefused, match="too long"):
        reconstruct(part(2))


@pytest.mark.parametrize(
    ("outlines", "misfits", "kept"),
    [((0.0, 0.0), (2e-3, 1e-3), 1), ((0.0, 0.5), (2e-3, 1e-3), 0), ((0.5, 0.0), (1e-3, 2e-3), 1)],
)
def test_of_two_smooth_surfaces_that_show_the_outline_the_better_prediction_is_kept(
    monkeypatch: pytest.MonkeyPatch, outlines: tuple[float, float], misfits: tuple[float, float], kept: int
) -> None:
    made = [replace(SMOOTH, flags=(str(k),), left_out=np.array([misfits[k]])) for k in (0, 1)]
    monkeypatch.setattr(reconstruction, "bend_prior", lambda _: made[0])
    monkeypatch.setattr(reconstruction, "fit_rbf", lambda *_, **__: made[1])
    shown = iter(outlines)
    monkeypatch.setattr(reconstruction, "outline_error", lambda *_: next(shown))
    found = reconstruction._smooth(part(MIN_CONTACTS))
    assert found is not None
    assert found.flags == (str(kept),)


def test_where_no_smooth_surface_is_left_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> ShapeEstimate:
        raise OutOfDomain("nothing is left")

    monkeypatch.setattr(reconstruction, "bend_prior", refuse)
    monkeypatch.setattr(reconstruction, "fit_rbf", refuse)
    assert reconstruction._smooth(part(2)) is None
    assert reconstruction._smooth(part(0)) is None
