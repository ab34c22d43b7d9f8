"""The look of an ObjectFile: what is written is what is drawn, and damage is found where it is."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import load_model_from_string, numpy_helper

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objectfile.surface_file import ply_bytes
from harness.objectfile.verify import verify
from harness.objectfile.vision.network import VisionGrid
from harness.objectfile.vision.part import VisionPart, with_vision
from harness.objectfile.vision.render import VisionRenderer, open_vision
from harness.picture.pinhole import DirectionalLight
from tests.oracles.plain_look import even_look, file_of, looking
from tests.oracles.seen_shapes import cuboid
from tests.samples.look_bench import BOX, LOGITS, box_file, box_look, box_part, told_look
from tests.samples.object_bench import exchange, rewrite

LIGHT = DirectionalLight(np.array([0.3, -0.4, 0.8]))


@pytest.fixture(scope="module")
def box_object(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only."""
    return box_file(tmp_path_factory.mktemp("objects") / "box")


@pytest.fixture
def spoiled(box_object: ObjectFile, tmp_path: Path) -> Path:
    shutil.copytree(box_object.folder, tmp_path / "box")
    return tmp_path / "box"


def failures(of: ObjectFile) -> dict[str, str]:
    return {check.check: check.said for check in verify(of) if not check.passed}


def test_a_look_as_it_was_built_passes_every_check(box_object: ObjectFile) -> None:
    checks = verify(ObjectFile.open(box_object.folder))
    assert all(check.passed for check in checks), checks
    assert [check.check for check in checks] == [
        *(f"{name}: bytes" for name in ("mesh.ply", "vision.onnx")),
        *("folder: nothing else", "mesh", "vision: graph", "vision: domain", "vision: self-test"),
        *("vision: networks", "vision: networks and surface"),
    ]


def test_what_is_opened_draws_what_was_written(box_object: ObjectFile) -> None:
    vision, camera = open_vision(ObjectFile.open(box_object.folder), 1), looking(BOX, 2.0, 24)
    found = vision.picture(camera, LIGHT).image
    direct = VisionRenderer(file_of(box_look()), BOX, 1).render(camera, LIGHT).image
    np.testing.assert_array_equal(found.colour, direct.colour)
    np.testing.assert_array_equal(found.depth, direct.depth)
    inside = found.alpha > 0.999
    assert inside.any()
    wanted = np.broadcast_to(1.0 / (1.0 + np.exp(-np.array(LOGITS))), found.colour[inside].shape)
    np.testing.assert_allclose(found.colour[inside] / found.alpha[inside][:, None], wanted, atol=1e-5)


def test_object_json_says_how_its_numbers_are_meant(box_object: ObjectFile) -> None:
    entry = box_object.description.vision
    assert entry is not None
    assert (entry.metres_per_unit, entry.level, entry.colour) == (1.0, "osf", "linear, sRGB primaries")
    assert [tensor.name for tensor in entry.network.outputs] == ["density", "scattered"]
    assert [kept.name for kept in entry.network.self_test.outputs] == ["density", "scattered"]
    low, high = entry.grid.box
    assert (np.array(low) <= BOX.bounds[0]).all()
    assert (np.array(high) >= BOX.bounds[1]).all()
    assert box_object.description.files_of(("audio",)) == (box_object.description.mesh,)


def test_the_same_look_is_the_same_bytes(box_object: ObjectFile, tmp_path: Path) -> None:
    again = box_file(tmp_path / "box")
    for name in ("object.json", "vision.onnx"):
        assert (again.folder / name).read_bytes() == (box_object.folder / name).read_bytes()


def test_networks_that_are_told_more_are_verified_as_such(tmp_path: Path) -> None:
    of = box_file(tmp_path / "box", told_look())
    entry = of.description.vision
    assert entry is not None
    assert entry.level == "osf-v"
    assert not failures(of)


def test_a_surface_of_its_own_is_kept_and_drawn_along(box_object: ObjectFile, tmp_path: Path) -> None:
    """Of a hollow thing's file, for instance, whose mesh is the walled solid."""
    shutil.copytree(box_object.folder, tmp_path / "box")
    outside = Mesh(BOX.vertices * 1.02, BOX.faces)
    of = with_vision(ObjectFile.open(tmp_path / "box"), replace(box_part(), surface=outside))
    vision, camera = open_vision(of, 1), looking(BOX, 2.0, 48)
    assert np.array_equal(vision.surface.vertices, outside.vertices)
    assert not failures(of)
    drawn, before = (
        each.picture(camera, LIGHT).image.alpha.sum() for each in (vision, open_vision(box_object))
    )
    assert drawn / before == pytest.approx(1.02**2, rel=0.01)
    (of.folder / "vision_surface.ply").write_bytes(ply_bytes(BOX))
    with pytest.raises(DataRefused, match="vision_surface"):
        open_vision(ObjectFile.open(of.folder))


