"""A glance: it turns with the bench, needs a silhouette, and is near what it has never seen."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.methods import estimated
from experiments.shape_reconstruction.metric import surfaces_apart
from experiments.shape_reconstruction.prior.network import (
    PITCH,
    POINTS_GIVEN,
    SIDE,
    closed_around,
    opened,
    predict_surface,
    require_silhouette,
    shipped,
)
from experiments.shape_reconstruction.prior.train import main
from harness.basics.errors import DataRefused, FitRefused
from harness.basics.faces.mesh_rays import is_inside
from harness.basics.geometry import rotation_about, transform
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("name", ["mug", "plate", "wrench"])
def test_one_look_is_nearer_than_a_centimetre_to_what_was_never_drawn(name: str) -> None:
    mesh = build(name, 6e-3)
    seen = evidence_of((), look_at(mesh))
    found = predict_surface(seen)
    assert surfaces_apart(found.mesh, mesh, 3000).error.chamfer < 10e-3
    body = trimesh.Trimesh(found.mesh.vertices, found.mesh.faces)
    assert body.is_watertight
    assert body.body_count == 1
    assert np.isfinite(found.deviation).all()
    assert (found.deviation > shipped().held_out).all()
    assert found.not_bounded  # one picture never limits its line of sight


def test_without_a_contact_the_answer_is_by_a_glance_and_with_one_it_is_not() -> None:
    mesh = build("mug", 6e-3)
    seen = evidence_of((), look_at(mesh))
    found = estimated("family", seen)
    assert found.estimator == "glance"
    assert any("picture alone" in flag for flag in found.flags)
    touched = estimated("family", evidence_of(presses(mesh, 1, seed=3), look_at(mesh)))
    assert touched.estimator == "family"


def test_what_is_too_large_for_the_network_is_not_glanced_at() -> None:
    large = build("plate", 6e-3)
    large = Mesh(2.5 * large.vertices, large.faces)
    seen = evidence_of((), look_at(large), largest=0.8)
    with pytest.raises(FitRefused, match="200 mm"):
        predict_surface(seen)
    assert estimated("family", seen).estimator != "glance"


def test_closing_fills_a_ball_and_leaves_a_bowl_open() -> None:
    random = np.random.default_rng(0)
    ball = random.normal(size=(1024, 3))
    ball *= 0.06 / np.linalg.norm(ball, axis=1)[:, None]
    ball[:, 2] += 0.06
    middle = np.array([[0.0, 0.0, 0.045]])
    solid, bowl = closed_around(ball).mesh, closed_around(ball[ball[:, 2] < 0.05]).mesh
    assert is_inside(middle, solid.corners)[0]
    # Walls have a thickness, and nothing is below the support.
    assert np.ptp(solid.bounds, axis=0) == pytest.approx(0.12 + PITCH * np.array([2, 2, 1]), abs=1e-3)
    assert not is_inside(middle, bowl.corners)[0]


def test_a_silhouette_that_it_does_not_understand_makes_it_less_sure() -> None:
    look = look_at(build("mug", 6e-3))
    known = predict_surface(evidence_of((), look))
    odd = look.mask.copy()
    odd[30:90:6] = False  # no household shape is in slices
    strange = predict_surface(evidence_of((), replace(look, mask=odd)))
    assert strange.deviation.min() > known.deviation.max()


def test_a_glance_turns_with_the_bench() -> None:
    look = look_at(build("pitcher", 6e-3))
    turn = transform(rotation_about(UP, 1.1), np.zeros(3))
    turned = replace(look, stand_from_camera=turn @ look.stand_from_camera)
    here = shipped().points(look) @ turn[:3, :3].T
    assert shipped().points(turned) == pytest.approx(here, abs=1e-3)  # a pixel may fall on the other side


def test_without_a_silhouette_there_is_no_glance() -> None:
    look = look_at(build("mug", 6e-3))
    for nothing in (None, replace(look, mask=np.zeros_like(look.mask))):
        with pytest.raises(FitRefused, match="camera"):
            require_silhouette(evidence_of((), nothing))
    with pytest.raises(FitRefused):
        estimated("glance", evidence_of((), None))


def test_the_card_says_what_was_held_out() -> None:
    held, fitted = shipped().card["held_out"], shipped().card["fitted"]
    assert isinstance(held, dict)
    assert isinstance(fitted, dict)
    assert held["sets"] > 200
    assert shipped().held_out < 0.01
    assert shipped().card["profile"] == "long"
    assert shipped().held_out < 1.3 * fitted["mean_chamfer_points_m"]  # it has not learnt by heart
    with pytest.raises(DataRefused, match=r"held_out.*mean_chamfer_points_m"):
        replace(shipped(), card={}).held_out  # noqa: B018 - it is computed


def test_what_another_program_trains_is_refused_by_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--profile", "paper"]) == 2
    assert "experiments.paper.train shape --to FOLDER" in capsys.readouterr().err
    assert main(["--only", "completion"]) == 2
    assert "there is no network completion; there are glance" in capsys.readouterr().err


def test_a_smoke_training_ends_in_a_graph_that_answers_as_torch_does(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="the extra 'author' is not installed")
    from experiments.shape_reconstruction.prior.training import PriorNetwork

    asked = ["--profile", "smoke", "--only", "glance", "--processes", "1", "--device", "cpu"]
    assert main([*asked, "--out", str(tmp_path)]) == 0
    card = (tmp_path / "glance.json").read_text()
    assert json.loads(card)["profile"] == "smoke"
    assert np.isfinite(
        opened((tmp_path / "glance.onnx").read_bytes(), card).points(look_at(build("mug", 9e-3)))
    ).all()
    torch.manual_seed(1)
    module = PriorNetwork()
    windows = (torch.rand((3, 1, SIDE, SIDE)) < 0.4).to(torch.float32)
    with torch.no_grad():
        module.train()(windows)  # so that the normalisation is of something
        wanted = module.eval()(windows)[1].numpy()
    answered = opened(module.graph(), card).network({"window": windows.numpy()})["completed"]
    assert answered.shape == (3, POINTS_GIVEN, 3)
    assert answered == pytest.approx(wanted, abs=1e-2 * float(np.abs(wanted).max()))  # half precision
