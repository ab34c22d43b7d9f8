"""The touch of an ObjectFile: its levels agree, its domain holds, and damage is found where it is."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.bench.named_files import SHIPPED
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.nodes import SurfaceNodes, nodes_bytes, nodes_from
from harness.objectfile.touch.touch import CodeMaps, open_touch
from harness.objectfile.verify import check_codes, verify
from harness.sim.gel.press_pose import Presses
from tests.samples import touch_bench as tb
from tests.samples.object_bench import exchange, rewrite


@pytest.fixture(scope="module")
def peg_object(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only."""
    return tb.peg_file(tmp_path_factory.mktemp("objects") / "peg")


@pytest.fixture
def spoiled_peg(peg_object: ObjectFile, tmp_path: Path) -> Path:
    shutil.copytree(peg_object.folder, tmp_path / "peg")
    return tmp_path / "peg"


def presses(count: int = 6) -> Presses:
    nodes = tb.coded().nodes
    chosen = np.linspace(0, len(nodes) - 1, count).astype(np.int64)
    some = np.linspace(0.0, 1.0, count)
    return Presses(
        nodes.points[chosen], nodes.normals[chosen], 1e-3 + 5e-4 * some, 0.2 * some, 6.0 * some, 3.0 * some
    )


def failures(of: ObjectFile) -> dict[str, str]:
    return {check.check: check.said for check in verify(of) if not check.passed}


def test_a_touch_as_it_was_built_passes_every_check(peg_object: ObjectFile) -> None:
    checks = verify(peg_object)
    assert all(check.passed for check in checks), checks
    assert [check.check for check in checks] == [
        *(f"{name}: bytes" for name in ("mesh.ply", "touch.onnx", "touch_nodes.npy")),
        *("folder: nothing else", "mesh", "touch: graph", "touch: domain", "touch: self-test"),
        "touch: codes and mesh",
    ]


@pytest.mark.parametrize("name", ["mug", "plate"])
def test_shipped_objects_have_codes_that_agree_with_their_meshes(name: str) -> None:
    """Where the far wall of a mug is in the sensor's way too."""
    of = ObjectFile.open(SHIPPED / "objects" / name)
    touch = of.description.touch
    assert touch is not None
    assert touch.codes is not None
    assert "in the median of 16 presses" in check_codes(of, touch.codes)


def test_codes_and_reference_are_levels_of_one_quantity(peg_object: ObjectFile) -> None:
    codes, reference = open_touch(ObjectFile.open(peg_object.folder)), open_touch(peg_object, "reference")
    found, truth = codes.at(presses()), reference.at(presses())
    assert found.shape == truth.shape == (6, tb.SENSOR.rows, tb.SENSOR.columns)
    assert np.sqrt(((found - truth) ** 2).mean()) < 5e-5
    assert codes.entry.gel.sensor == tb.SENSOR
    assert codes.entry.gel.skirt == tb.SKIRT


@pytest.mark.parametrize("level", ["codes", "reference"])
def test_no_presses_give_no_maps(peg_object: ObjectFile, level: Any) -> None:
    touch, none = open_touch(peg_object, level), presses()[:0]
    for found in (touch.at(none), touch.maps(none)):
        assert found.shape == (0, tb.SENSOR.rows, tb.SENSOR.columns)


def test_a_graph_asked_for_some_inputs_and_not_others_says_so(peg_object: ObjectFile) -> None:
    touch = open_touch(peg_object, "codes")
    assert isinstance(touch.maps, CodeMaps)
    asked = touch.maps.nodes.queries(presses())
    with pytest.raises(DataRefused, match="onnxruntime"):
        touch.maps.network({name: array[:0] for name, array in asked.items() if name == "node"})
    with pytest.raises(DataRefused, match="onnxruntime"):
        touch.maps.network({name: array[: 0 if name == "node" else None] for name, array in asked.items()})


@pytest.mark.parametrize("level", ["codes", "reference"])
def test_what_a_touch_was_not_made_for_is_refused_and_not_clamped(peg_object: ObjectFile, level: Any) -> None:
    touch, asked = open_touch(peg_object, level), presses()
    for depth in (2.51e-3, -1e-5):
        with pytest.raises(OutOfDomain, match=r"0 to 2\.5 mm"):
            touch.at(replace(asked, depths=np.full(6, depth)))
    with pytest.raises(OutOfDomain, match="0 to 26 deg"):
        touch.at(replace(asked, tilts=np.full(6, np.radians(26.1))))
    with pytest.raises(OutOfDomain, match=" mm"):
        touch.at(replace(asked, points=asked.points + 0.01))
    for depth in (0.0, 2.5e-3):
        touch.at(replace(asked, depths=np.full(6, depth), tilts=np.full(6, np.radians(26.0))))


