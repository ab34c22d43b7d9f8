"""Estimates while a run goes on: after which presses, and from what."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore import explorer
from experiments.shape_reconstruction.explore.explorer import (
    INFORMATIVE,
    MOST,
    RunningShape,
    counts_shown,
    live_estimates,
    live_method,
)
from experiments.shape_reconstruction.family.search import FamilySettings
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import QUICK
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, presses

TOUCHES = presses(build("mug", 6e-3), 4, seed=3)


@pytest.mark.parametrize(
    ("made", "shown"),
    [
        (0, []),
        (1, [1]),
        (MOST, list(range(1, MOST + 1))),
        (6, [1, 2, 4, 6]),
        (8, [1, 2, 4, 8]),
        (32, [1, 2, 4, 8, 16, 32]),
    ],
)
def test_of_few_presses_each_is_shown_and_of_many_those_that_double(made: int, shown: list[int]) -> None:
    assert counts_shown(made) == shown


def test_each_estimate_is_from_the_presses_until_then_and_none_where_nothing_was_met() -> None:
    missed = replace(TOUCHES[0], points=TOUCHES[0].points[:0], normals=TOUCHES[0].normals[:0])
    found = list(live_estimates(evidence_of((missed, *TOUCHES[1:])), RunningShape("rbf")))
    assert [len(evidence.touches) for evidence, _ in found] == [1, 2, 3, 4]
    assert found[0][1] is None
    assert all(estimate is not None for _, estimate in found[1:])


def test_a_press_that_needs_likely_shapes_waits_for_them() -> None:
    assert live_method("active") == INFORMATIVE
    assert live_method("random") == live_method("planned") == QUICK


def test_what_goes_on_from_press_to_press_is_the_same_where_a_run_is_taken_up_again() -> None:
    """Which estimates were asked for on the way changes none of them."""
    evidence = evidence_of(TOUCHES[:3])
    each, last = RunningShape(INFORMATIVE), RunningShape(INFORMATIVE)
    for count in (1, 2, 2, 3):
        found = each.after(replace(evidence, touches=TOUCHES[:count]))
    again = last.after(evidence)
    assert found is not None
    assert again is not None
    np.testing.assert_array_equal(found.mesh.vertices, again.mesh.vertices)


def test_an_estimate_is_solved_once_and_the_answer_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    solved: list[int] = []
    answer = fit_rbf(evidence_of(TOUCHES))

    def estimated(_method: str, evidence: ShapeEvidence) -> ShapeEstimate:
        solved.append(len(evidence.touches))
        return answer

    monkeypatch.setattr(explorer, "estimated", estimated)
    shape = RunningShape(QUICK)
    for count in (1, 2, 2):
        shape.after(evidence_of(TOUCHES[:count]))
    found = list(live_estimates(evidence_of(TOUCHES), shape, answer))
    assert solved == [1, 2, 3]
    assert found[-1][1] is answer


def test_each_estimate_is_given_that_of_a_press_less(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[object] = []

    def continued(
        evidence: ShapeEvidence, _settings: FamilySettings, previous: ShapeEstimate | None
    ) -> ShapeEstimate:
        given.append(previous and previous.counts["presses"])
        return replace(fit_rbf(evidence_of(TOUCHES)), counts={"presses": len(evidence.touches)})

    monkeypatch.setattr(explorer, "continued", continued)
    RunningShape(INFORMATIVE).after(evidence_of(TOUCHES[:3]))
    assert given == [None, 0, 1, 2]
