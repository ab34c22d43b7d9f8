"""A household shape where one fits, the smooth surface where none does: and the answer says which."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction import family_or_smooth
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.contacts_fit import ContactFit
from experiments.shape_reconstruction.family.estimate import DEAR, FOREIGN, _is_foreign
from experiments.shape_reconstruction.family_or_smooth import by_family
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.objects.builtin import build
from tests.support.shape_readings import look_at, shape_readings, touches_on


@pytest.fixture(scope="module")
def readings() -> ShapeEvidence:
    mesh = build("mug")
    return shape_readings(touches_on(mesh, 8, seed=0), look_at(mesh))


def fit_of(sums: list[float], doubtful: int) -> ContactFit:
    count = len(sums)
    return ContactFit(np.array(sums), np.zeros(count), np.arange(count) < doubtful, 0.0)


@pytest.mark.parametrize(
    ("foreign", "contacts", "smooth"), [(True, 8, True), (True, 3, False), (False, 8, False)]
)
def test_the_surface_is_smooth_where_no_class_fits_enough_contacts(
    readings: ShapeEvidence, monkeypatch: pytest.MonkeyPatch, foreign: bool, contacts: int, smooth: bool
) -> None:
    part = replace(readings, touches=readings.touches[:contacts])
    by_rbf = by_hermite(part)
    fitted: ShapeEstimate = replace(by_rbf, details={"foreign": foreign}, doubtful={1: 0.004}, flags=("off",))
    monkeypatch.setattr(family_or_smooth, "family_estimate", lambda *_: fitted)
    found = by_family(part)
    assert found.doubtful == {1: 0.004}
    assert found.flags[0] == "off"
    if smooth:
        assert "by rbf" in found.flags[-1]
        np.testing.assert_array_equal(found.mesh.vertices, by_rbf.mesh.vertices)
    else:
        assert found is fitted


def test_an_object_is_foreign_where_all_contacts_are_far_off() -> None:
    assert _is_foreign(fit_of([2.0 * FOREIGN] * 8, 0), 0.0)
    assert not _is_foreign(fit_of([0.5 * FOREIGN] * 8, 0), 0.0)


def test_slipped_contacts_alone_make_no_object_foreign() -> None:
    assert not _is_foreign(fit_of([1.0] * 12, 2), 1e3)
    assert not _is_foreign(fit_of([1.0] * 12, 4), 0.5 * DEAR * 12)
    assert _is_foreign(fit_of([1.0] * 12, 4), 2.0 * DEAR * 12)


def test_without_a_contact_no_object_is_foreign() -> None:
    assert not _is_foreign(fit_of([], 0), 50.0)
