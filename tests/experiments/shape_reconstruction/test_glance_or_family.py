"""A glance until something is touched; then household shapes, but where they are nowhere near it."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction import glance_or_family
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family_or_smooth import ENOUGH, by_family
from experiments.shape_reconstruction.glance_or_family import ALOOF, by_glance_or_family
from experiments.shape_reconstruction.pcn.glance import shipped, with_supposed
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses


@pytest.fixture(scope="module")
def readings() -> ShapeEvidence:
    mesh = build("mug", 6e-3)
    return evidence_of(presses(mesh, ENOUGH, 0), look_at(mesh))


@pytest.mark.parametrize(
    ("contacts", "sighted", "aloof", "glanced"),
    [
        (0, True, False, True),
        (1, True, False, False),
        (1, True, True, True),  # a household shape that has nothing to do with what a glance supposes
        (ENOUGH - 1, True, True, True),
        (ENOUGH, True, True, False),  # so many contacts are heeded whatever they say
        (1, False, True, False),  # there is no picture to glance at
    ],
)
def test_a_household_shape_nowhere_near_a_glance_does_not_count_beside_few_contacts(
    readings: ShapeEvidence,
    monkeypatch: pytest.MonkeyPatch,
    contacts: int,
    sighted: bool,
    aloof: bool,
    glanced: bool,
) -> None:
    part = replace(readings, touches=readings.touches[:contacts], look=readings.look if sighted else None)
    glance = by_glanced_surface(readings)

    def household(_: ShapeEvidence, __: FamilySettings | None) -> ShapeEstimate:
        """That of the glance, or moved up by twice what is allowed, and ten seconds long."""
        up = np.array([0.0, 0.0, 2.0 * ALOOF * shipped().held_out if aloof else 0.0])
        mesh = Mesh(glance.mesh.vertices + up, glance.mesh.faces)
        details: dict[str, object] = {"estimator": "household"}
        return replace(glance, mesh=mesh, doubtful={1: 0.004}, seconds=10.0, details=details)

    monkeypatch.setattr(glance_or_family, "by_family", household)
    found = by_glance_or_family(part)
    assert (found.details["estimator"] == "glance") is glanced
    if glanced and contacts:
        assert f"by {contacts} contacts is nowhere near a glance" in found.flags[-1]
        assert found.doubtful == {1: 0.004}  # what was told of contacts is kept
        assert found.seconds > 10.0
        np.testing.assert_array_equal(found.mesh.vertices, glance.mesh.vertices)


class _Asked(Exception):
    """The family was searched."""


@pytest.mark.parametrize(("contacts", "held"), [(1, True), (ENOUGH - 1, True), (ENOUGH, False)])
def test_beside_few_contacts_household_shapes_are_held_against_a_glance(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch, contacts: int, held: bool
) -> None:
    asked: list[ShapeEvidence] = []

    def searched(evidence: ShapeEvidence, *_: object) -> ShapeEstimate:
        asked.append(evidence)
        raise _Asked

    monkeypatch.setattr("experiments.shape_reconstruction.family_or_smooth.family_estimate", searched)
    with pytest.raises(_Asked):
        by_family(replace(readings, touches=readings.touches[:contacts]))
    expected = with_supposed(readings).supposed if held else np.zeros((0, 3))
    np.testing.assert_array_equal(asked[0].supposed, expected)


def test_what_is_supposed_is_a_glance_s_points_and_nothing_without_a_picture(readings: ShapeEvidence) -> None:
    supposed = with_supposed(readings).supposed
    np.testing.assert_array_equal(supposed, shipped().points(readings.look))  # type: ignore[arg-type]
    assert len(with_supposed(replace(readings, look=None)).supposed) == 0
