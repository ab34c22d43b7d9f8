"""Answers about objects never drawn are as wide as scanned things showed that they must be."""

from pathlib import Path

import numpy as np
import pytest

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.unseen.answer import shape_sigma
from experiments.scale_estimation.unseen.train import (
    SIGMAS,
    likeliest_sigma,
    log_densities,
    meshes_in,
    resting,
)
from harness.basics.errors import DataRefused
from harness.basics.mesh import Mesh
from harness.experiment.subjects import REAL
from harness.objects.builtin import build

RANGE = SizeRange(0.05, 0.6)
STATED = 0.05


def said(true: float, off: float) -> Belief:
    middle = np.log(true) + off
    return Belief.of(RANGE, -0.5 * ((RANGE.logs - middle) / STATED) ** 2)


@pytest.mark.parametrize(
    "besides", [0.0, pytest.param(0.1, marks=pytest.mark.slow), pytest.param(0.2, marks=pytest.mark.slow)]
)  # each draws 60 cases
def test_the_deviation_found_is_that_of_the_errors_beyond_what_was_stated(besides: float) -> None:
    random = np.random.default_rng(4)
    errors = np.hypot(STATED, besides) * random.standard_normal(60)
    found = likeliest_sigma(log_densities([(said(0.2, float(off)), 0.2) for off in errors]))
    assert found == pytest.approx(besides, abs=1.01 * SIGMAS[1])


def test_things_that_tables_are_measured_on_are_left_out(tmp_path: Path) -> None:
    names = [
        *(Path(file).relative_to("meshes") for file, _, _ in REAL.values()),
        Path("a_collision_hull.obj"),
    ]
    others = [Path(f"thing{k}.stl") for k in range(6)]
    for name in (*names, *others):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert meshes_in(tmp_path) == [tmp_path / name for name in others]


def test_too_few_things_are_refused(tmp_path: Path) -> None:
    (tmp_path / "one.stl").touch()
    with pytest.raises(DataRefused, match=r"\b1 meshes.*\b6 "):
        meshes_in(tmp_path)


def test_a_thing_stands_and_lies_on_the_support_and_stays_itself() -> None:
    wrench = build("wrench")
    upright = Mesh(wrench.vertices[:, [1, 2, 0]], wrench.faces)
    standing, lying = resting(upright)
    for mesh in (standing, lying):
        assert mesh.bounds[0, 2] == 0.0
        assert np.ptp(mesh.bounds, axis=0).max() == pytest.approx(1.0)
        assert volume(mesh) == pytest.approx(volume(standing))  # not its mirror image
    assert np.ptp(lying.bounds, axis=0).argmin() == 2


def volume(mesh: Mesh) -> float:
    a, b, c = mesh.corners.transpose(1, 0, 2)
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("sense", ["vision", "touch"])
def test_a_deviation_ships_for_each_sense_that_is_widened(sense: str) -> None:
    assert 0.0 <= shape_sigma(sense) < 0.5
