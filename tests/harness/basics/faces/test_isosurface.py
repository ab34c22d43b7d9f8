"""The surface of a field on a grid: closed whatever the field, and where it should be."""

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.smooth.grid import isosurface
from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.sim.solid.walls import enclosed_volume

PITCH = 2.0e-3


def ball(pitch: float, radius: float = 0.02) -> FloatArray:
    """``(n, n, n)`` m: signed distance from a ball about the origin of a grid that holds it."""
    axis = np.arange(-0.03, 0.03 + pitch, pitch)
    return np.asarray(np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis)), axis=0) - radius)


@pytest.mark.parametrize("levels", [None, 2, 5])
@pytest.mark.parametrize("seed", range(4))
def test_any_field_gives_a_closed_surface_with_its_outside_outside(seed: int, levels: int | None) -> None:
    """Noise is the worst there is: every cell a saddle, and with few levels corners that are all alike."""
    field = PITCH * np.random.default_rng(seed).standard_normal((9, 8, 7))
    if levels is not None:
        field = np.clip(np.round(field / PITCH), 1 - levels, levels - 1) * PITCH
        field[field == 0.0] = PITCH if levels == 2 else 0.0
    mesh = isosurface(field, np.zeros(3), PITCH)
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume > 0.0
    assert (mesh.face_areas > 0.0).all()


def test_halving_the_pitch_quarters_the_error_of_the_volume() -> None:
    exact = 4.0 / 3.0 * np.pi * 0.02**3
    errors = []
    for pitch in (4.0e-3, 2.0e-3, 1.0e-3):
        mesh = isosurface(ball(pitch), np.full(3, -0.03), pitch)
        errors.append(abs(trimesh.Trimesh(mesh.vertices, mesh.faces).volume - exact))
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(2.0, abs=0.4)


def test_what_reaches_the_border_is_closed_there() -> None:
    mesh = isosurface(np.full((3, 4, 5), -PITCH), np.array([1.0, 2.0, 3.0]), PITCH)
    low, high = mesh.bounds
    assert (low > np.array([1.0, 2.0, 3.0]) - PITCH).all()
    assert (high < np.array([1.0, 2.0, 3.0]) + PITCH * np.array([3, 4, 5])).all()
    assert enclosed_volume(mesh) == pytest.approx(PITCH**3 * 3 * 4 * 5, rel=0.25)


def test_single_precision_gives_the_same_surface() -> None:
    double = isosurface(ball(PITCH), np.zeros(3), PITCH)
    single = isosurface(np.asarray(ball(PITCH).astype(np.float32), np.float64), np.zeros(3), PITCH)
    assert single.vertices == pytest.approx(double.vertices, abs=1e-3 * PITCH)


@pytest.mark.parametrize(
    ("field", "words"),
    [
        (np.full((3, 3, 3), np.nan), "27 .*finite"),
        (np.ones((3, 3)), r"shape \(3, 3\)"),
        (np.ones((0, 3, 3)), r"shape \(0, 3, 3\)"),
        (np.ones((3, 3, 3)), "corner"),
    ],
)
def test_a_field_without_a_surface_is_refused(field: FloatArray, words: str) -> None:
    with pytest.raises(OutOfDomain, match=words):
        isosurface(field, np.zeros(3), PITCH)