def test_a_press_as_deep_and_as_leant_as_may_be_is_felt_as_on_the_mesh(peg_object: ObjectFile) -> None:
    """As near as one that is upright: a press is a motion, of which codes learn nothing."""
    asked = replace(presses(), depths=np.full(6, 2.5e-3), tilts=np.full(6, np.radians(26.0)))
    found, truth = (open_touch(peg_object, level).at(asked) for level in ("codes", "reference"))
    assert np.sqrt(((found - truth) ** 2).mean()) < 1e-4


def test_a_press_with_the_normal_of_another_place_is_refused(peg_object: ObjectFile) -> None:
    asked = presses()
    with pytest.raises(OutOfDomain, match=r"press_pose\.contact_place"):
        open_touch(peg_object).at(replace(asked, normals=-asked.normals))


def test_levels_that_are_not_there_are_said(peg_object: ObjectFile, egg_object: ObjectFile) -> None:
    with pytest.raises(DataRefused, match="--only touch"):
        open_touch(egg_object)
    wrong: Any = "fine"
    with pytest.raises(WrongUse, match=r"'fine'.*codes.*reference"):
        open_touch(peg_object, wrong)


@pytest.mark.parametrize("alone", [False, True], ids=["beside codes", "alone"])
def test_an_object_with_the_perceptron_of_an_earlier_version_still_opens(
    spoiled_peg: Path, alone: bool
) -> None:
    shutil.copy(spoiled_peg / "touch.onnx", spoiled_peg / "touch_perceptron.onnx")
    if alone:
        for name in ("touch.onnx", "touch_nodes.npy"):
            (spoiled_peg / name).unlink()

    def add_perceptron(tree: dict[str, Any]) -> None:
        touch = tree["touch"]
        touch["perceptron"] = {**touch["codes"]["network"], "file": "touch_perceptron.onnx"}
        touch["codes"] = None if alone else touch["codes"]

    of = rewrite(spoiled_peg, add_perceptron)
    assert not failures(of)
    assert open_touch(of, "reference").at(presses()).any()
    if alone:
        with pytest.raises(DataRefused, match=r"perceptron.*--only touch"):
            open_touch(of)
    else:
        assert open_touch(of).at(presses()).any()
    (of.folder / "touch_perceptron.onnx").write_bytes(b"changed")
    assert set(failures(of)) == {"touch_perceptron.onnx: bytes"}


def test_a_touch_of_nothing_is_no_touch(spoiled_peg: Path) -> None:
    with pytest.raises(DataRefused, match="perceptron"):
        rewrite(spoiled_peg, lambda tree: tree["touch"].update(codes=None))


@pytest.mark.parametrize("name", ["touch.onnx", "touch_nodes.npy"])
def test_a_changed_file_is_refused(spoiled_peg: Path, name: str) -> None:
    data = bytearray((spoiled_peg / name).read_bytes())
    data[-1] ^= 1
    (spoiled_peg / name).write_bytes(data)
    with pytest.raises(DataRefused, match="sha256"):
        open_touch(ObjectFile.open(spoiled_peg))
    assert f"{name}: bytes" in failures(ObjectFile.open(spoiled_peg))


def test_nodes_of_another_order_are_told_by_pressing(spoiled_peg: Path) -> None:
    nodes = tb.coded().nodes
    other = nodes_bytes(SurfaceNodes(nodes.points[::-1], nodes.normals[::-1]))
    found = failures(exchange(spoiled_peg, "touch_nodes.npy", other))
    assert set(found) == {"touch: codes and mesh"}
    assert "different objects" in found["touch: codes and mesh"]


def test_nodes_of_another_number_are_refused(spoiled_peg: Path) -> None:
    nodes = tb.coded().nodes
    of = exchange(spoiled_peg, "touch_nodes.npy", nodes_bytes(nodes[np.arange(5)]))
    with pytest.raises(DataRefused, match="5 nodes"):
        open_touch(of)


def test_a_description_that_contradicts_itself_is_refused(spoiled_peg: Path) -> None:
    def narrow(tree: dict[str, Any]) -> None:
        tree["touch"]["gel"]["rows"] = 23

    with pytest.raises(DataRefused, match=r"\b23\b"):
        rewrite(spoiled_peg, narrow)

    def turn(tree: dict[str, Any]) -> None:
        tree["touch"]["gel"]["rows"] = tb.SENSOR.rows
        tree["touch"]["depth_m"] = [2e-3, 5e-4]

    with pytest.raises(DataRefused, match="depth_m"):
        rewrite(spoiled_peg, turn)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"no array", ".npy"),
        (nodes_bytes(SurfaceNodes(np.zeros((2, 3)), np.eye(3)[:2]))[:-8], "bytes"),
        (nodes_bytes(SurfaceNodes(np.full((2, 3), np.nan), np.eye(3)[:2])), "finite"),
        (nodes_bytes(SurfaceNodes(np.zeros((2, 3)), np.ones((2, 3)))), "length 1"),
        (nodes_bytes(SurfaceNodes(np.zeros((0, 3)), np.zeros((0, 3)))), r"float64 \(n, 6\)"),
    ],
)
def test_a_file_that_holds_no_nodes_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        nodes_from(data, "touch_nodes.npy")
