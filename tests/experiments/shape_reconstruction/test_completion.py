"""The point completion network: its frame, what it learns from, and that its graph answers as torch does."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.point_answer import by_raw_points
from experiments.shape_reconstruction.metric import points_error
from experiments.shape_reconstruction.pcn.completed_surface import (
    PITCH,
    by_completed_surface,
    closed_around,
)
from experiments.shape_reconstruction.pcn.interpolated import interpolated
from experiments.shape_reconstruction.pcn.network import by_completion, opened, shipped
from experiments.shape_reconstruction.pcn.point_frame import GIVEN, TAKEN, PointFrame, taken
from experiments.shape_reconstruction.pcn.train import main
from experiments.shape_reconstruction.pcn.training.samples import WHOLE, shape_of, touch_sets
from harness.basics.errors import DataRefused, FitRefused, OutOfDomain
from harness.basics.faces.mesh_rays import is_inside
from harness.basics.faces.nearest_surface import NearestSurface
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, presses

POINTS = np.random.default_rng(0).normal((0.1, 0.0, 0.15), 0.04, (300, 3))
MOVED = np.array([0.3, -0.2, 0.0])


def test_the_frame_is_left_as_it_was_entered_and_moves_and_grows_with_the_points() -> None:
    frame = PointFrame.of(POINTS)
    assert frame.outward(frame.inward(POINTS)) == pytest.approx(POINTS)
    moved, larger = POINTS + MOVED, 2.5 * POINTS
    assert PointFrame.of(moved).inward(moved) == pytest.approx(frame.inward(POINTS))
    assert PointFrame.of(larger).inward(larger) == pytest.approx(frame.inward(POINTS))


def test_every_point_is_taken_as_often_as_can_be() -> None:
    rows = taken(POINTS)
    assert rows.shape == (TAKEN, 3)
    _, counts = np.unique(rows, axis=0, return_counts=True)
    assert len(counts) == len(POINTS)
    assert counts.max() - counts.min() <= 1
    assert len(np.unique(taken(np.tile(POINTS, (9, 1)) + np.arange(2700)[:, None]), axis=0)) == TAKEN


def test_the_answer_moves_and_grows_with_the_touches() -> None:
    found = shipped().completed(POINTS)
    assert found.shape == (GIVEN, 3)
    assert shipped().completed(POINTS + MOVED) == pytest.approx(found + MOVED, abs=1e-5)
    assert shipped().completed(2.5 * POINTS) == pytest.approx(2.5 * found, abs=1e-5)


def test_the_order_of_points_does_not_matter_where_all_are_taken() -> None:
    few = POINTS[: TAKEN // 4]
    assert shipped().completed(few[::-1]) == pytest.approx(shipped().completed(few), abs=1e-6)


@pytest.mark.parametrize("name", ["mug", "bowl"])
def test_it_completes_what_raw_points_leave_open(name: str) -> None:
    mesh = build(name, 6e-3)
    evidence = evidence_of(presses(mesh, 24, seed=4))
    ours, raw = by_completion(evidence), by_raw_points(evidence)
    assert points_error(ours.points, mesh, 4000).chamfer < points_error(raw.points, mesh, 4000).chamfer
    assert points_error(ours.points, mesh, 4000).chamfer < 0.01


@pytest.mark.parametrize("count", [1, 4, 24])
def test_its_surface_is_closed_around_its_points_and_as_sure_as_it_was_on_shapes_held_out(count: int) -> None:
    evidence = evidence_of(presses(build("mug", 6e-3), count, seed=4))
    answer = by_completed_surface(evidence)
    body = trimesh.Trimesh(answer.mesh.vertices, answer.mesh.faces, process=False)
    assert body.is_watertight
    assert body.volume > 0.0
    assert np.isfinite(answer.mesh.vertices).all()
    assert answer.mesh.bounds[0, 2] >= 0.0
    apart = NearestSurface(answer.mesh).distances(shipped().completed(all_samples(evidence).points))
    assert float(np.median(apart)) < 2.0 * PITCH
    assert (answer.deviation >= shipped().held_out).all()


def test_points_between_neighbours_lie_on_the_surface_to_second_order_and_fill_its_gaps() -> None:
    sphere = np.random.default_rng(0).normal(size=(16_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    off, gaps = [], []
    for count in (500, 4000):
        points = interpolated(sphere[:count], 8)
        assert points.shape == (9 * count, 3)
        np.testing.assert_array_equal(points[:count], sphere[:count])
        off.append(np.abs(np.linalg.norm(points, axis=1) - 1.0).mean())
        gaps.append([np.mean(cKDTree(some).query(sphere)[0]) for some in (sphere[:count], points)])
    assert off[1] == pytest.approx(off[0] / 8.0, rel=0.2)  # eight times as many: the square of the spacing
    assert all(after < 0.7 * before for before, after in gaps)


def test_closing_fills_a_ball_and_leaves_a_bowl_open() -> None:
    random = np.random.default_rng(0)
    ball = random.normal(size=(1024, 3))
    ball *= 0.06 / np.linalg.norm(ball, axis=1)[:, None]
    ball[:, 2] += 0.06
    middle = np.array([[0.0, 0.0, 0.045]])
    solid, bowl = closed_around(ball).mesh, closed_around(ball[ball[:, 2] < 0.05]).mesh
    assert is_inside(middle, solid.corners)[0]
    assert np.ptp(solid.bounds, axis=0) == pytest.approx(
        0.12 + 2.0 * PITCH, abs=PITCH
    )  # walls have a thickness
    assert not is_inside(middle, bowl.corners)[0]


def test_a_card_without_what_was_held_out_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataRefused, match="train it again"):
        replace(shipped(), card={"held_out": {}}).held_out  # noqa: B018 - it is computed


def test_the_card_says_what_was_held_out_and_that_it_is_better_than_nothing() -> None:
    card = shipped().card
    held = card["held_out"]
    assert isinstance(held, dict)
    assert held["sets"] > 200
    assert held["mean_chamfer_points_m"] < 0.01
    assert card["profile"] == "standard"


def test_touches_of_no_place_are_refused_by_name() -> None:
    with pytest.raises(FitRefused):
        by_completion(evidence_of(()))
    with pytest.raises(OutOfDomain, match="in more places"):
        PointFrame.of(np.zeros((5, 3)))
    with pytest.raises(OutOfDomain, match="no place"):
        PointFrame.of(np.zeros((0, 3)))


def test_samples_are_the_same_again_and_in_one_frame() -> None:
    one, again = (touch_sets(4, 2, seed=3) for _ in range(2))
    assert np.array_equal(one.touched, again.touched)
    assert one.touched.shape[1:] == (TAKEN, 3)
    assert one.whole.shape[1:] == (WHOLE, 3)
    assert np.isfinite(one.touched).all()
    # What is touched lies on the whole: a millimetre or two, in units of the frame.
    for touched, whole in zip(one.touched, one.whole, strict=True):
        apart = np.linalg.norm(touched[::64, None] - whole[None], axis=2).min(axis=1)
        assert float(np.median(apart)) < 0.05


@pytest.mark.parametrize("number", range(4))
def test_touched_places_lie_on_the_shape_but_for_errors_of_reading(number: int) -> None:
    shape = shape_of(number, seed=8)
    points = shape.touched(12, np.random.default_rng(number))
    if len(points):
        assert float(NearestSurface(shape.mesh).distances(points).max()) < 4e-3


def test_without_torch_training_says_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("experiments.shape_reconstruction.pcn.train.find_spec", lambda _name: None)
    assert main(["--profile", "smoke", "--out", str(tmp_path / "none")]) == 2
    assert "torch" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_a_smoke_training_ends_in_a_graph_that_answers_as_torch_does(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="the extra 'author' is not installed")
    from experiments.shape_reconstruction.pcn.training.networks import CompletionNetwork, graph

    assert main(["--profile", "smoke", "--only", "completion", "--out", str(tmp_path)]) == 0
    card = (tmp_path / "completion.json").read_text()
    assert json.loads(card)["profile"] == "smoke"
    assert np.isfinite(opened((tmp_path / "completion.onnx").read_bytes(), card).completed(POINTS)).all()
    torch.manual_seed(1)
    module = CompletionNetwork().eval()
    rows = np.random.default_rng(1).normal(size=(2, TAKEN, 3)).astype(np.float32)
    answered = opened(graph(module), card).network({"touched": rows})["completed"]
    with torch.no_grad():
        wanted = module(torch.from_numpy(rows)).numpy()
    assert answered == pytest.approx(wanted, abs=5e-3)  # kept in half precision
