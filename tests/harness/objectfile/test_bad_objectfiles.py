"""Bad ObjectFiles are refused in one sentence, wherever their networks are opened."""

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import ModelProto, TensorProto, numpy_helper

from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.materials import MATERIALS
from harness.bench.scene import scene_from_options
from harness.effects.scene_object import known_file, known_object
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.touch.tool_depth import open_tool_depth
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.vision.render import open_vision
from tests.oracles.seen_shapes import cuboid
from tests.samples import touch_bench as tb
from tests.samples.look_bench import box_file
from tests.samples.object_bench import PROVENANCE, egg_file, exchange, rewrite


@dataclass(frozen=True)
class Sense:
    """A part of an ObjectFile: who writes one, who opens it, and where its network is."""

    make: Callable[[Path], ObjectFile]
    opened: tuple[Callable[[ObjectFile], Any], ...]
    network: str


SENSES = {
    "audio": Sense(egg_file, (open_audio,), "audio.onnx"),
    "touch": Sense(tb.peg_file, (open_touch, open_tool_depth), "touch.onnx"),
    "vision": Sense(box_file, (open_vision,), "vision.onnx"),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """Read only, by sense."""
    folder = tmp_path_factory.mktemp("objects")
    return {name: sense.make(folder / name).folder for name, sense in SENSES.items()}


@pytest.fixture(params=list(SENSES))
def sense(request: pytest.FixtureRequest) -> str:
    found: str = request.param
    return found


@pytest.fixture
def copy(whole: Mapping[str, Path], sense: str, tmp_path: Path) -> Path:
    """To be spoiled."""
    shutil.copytree(whole[sense], tmp_path / sense)
    return tmp_path / sense


def refused(folder: Path, sense: str, said: str) -> None:
    """By everything that opens the network, in one sentence."""
    for opened in SENSES[sense].opened:
        with pytest.raises(TouchstoneError, match=said) as caught:
            opened(ObjectFile.open(folder))
        assert "\n" not in str(caught.value)


def graph_of(folder: Path, sense: str) -> ModelProto:
    return onnx.load_model_from_string((folder / SENSES[sense].network).read_bytes())


def changed(folder: Path, sense: str, change: Callable[[TensorProto], None]) -> None:
    """Its network with other numbers in its greatest tensor, hash and all."""
    graph = graph_of(folder, sense)
    floats = [each for each in graph.graph.initializer if numpy_helper.to_array(each).dtype.kind == "f"]
    change(max(floats, key=lambda each: numpy_helper.to_array(each).size))
    exchange(folder, SENSES[sense].network, graph.SerializeToString())


def test_as_they_were_written_they_open(whole: Mapping[str, Path], sense: str) -> None:
    for opened in SENSES[sense].opened:
        opened(ObjectFile.open(whole[sense]))


def test_another_hash(copy: Path, sense: str) -> None:
    path = copy / SENSES[sense].network
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    refused(copy, sense, "sha256")


def test_a_missing_file(copy: Path, sense: str) -> None:
    (copy / SENSES[sense].network).unlink()
    refused(copy, sense, SENSES[sense].network)


def test_a_missing_part(copy: Path, sense: str) -> None:
    rewrite(copy, lambda tree: tree.update({sense: None}))
    refused(copy, sense, f"--only {sense}")


def test_weights_that_are_no_numbers(copy: Path, sense: str) -> None:
    def spoil(tensor: TensorProto) -> None:
        array = numpy_helper.to_array(tensor).copy()
        array.flat[0] = np.nan
        tensor.CopyFrom(numpy_helper.from_array(array, tensor.name))

    changed(copy, sense, spoil)
    refused(copy, sense, "finite")


def test_numbers_in_another_file(copy: Path, sense: str) -> None:
    def move(tensor: TensorProto) -> None:
        (copy / "weights.bin").write_bytes(tensor.raw_data)
        onnx.external_data_helper.set_external_data(tensor, "weights.bin")
        tensor.ClearField("raw_data")
        tensor.data_location = TensorProto.EXTERNAL

    changed(copy, sense, move)
    refused(copy, sense, "another file")


def test_a_file_outside_of_the_folder(copy: Path, sense: str) -> None:
    path = copy / SENSES[sense].network
    shutil.move(path, copy.parent / path.name)
    path.symlink_to(copy.parent / path.name)
    refused(copy, sense, str(copy.parent / path.name))


def test_a_name_that_leaves_the_folder(copy: Path, sense: str) -> None:
    def leave(tree: Any) -> None:
        for key, item in tree.items():
            if item == SENSES[sense].network:
                tree[key] = f"../{item}"
            elif isinstance(item, dict):
                leave(item)

    with pytest.raises(DataRefused, match=r"object\.json"):
        rewrite(copy, leave)
    assert f"../{SENSES[sense].network}" in (copy / "object.json").read_text()
    refused(copy, sense, "object.json")


def test_a_schema_of_the_future(copy: Path, sense: str) -> None:
    path = copy / "object.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"schema": 2}))
    refused(copy, sense, "schema 2.* 1")


@pytest.mark.parametrize("sense", ["audio", "touch"])
def test_another_objects_network_of_the_same_size(copy: Path, sense: str) -> None:
    """Its hash is right, and so are its inputs and outputs: only its answers are another's."""

    def turn(tensor: TensorProto) -> None:
        array = numpy_helper.to_array(tensor)
        tensor.CopyFrom(numpy_helper.from_array(np.ascontiguousarray(array[::-1]), tensor.name))

    changed(copy, sense, turn)
    refused(copy, sense, "onnxruntime")


@pytest.mark.parametrize("sense", ["vision"])
def test_a_look_of_the_same_size_in_other_colours(copy: Path, sense: str) -> None:
    graph = graph_of(copy, sense)
    (bias,) = (each for each in graph.graph.initializer if each.name == "networks.colour_bias")
    turned = numpy_helper.to_array(bias)[..., ::-1].copy()
    bias.CopyFrom(numpy_helper.from_array(turned, bias.name))
    exchange(copy, SENSES[sense].network, graph.SerializeToString())
    refused(copy, sense, "onnxruntime")


@pytest.mark.parametrize("sides", [(0.12, 0.1, 0.08), (0.05, 0.04, 0.03)], ids=["larger", "smaller"])
def test_another_objects_part(
    whole: Mapping[str, Path], sense: str, sides: tuple[float, float, float], tmp_path: Path
) -> None:
    """All of it, with what object.json says of it: only the surface beside it is another."""
    host = create_object(tmp_path / "host", "host", cuboid(*sides), MATERIALS["wood"], PROVENANCE).folder
    part = json.loads((whole[sense] / "object.json").read_text())[sense]
    for path in whole[sense].glob(f"{sense}*"):
        shutil.copy(path, host / path.name)
    rewrite(host, lambda tree: tree.update({sense: part}))
    refused(host, sense, "another object|different objects")


def test_a_run_refuses_it_before_anything_moves(copy: Path, sense: str) -> None:
    path = copy / "mesh.ply"
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    with pytest.raises(DataRefused, match=r"mesh\.ply .*sha256"):
        known_object(scene_from_options(str(copy)))


def test_a_scene_refuses_an_objectfile_of_another_object(whole: Mapping[str, Path], sense: str) -> None:
    scene = scene_from_options("builtin:bowl", objectfile=str(whole[sense]))
    with pytest.raises(TouchstoneError, match=r"x .*y .*z .* mm") as caught:
        known_file(scene, known_object(scene).mesh)
    assert "\n" not in str(caught.value)
