"""Laws of a distance between surfaces, on built-in objects."""

from dataclasses import astuple, replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.metric import (
    published_chamfer,
    published_points_chamfer,
    shape_error,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, OutOfDomain
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.objects.builtin import build

MUG, BOWL = build("mug", 6e-3), build("bowl", 6e-3)
FEW = 4000


def moved(mesh: Mesh, pose: FloatArray, scale: float = 1.0) -> Mesh:
    return Mesh(apply(pose, scale * mesh.vertices), mesh.faces)


def box(size: float) -> Mesh:
    made = trimesh.creation.box((size, size, size))
    return Mesh(made.vertices, made.faces)


@pytest.mark.parametrize("name", ["mug", "bowl", "plate", "pitcher", "tray", "wrench"])
def test_the_truth_itself_is_not_off(name: str) -> None:
    mesh = build(name, 6e-3)
    found = shape_error(mesh, mesh, samples=FEW)
    assert found.chamfer <= 1e-9
    assert found.hausdorff95 <= 1e-9
    assert found.f_score == 1.0


def test_swapping_answer_and_truth_swaps_the_halves_and_leaves_their_sum() -> None:
    one, other = shape_error(MUG, BOWL, samples=FEW), shape_error(BOWL, MUG, samples=FEW)
    assert one == replace(other, accuracy=other.completeness, completeness=other.accuracy)


def test_moving_both_changes_nothing_and_scaling_both_scales() -> None:
    pose = transform(rotation_from_vector(np.array([0.3, -1.1, 2.0])), np.array([0.4, -0.2, 1.0]))
    before = shape_error(MUG, BOWL, samples=FEW)
    after = shape_error(moved(MUG, pose), moved(BOWL, pose), samples=FEW)
    assert after.chamfer == pytest.approx(before.chamfer, abs=1e-12)
    doubled = shape_error(moved(MUG, np.eye(4), 2.0), moved(BOWL, np.eye(4), 2.0), samples=FEW)
    assert doubled.chamfer == pytest.approx(2.0 * before.chamfer, rel=1e-12)
    assert doubled.hausdorff95 == pytest.approx(2.0 * before.hausdorff95, rel=1e-12)


def test_boxes_in_each_other_are_as_far_apart_as_their_walls() -> None:
    """Of the larger box's surface the corners and edges are farther: known in closed form."""
    found = shape_error(box(0.10), box(0.12), samples=FEW)
    assert found.accuracy == pytest.approx(0.01, abs=1e-12)
    inner = (0.10 / 0.12) ** 2
    assert 0.01 < found.completeness < 0.01 * (inner + (1.0 - inner) * np.sqrt(3.0))
    assert found.f_score == 0.0


@pytest.mark.slow  # many drawn cases of a statistic
def test_cutting_the_faces_of_either_changes_no_more_than_other_samples_do() -> None:
    finer = trimesh.Trimesh(MUG.vertices, MUG.faces, process=False).subdivide()
    same = Mesh(np.asarray(finer.vertices), np.asarray(finer.faces))
    assert shape_error(same, MUG, samples=FEW).chamfer <= 1e-9
    cut, whole = (shape_error(mesh, BOWL, samples=20_000).chamfer for mesh in (same, MUG))
    assert cut == pytest.approx(whole, rel=0.02)


@pytest.mark.slow  # many drawn cases of a statistic
def test_four_times_the_samples_halve_the_scatter() -> None:
    scatters = []
    for samples in (250, 4000):
        found = [shape_error(MUG, BOWL, samples=samples, seed=seed).accuracy for seed in range(10)]
        scatters.append(np.std(found))
    assert scatters[1] < 0.5 * scatters[0]  # a quarter is expected


def test_the_published_form_has_a_floor_that_falls_with_the_root_of_the_points() -> None:
    coarse, fine = (published_chamfer(MUG, MUG, count) for count in (2500, 10_000))
    assert fine > 0.3e-3
    assert coarse / fine == pytest.approx(2.0, rel=0.1)
    assert published_chamfer(MUG, BOWL, 10_000) == pytest.approx(
        shape_error(MUG, BOWL, samples=10_000).chamfer, abs=2.0 * fine
    )


def test_the_published_form_of_two_points_is_their_distance() -> None:
    corner = MUG.vertices[:1]
    assert published_points_chamfer(corner, corner + np.array([0.0, 0.0, 0.01])) == pytest.approx(0.01)


def test_all_numbers_are_finite_and_single_precision_agrees() -> None:
    found = shape_error(MUG, BOWL, samples=FEW)
    assert np.isfinite(astuple(found)).all()
    single = Mesh(MUG.vertices.astype(np.float32).astype(np.float64), MUG.faces)
    assert shape_error(single, BOWL, samples=FEW).chamfer == pytest.approx(found.chamfer, abs=1e-7)


def test_what_has_no_surface_or_no_points_is_refused_by_name() -> None:
    nothing = Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int64))
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    lost = Mesh(np.where(np.arange(len(MUG.vertices))[:, None] == 5, np.nan, MUG.vertices), MUG.faces)
    for bad in (nothing, flat, lost):
        with pytest.raises(MeshRefused):
            shape_error(bad, MUG, samples=FEW)
    for points in (np.zeros((0, 3)), np.full((4, 3), np.inf), np.zeros((4, 2))):
        with pytest.raises(OutOfDomain, match=r"shape \(\d, \d\)"):
            published_points_chamfer(points, MUG.vertices)
