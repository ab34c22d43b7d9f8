"""Verifying finds each kind of damage in its own check, and says what to do; a sound object passes all."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper, load_model_from_string, numpy_helper

from harness.authoring.audio.audio import waves_graph
from harness.basics.errors import DataRefused
from harness.basics.files.lock_file import hold_folder
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.entries import Domain, Input, NetworkEntry, Sampled, SelfTest, Tensor, Whole
from harness.objectfile.file import ObjectFile, file_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.self_test import open_network
from harness.objectfile.surface_file import ply_bytes
from harness.objectfile.verify import check_domain, check_self_test, verify
from tests.samples.object_bench import MODES, egg, egg_waves, exchange, rewrite

SAMPLES = Path(__file__).parent / "samples"


def failures(of: ObjectFile) -> dict[str, str]:
    return {check.check: check.said for check in verify(of) if not check.passed}


def test_an_object_as_it_was_built_passes_every_check(egg_object: ObjectFile) -> None:
    checks = verify(egg_object)
    assert all(check.passed for check in checks), checks
    assert [check.check for check in checks] == [
        *(f"{name}: bytes" for name in ("mesh.ply", "audio.onnx", "audio_table.npy", "audio_surface.ply")),
        *("folder: nothing else", "mesh"),
        *("audio: graph", "audio: domain", "audio: self-test", "audio: table"),
        "audio: network and table",
    ]


@pytest.mark.parametrize("sample", sorted(SAMPLES.iterdir()), ids=lambda path: path.name)
def test_an_object_of_every_schema_so_far_is_read_and_verified(sample: Path) -> None:
    """A sample is written once, when its schema is new, and never again."""
    of = ObjectFile.open(sample)
    assert not failures(of)
    assert open_audio(of, "network").at(of.mesh.vertices[:2]).shape == (2, MODES, 3)


def test_a_changed_file_fails_and_the_rest_is_still_looked_at(spoiled: Path) -> None:
    data = bytearray((spoiled / "audio_table.npy").read_bytes())
    data[-1] ^= 1
    (spoiled / "audio_table.npy").write_bytes(data)
    found = failures(ObjectFile.open(spoiled))
    assert set(found) == {"audio_table.npy: bytes", "audio: table", "audio: network and table"}
    assert "audio_table.npy" in found["audio_table.npy: bytes"]


def test_a_missing_network_fails_where_it_is_used(spoiled: Path) -> None:
    (spoiled / "audio.onnx").unlink()
    users = {f"audio: {check}" for check in ("graph", "domain", "self-test", "network and table")}
    assert set(failures(ObjectFile.open(spoiled))) == {"audio.onnx: bytes"} | users


def test_a_file_that_nothing_names_is_pointed_at(spoiled: Path) -> None:
    (spoiled / "audio.onnx.data").write_bytes(b"weights")
    assert "audio.onnx.data" in failures(ObjectFile.open(spoiled))["folder: nothing else"]


def test_the_lock_of_a_build_is_not_a_foreign_file(spoiled: Path) -> None:
    with hold_folder(spoiled):
        assert not failures(ObjectFile.open(spoiled))


def test_another_network_of_the_same_shape_fails_the_self_test(spoiled: Path) -> None:
    other = waves_graph(egg_waves(99))
    found = failures(exchange(spoiled, "audio.onnx", other.SerializeToString()))
    assert "onnxruntime" in found["audio: self-test"]
    assert "audio: graph" not in found


def test_a_network_of_another_size_is_not_the_one_described(spoiled: Path) -> None:
    other = waves_graph(egg_waves(0, MODES + 1))
    found = failures(exchange(spoiled, "audio.onnx", other.SerializeToString()))
    assert "object.json" in found["audio: graph"]


def test_a_network_that_overflows_within_its_domain_fails_there(spoiled: Path) -> None:
    waves = egg_waves()
    other = waves_graph(replace(waves, weights=np.full_like(waves.weights, 3e38)))
    found = failures(exchange(spoiled, "audio.onnx", other.SerializeToString()))
    assert "finite" in " ".join(found["audio: domain"].split())


def test_weights_that_are_not_finite_fail_before_they_are_run(spoiled: Path) -> None:
    model = load_model_from_string((spoiled / "audio.onnx").read_bytes())
    index = next(i for i, t in enumerate(model.graph.initializer) if t.data_type == TensorProto.FLOAT)
    kept = model.graph.initializer[index]
    array = numpy_helper.to_array(kept).copy()
    array.flat[:2] = np.nan
    kept.CopyFrom(numpy_helper.from_array(array, kept.name))
    found = failures(exchange(spoiled, "audio.onnx", model.SerializeToString()))
    assert "2 of the" in found["audio: graph"]


def test_weights_outside_of_the_folder_are_not_fetched(spoiled: Path) -> None:
    secret = spoiled.parent / "secret.bin"
    model = load_model_from_string((spoiled / "audio.onnx").read_bytes())
    kept = model.graph.initializer[-1]
    secret.write_bytes(kept.raw_data)  # even the right numbers
    kept.ClearField("raw_data")
    kept.data_location = TensorProto.EXTERNAL
    kept.external_data.add(key="location", value="../secret.bin")
    found = failures(exchange(spoiled, "audio.onnx", model.SerializeToString()))
    assert "../secret.bin" in found["audio: graph"]


def test_a_table_of_another_object_is_told_from_the_network(spoiled: Path) -> None:
    random = np.random.default_rng(0).uniform(-1.0, 1.0, (642, MODES, 3)).astype(np.float16)
    found = failures(exchange(spoiled, "audio_table.npy", npy_bytes(random, "<f2")))
    assert "table" in " ".join(found["audio: network and table"].split())


def test_a_surface_in_other_units_is_told_from_the_description(spoiled: Path) -> None:
    mesh = egg()
    found = failures(exchange(spoiled, "mesh.ply", ply_bytes(Mesh(1e3 * mesh.vertices, mesh.faces))))
    assert "mesh.ply" in found["mesh"]


def shorten(tree: dict[str, Any]) -> None:
    tree["audio"]["network"]["self_test"]["inputs"][0]["values"] = [0.1, 0.2]


def reach_beyond(tree: dict[str, Any]) -> None:
    tree["audio"]["network"]["self_test"]["outputs"][0]["at"][-1] = 10**6


@pytest.mark.parametrize(
    ("change", "said"), [(shorten, "2 numbers 'points'"), (reach_beyond, "number 1000000 of")]
)
def test_a_self_test_that_cannot_be_asked_is_said(spoiled: Path, change: Any, said: str) -> None:
    assert said in failures(rewrite(spoiled, change))["audio: self-test"]


def squares(low: tuple[float, ...], high: tuple[float, ...], data: bytes) -> NetworkEntry:
    pose = Input(
        name="pose",
        dtype="float32",
        shape=("n", 2),
        unit="1",
        meaning="anything",
        domain=Domain(low=low, high=high),
        normaliser="in the graph",
    )
    depth = Tensor(name="depth", dtype="float32", shape=("n", 2), unit="m", meaning="its square root")
    return NetworkEntry(
        **file_entry("touch.onnx", data).model_dump(),
        inputs=(pose,),
        outputs=(depth,),
        self_test=SelfTest(
            rows=2,
            inputs=(Whole(name="pose", values=(1.0, 4.0, 9.0, 16.0)),),
            outputs=(Sampled(name="depth", at=(0, 1, 3), values=(1.0, 2.0, 4.0)),),
            tolerance=1e-5,
        ),
    )


def root_graph() -> bytes:
    graph = helper.make_graph(
        [helper.make_node("Sqrt", ["pose"], ["depth"])],
        "root",
        [helper.make_tensor_value_info("pose", TensorProto.FLOAT, ["n", 2])],
        [helper.make_tensor_value_info("depth", TensorProto.FLOAT, ["n", 2])],
    )
    model = helper.make_model(graph, ir_version=8, opset_imports=[helper.make_opsetid("", 17)])
    return model.SerializeToString()


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ((-0.1, 0.0), (1.0, 20.0), "finite .*domain"),
        ((0.0,), (1.0,), "1 numbers .* 2"),
    ],
)
def test_a_network_is_asked_all_over_its_own_domain(
    egg_object: ObjectFile, low: tuple[float, ...], high: tuple[float, ...], said: str
) -> None:
    data = root_graph()
    sound = squares((0.0, 0.0), (1.0, 20.0), data)
    network = open_network(data, sound)
    assert "finite at" in check_domain(egg_object, lambda: network)
    assert "as when it was made" in check_self_test(lambda: network, sound.self_test)
    wrong = open_network(data, squares(low, high, data))
    with pytest.raises(DataRefused, match=said):
        check_domain(egg_object, lambda: wrong)
