"""Predictions of left-out contacts and of the outline, and the prior bent to contacts."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.family.estimate import fit_family
from experiments.shape_reconstruction.family.search import LEVELS
from experiments.shape_reconstruction.fits import TOUCHED
from experiments.shape_reconstruction.prior.network import predict_surface
from experiments.shape_reconstruction.reconstruct import outline_error, predict_left_out
from experiments.shape_reconstruction.smooth.bent_prior import bend_prior
from experiments.shape_reconstruction.smooth.free_space import CLEARANCE, sensor_depth
from harness.basics.errors import FitRefused
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.support.shape_readings import look_at, shape_readings, touches_on

MUG = build("mug")
LOOK = look_at(MUG, 320)
TOUCHES = touches_on(MUG, 8, seed=0)
READINGS = shape_readings(TOUCHES, LOOK)


def moved(mesh: Mesh, by: float) -> Mesh:
    return Mesh(mesh.vertices + np.array([0.0, 0.0, by]), mesh.faces)


def test_the_true_surface_shows_the_outline_and_a_moved_one_misses_and_adds() -> None:
    assert outline_error(MUG, LOOK) < 0.005
    assert outline_error(moved(MUG, 0.03), LOOK) > 0.3
    small = Mesh(0.5 * MUG.vertices, MUG.faces)
    assert outline_error(small, LOOK) > 0.5  # misses alone
    assert outline_error(moved(MUG, 5.0), LOOK) == 1.0  # shows nothing
    assert outline_error(moved(MUG, 0.03), None) == 0.0
    assert outline_error(moved(MUG, 0.03), replace(LOOK, mask=np.zeros_like(LOOK.mask))) == 0.0


def test_what_is_hidden_counts_neither_as_missed_nor_as_added() -> None:
    assert outline_error(moved(MUG, 0.03), replace(LOOK, hidden=np.ones_like(LOOK.mask))) == 0.0


def test_the_outline_may_be_off_by_the_camera_s_error() -> None:
    """6 mm up are 3 pixels here."""
    precise, rough = (
        replace(LOOK, position_error=1e-4, rotation_error=1e-4),
        replace(LOOK, position_error=8e-3),
    )
    assert outline_error(moved(MUG, 6e-3), precise) > 0.02
    assert outline_error(moved(MUG, 6e-3), rough) < 0.01


def test_a_right_family_predicts_contacts_and_a_slipped_one_is_off_by_its_slip() -> None:
    found = fit_family(READINGS, LEVELS["coarse"])
    assert np.median(predict_left_out(found, READINGS)) < 1.5e-3
    up = np.array([0.0, 0.0, 1.0])
    bad = replace(TOUCHES[3], points=TOUCHES[3].points + 12e-3 * TOUCHES[3].mean_normal + 0.0 * up)
    slipped = replace(READINGS, touches=(*TOUCHES[:3], bad, *TOUCHES[4:]))
    assert predict_left_out(found, slipped)[3] == pytest.approx(12e-3, abs=4e-3)


def test_the_prior_is_bent_to_its_contacts_and_stays_in_the_free_space() -> None:
    found = bend_prior(READINGS)
    mesh = found.mesh
    points = np.concatenate([touch.points for touch in TOUCHES])
    before = NearestSurface(predict_surface(READINGS).mesh).distances(points)
    after = NearestSurface(mesh).distances(points)
    assert np.sqrt(np.mean(after**2)) < 2.5e-3
    assert np.sqrt(np.mean(after**2)) < 0.6 * np.sqrt(np.mean(before**2))
    assert sensor_depth(READINGS, mesh.vertices).max() < CLEARANCE + 3e-3
    assert mesh.bounds[0, 2] > -3e-3
    assert outline_error(mesh, LOOK) < 0.1
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert body.is_watertight
    assert body.volume > 0.0


def test_a_bent_prior_is_surest_where_it_was_touched_and_as_unsure_as_its_predictions() -> None:
    found = bend_prior(READINGS)
    known, deviation = found.known_by, found.deviation
    assert deviation[known == TOUCHED].mean() < 0.5 * deviation[known != TOUCHED].mean()
    assert deviation.max() >= 0.95 * found.prediction_error
    alone = bend_prior(replace(READINGS, touches=TOUCHES[:1]))
    assert alone.left_out.shape == (1,)
    prior = predict_surface(READINGS)
    assert alone.deviation.max() >= 0.95 * prior.deviation.max()
    # Without the one contact there is the prior alone.
    apart = NearestSurface(prior.mesh).distances(TOUCHES[0].points)
    assert alone.left_out[0] == pytest.approx(np.sqrt(np.mean(apart**2)), abs=2.5e-3)


def test_without_a_picture_or_a_contact_nothing_is_bent() -> None:
    with pytest.raises(FitRefused):
        bend_prior(replace(READINGS, look=None))
    with pytest.raises(FitRefused, match="0 touches"):
        bend_prior(replace(READINGS, touches=()))
