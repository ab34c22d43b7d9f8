"""A glance beside a household shape: it is the answer where it is surer by far, and says so."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction import glance_or_family
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family_or_smooth import ENOUGH
from experiments.shape_reconstruction.glance_or_family import SPREAD, by_glance_or_family
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses


@pytest.fixture(scope="module")
def readings() -> ShapeEvidence:
    mesh = build("mug", 6e-3)
    return evidence_of(presses(mesh, ENOUGH, 0), look_at(mesh))


@pytest.mark.parametrize(
    ("contacts", "sighted", "times", "glanced"),
    [
        (0, True, 0.5, True),
        (1, True, 0.5, False),
        (1, True, 0.9 / SPREAD, False),
        (1, True, 1.1 / SPREAD, True),  # a household shape that is not sure of its depth
        (ENOUGH - 1, True, 1.1 / SPREAD, True),
        (ENOUGH, True, 1.1 / SPREAD, False),  # so many contacts are heeded whatever they leave open
        (1, False, 1.1 / SPREAD, False),  # there is no picture to glance at
    ],
)
def test_a_glance_that_is_surer_by_far_is_the_answer(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    sighted: bool,
    times: float,
    glanced: bool,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts], look=readings.look if sighted else None)
    glance = by_glanced_surface(readings)

    def household(_: ShapeEvidence, __: FamilySettings | None) -> ShapeEstimate:
        """As sure as a glance by so many times, and ten seconds long."""
        details: dict[str, object] = {"estimator": "household"}
        return replace(
            glance, deviation=times * glance.deviation, doubtful={1: 0.004}, seconds=10.0, details=details
        )

    monkeypatch.setattr(glance_or_family, "by_family", household)
    found = by_glance_or_family(part)
    assert (found.details["estimator"] == "glance") is glanced
    if glanced and contacts:
        assert f"by {contacts} contacts are less sure" in found.flags[-1]
        assert found.doubtful == {1: 0.004}  # what was told of contacts is kept
        assert found.seconds > 10.0
        np.testing.assert_array_equal(found.mesh.vertices, glance.mesh.vertices)
