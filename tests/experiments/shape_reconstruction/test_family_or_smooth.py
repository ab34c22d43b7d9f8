"""A household shape where one fits, the smooth surface where none does: and the answer says which."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction import family_or_smooth
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import LEVELS
from experiments.shape_reconstruction.family_or_smooth import MANY, by_family
from experiments.shape_reconstruction.surface import ShapeEstimate
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
        assert found is fitted


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
