"""The paper's completion: what it takes obeys its laws, a folder is opened or refused, rows come of it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import binary_fill_holes

from experiments.paper import shape_table
from experiments.paper.shape_network import (
    DENSE,
    INPUTS,
    SENSES,
    TAKEN,
    PaperCompletion,
    frame_of,
    paper_completions,
    take_points,
)
from experiments.paper.shape_samples import sense_samples
from experiments.paper.shape_table import ROW_NAMES, rows_after, scored_rows
from experiments.paper.train import main
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore.explorer import plan
from experiments.shape_reconstruction.prior.network import (
    NOMINAL_FRAME,
    SIDE,
    CameraYaw,
    PointFrame,
    window_of,
    window_points,
)
from experiments.shape_reconstruction.smooth.free_space import all_samples
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused, FitRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import rotation_about, transform
from harness.bench.scene import scene_from_json
from harness.bench.station_file import Station
from harness.objectfile.graph import Nodes, float_value
from harness.objects.builtin import build
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses

MUG = build("mug", 6e-3)
TOUCHES = presses(MUG, 12, seed=3)
LOOK = look_at(MUG)
BOTH = evidence_of(TOUCHES, LOOK)


def echoing(sense: str) -> bytes:
    """A graph that gives back what was touched, again and again; without, the share of a window seen."""
    nodes = Nodes()
    if "touched" in dict(INPUTS[sense]):
        nodes.add("Concat", *["touched"] * (DENSE // TAKEN), axis=1, name="completed")
    else:
        mean = nodes.add("ReduceMean", "window", axes=[1, 2, 3], keepdims=1)
        flat = nodes.add("Reshape", mean, nodes.constant(np.array([-1, 1, 1], np.int64)))
        nodes.add("Add", flat, nodes.constant(np.zeros((1, DENSE, 3), np.float32)), name="completed")
    inputs = [float_value(name, ("n", *shape)) for name, shape in INPUTS[sense]]
    outputs = [float_value("completed", ("n", DENSE, 3))]
    return bytes(nodes.model(sense, inputs, outputs, "echo").SerializeToString())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for sense in INPUTS:
        (tmp_path / f"{sense}.onnx").write_bytes(echoing(sense))
        (tmp_path / f"{sense}.json").write_text("{}")
    return tmp_path


def networks_in(folder: Path) -> dict[str, PaperCompletion]:
    return {network.sense: network for network in paper_completions(folder)}


def turned_about(evidence: ShapeEvidence, angle: float) -> ShapeEvidence:
    """The same bench, object and camera, turned about the vertical through the place of the object."""
    turn = transform(rotation_about(np.array([0.0, 0.0, 1.0]), angle), np.zeros(3))
    touches = tuple(
        replace(
            one,
            stand_from_gel=turn @ one.stand_from_gel,
            points=one.points @ turn[:3, :3].T,
            normals=one.normals @ turn[:3, :3].T,
        )
        for one in evidence.touches
    )
    look = evidence.look
    assert look is not None
    return replace(
        evidence, touches=touches, look=replace(look, stand_from_camera=turn @ look.stand_from_camera)
    )


def by_rays(frame: PointFrame, turned: CameraYaw) -> BoolArray:
    """``(SIDE, SIDE)``: where the window's rays meet the mug itself."""
    eye = turned.inward(LOOK.stand_from_camera[:3, 3][None])[0]
    ways = turned.outward(window_points(frame, eye) - eye)
    hits = RayMesh(MUG).first_hits(np.tile(LOOK.stand_from_camera[:3, 3], (len(ways), 1)), ways)
    return np.asarray(binary_fill_holes(np.isfinite(hits.distance).reshape(SIDE, SIDE)))


@pytest.mark.parametrize("touched", [False, True])
def test_a_window_shows_the_object_from_where_the_camera_is(touched: bool) -> None:
    turned = CameraYaw.towards(LOOK)
    frame = frame_of(turned.inward(all_samples(BOTH).points)) if touched else NOMINAL_FRAME
    filled = replace(LOOK, mask=np.asarray(binary_fill_holes(LOOK.mask)))
    found = window_of(filled, frame, turned)[0]
    wanted = by_rays(frame, turned)
    assert found.shape == (SIDE, SIDE)
    assert (found != wanted).sum() < 0.06 * wanted.sum()
    x, y, z = turned.inward(LOOK.stand_from_camera[:3, 3][None])[0]
    assert (y, z) == (pytest.approx(0.0, abs=1e-12), LOOK.stand_from_camera[2, 3])
    assert x > 0.0


def test_what_lies_beyond_the_picture_is_not_seen() -> None:
    narrow = replace(LOOK, mask=np.ones((4, 4), bool), hidden=np.zeros((4, 4), bool))
    assert 0 < window_of(narrow, NOMINAL_FRAME, CameraYaw.towards(LOOK)).sum() < 40