def test_a_changed_file_is_refused(spoiled: Path) -> None:
    data = bytearray((spoiled / "vision.onnx").read_bytes())
    data[-1] ^= 1
    (spoiled / "vision.onnx").write_bytes(data)
    with pytest.raises(DataRefused, match="sha256"):
        open_vision(ObjectFile.open(spoiled))
    assert "vision.onnx: bytes" in failures(ObjectFile.open(spoiled))


def test_a_pickle_in_its_place_is_no_graph(spoiled: Path) -> None:
    of = exchange(spoiled, "vision.onnx", b"\x80\x04cos\nsystem\n(S'true'\ntR.")
    found = failures(of)
    assert {"vision: graph", "vision: networks"} <= set(found)
    assert "is not" in found["vision: graph"]
    with pytest.raises(DataRefused):
        open_vision(of)


def test_networks_of_another_object_are_told_by_looking(spoiled: Path, box_object: ObjectFile) -> None:
    """Of the right grid and the right size, so that only a picture can tell."""
    empty = exchange(spoiled, "vision.onnx", file_of(box_look(1e-3)))

    def say(tree: dict[str, Any]) -> None:
        tree["vision"]["density_per_m"] = float(np.float32(1e-3))

    found = failures(rewrite(empty.folder, say))
    assert set(found) == {"vision: self-test", "vision: networks and surface"}
    assert "network" in found["vision: networks and surface"]
    small = surface_cells(cuboid(0.05, 0.05, 0.05), 8)
    with pytest.raises(DataRefused, match=r"\d%.* mm"):
        with_vision(box_object, box_part(even_look(small, 1e6, LOGITS)))


def test_a_graph_that_computes_something_else_is_told(spoiled: Path) -> None:
    model = load_model_from_string((spoiled / "vision.onnx").read_bytes())
    last = next(node for node in model.graph.node if node.op_type == "Sigmoid")
    last.op_type = "Tanh"
    of = exchange(spoiled, "vision.onnx", model.SerializeToString())
    assert "vision: self-test" in failures(of)
    with pytest.raises(DataRefused, match=r"vision\.onnx .*onnxruntime"):
        open_vision(of)


def test_weights_that_are_not_finite_are_refused(spoiled: Path) -> None:
    model = load_model_from_string((spoiled / "vision.onnx").read_bytes())
    kept = next(each for each in model.graph.initializer if each.name == "networks.colour")
    array = numpy_helper.to_array(kept).copy()
    array[0, 0, 0] = np.nan
    kept.CopyFrom(numpy_helper.from_array(array, kept.name))
    found = failures(exchange(spoiled, "vision.onnx", model.SerializeToString()))
    assert "finite" in found["vision: graph"]


def test_networks_on_another_grid_are_not_those_described(spoiled: Path) -> None:
    grid = surface_cells(BOX, 8)
    moved = VisionGrid(grid.low + 1e-4, grid.cell, grid.cells)
    of = exchange(spoiled, "vision.onnx", file_of(even_look(moved, 1e6, LOGITS)))
    with pytest.raises(DataRefused, match=r"m: .*object\.json"):
        open_vision(of)
    assert "vision: networks" in failures(of)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda vision: vision.update(metres_per_unit=0.001), "metres_per_unit"),
        (lambda vision: vision.update(level="osf-v"), "extras|the number"),
        (lambda vision: vision["grid"].update(networks=7), "network"),
        (lambda vision: vision["grid"].update(cell_m=0.02), "points"),
        (lambda vision: vision["grid"].update(cell_m=0.0), "cell_m"),
        (lambda vision: vision["size"].update(block=16), "points"),
        (lambda vision: vision["network"]["inputs"][1].update(unit="mm"), "points"),
        (lambda vision: vision.update(camera="OpenGL"), "camera"),
        (lambda vision: vision.update(gamma=2.2), "gamma"),
        (lambda vision: vision["network"]["outputs"].pop(), "self_test|number"),
    ],
)
def test_a_description_that_contradicts_itself_is_refused(spoiled: Path, change: Any, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        rewrite(spoiled, lambda tree: change(tree["vision"]))


def test_an_object_without_a_look_says_how_to_make_one(egg_object: ObjectFile) -> None:
    with pytest.raises(DataRefused, match="--only vision"):
        open_vision(egg_object)


def test_a_camera_within_the_material_is_refused_and_one_beside_it_is_not(box_object: ObjectFile) -> None:
    vision = open_vision(box_object, 1)
    for away in (0.0, 0.02, 0.0399):
        camera = looking(BOX, 2.0, 8)
        pose = camera.object_from_camera.copy()
        pose[:3, 3] = (0.0, away, 0.0)
        with pytest.raises(OutOfDomain, match=r"\(.*\) mm.* mm"):
            vision.picture(replace(camera, object_from_camera=pose), LIGHT)
        pose[:3, 3] = (0.0, 0.0401 + away, 0.0)
        vision.picture(replace(camera, object_from_camera=pose), LIGHT)


def test_parts_that_cannot_be_written_are_refused(box_object: ObjectFile) -> None:
    part: VisionPart = box_part()
    with pytest.raises(WrongUse):
        with_vision(box_object, replace(part, block=0))