@pytest.mark.parametrize("angle", [0.7, -2.5])
def test_an_answer_turns_with_the_bench(folder: Path, angle: float) -> None:
    networks, turn = networks_in(folder), rotation_about(np.array([0.0, 0.0, 1.0]), angle)
    there = turned_about(BOTH, angle)
    for sense, abs_m in (("touch", 1e-6), ("picture", 2e-3), ("both", 1e-6)):
        here = networks[sense].complete(BOTH) @ turn.T
        assert networks[sense].complete(there) == pytest.approx(here, abs=abs_m)


def test_a_network_that_echoes_gives_the_touched_places_back(folder: Path) -> None:
    networks, points = networks_in(folder), take_points(all_samples(BOTH).points)
    for sense in ("touch", "both"):
        found = networks[sense].complete(BOTH)
        assert found.shape == (DENSE, 3)
        assert found[:TAKEN] == pytest.approx(points, abs=1e-6)


def test_a_sense_that_is_not_there_is_refused_by_name(folder: Path) -> None:
    networks = networks_in(folder)
    for sense in ("picture", "both"):
        with pytest.raises(FitRefused, match="camera"):
            networks[sense].complete(replace(BOTH, look=None))
    for sense in ("touch", "both"):
        with pytest.raises(FitRefused, match="0 touches"):
            networks[sense].complete(replace(BOTH, touches=()))
    assert np.isfinite(networks["picture"].complete(replace(BOTH, touches=()))).all()


def test_a_folder_without_a_network_or_a_card_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DataRefused, match=r"experiments\.paper\.train shape --to FOLDER"):
        paper_completions(tmp_path / "none")
    (folder / "touch.json").unlink()
    with pytest.raises(DataRefused, match=r"touch\.onnx .*shape --to FOLDER"):
        paper_completions(folder)


def test_rows_of_the_networks_that_are_there_stand_in_the_table(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [row.name for row in rows_after(32, SENSES.values())]
    assert [name for name in ROW_NAMES if name in names] == names
    assert {"pcn as published, T32", "pcn as published, V", "pcn as published, TV2"} <= set(names)
    assert not any("published" in row.name for row in rows_after(32))
    monkeypatch.setattr(shape_table, "TABLED", {})
    networks = networks_in(folder)
    rows = scored_rows(BOTH, MUG, len(TOUCHES), [networks["touch"]])
    found = [name for name in rows if "published" in name]
    assert found == ["pcn as published, T8", "pcn as published, T12"]
    assert 0.0 < rows[found[1]]["accuracy_m"] < 2e-3 < rows[found[1]]["completeness_m"]


@pytest.mark.parametrize("key", ["library", "pcn"])
def test_a_run_refuses_folders_that_only_a_table_uses(key: str, station: Station) -> None:
    tree = {"schema": 1, "object": {"mesh": "builtin:mug"}, "shape": {key: "somewhere"}}
    with pytest.raises(WrongUse, match=f"--set {key}=FOLDER"):
        plan(scene_from_json(tree, "mug"), station, MUG, 0)


@pytest.mark.parametrize("sense", list(INPUTS))
def test_samples_are_the_same_again_and_in_one_frame(sense: str) -> None:
    one, again = (sense_samples(sense, 2, 2, 3, 1) for _ in range(2))
    for name, shape in INPUTS[sense]:
        assert np.array_equal(one.inputs[name], again.inputs[name])
        assert one.inputs[name].shape[1:] == shape
    whole: list[FloatArray] = list(one.whole)
    if sense != "picture":
        for touched, everywhere in zip(one.inputs["touched"], whole, strict=True):
            apart = np.linalg.norm(touched[::64, None] - everywhere[None], axis=2).min(axis=1)
            assert float(np.median(apart)) < 0.05
    if sense != "touch":
        assert all(0.0 < window.mean() < 0.9 for window in one.inputs["window"])


def test_what_cannot_be_trained_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shape"]) == 2
    assert "--to FOLDER" in capsys.readouterr().err
    assert main(["shape", "--only", "glance", "--out", str(tmp_path)]) == 2
    assert "touch, picture, both" in capsys.readouterr().err


@pytest.mark.parametrize("sense", list(INPUTS))
def test_a_graph_answers_as_torch_does(sense: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="the extra 'author' is not installed")
    from experiments.paper.shape_training import PaperCompletionNetwork

    torch.set_num_threads(1)
    torch.manual_seed(2)
    module = PaperCompletionNetwork(sense)
    given = [torch.randn((2, *shape)) for _, shape in INPUTS[sense]]
    with torch.no_grad():
        module.train()(*given)  # so that the normalisation is of something
        clouds, dense = module.eval()(*given)
    assert all(cloud.shape == (2, module.coarse, 3) for cloud in clouds)
    (tmp_path / f"{sense}.onnx").write_bytes(module.graph())
    (tmp_path / f"{sense}.json").write_text(json.dumps({}))
    values = {name: one.numpy() for (name, _), one in zip(INPUTS[sense], given, strict=True)}
    found = networks_in(tmp_path)[sense].network(values)["completed"]
    assert found == pytest.approx(dense.numpy(), abs=2e-2 * float(dense.abs().max()))  # half precision
