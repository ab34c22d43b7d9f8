"""What is written is read back; what was changed, is missing or leads elsewhere is refused by name."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.part import with_audio
from harness.objectfile.description import description_from, description_text
from harness.objectfile.file import ObjectFile, create_object, with_part
from harness.objectfile.surface_file import mesh_from_ply, ply_bytes
from tests.samples.object_bench import MODES, PROVENANCE, egg, egg_file, egg_part, rewrite

FILES = ["mesh.ply", "audio.onnx", "audio_table.npy", "audio_surface.ply"]


def test_an_object_reads_back_as_it_was_written(egg_object: ObjectFile) -> None:
    again = ObjectFile.open(egg_object.folder)
    assert again.description == egg_object.description
    assert again.material == MATERIALS["ceramic"]
    np.testing.assert_array_equal(again.mesh.vertices, egg().vertices)
    np.testing.assert_array_equal(again.mesh.faces, egg().faces)
    assert sorted(path.name for path in egg_object.folder.iterdir()) == sorted([*FILES, "object.json"])


def test_the_same_object_is_the_same_bytes(egg_object: ObjectFile, tmp_path: Path) -> None:
    second = egg_file(tmp_path / "second")
    for path in egg_object.folder.iterdir():
        assert path.read_bytes() == (second.folder / path.name).read_bytes(), path.name


def test_its_text_is_its_description(egg_object: ObjectFile) -> None:
    text = (egg_object.folder / "object.json").read_text(encoding="utf-8")
    assert description_text(description_from(json.loads(text), "object.json")) == text
    assert len(text.splitlines()) < 200  # lists of numbers stay on their line


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("place", [0, 0.5, 1])
def test_one_changed_bit_is_noticed(spoiled: Path, name: str, place: float) -> None:
    data = bytearray((spoiled / name).read_bytes())
    data[int(place * (len(data) - 1))] ^= 1
    (spoiled / name).write_bytes(data)
    of = ObjectFile.open(spoiled)
    entry = next(entry for entry in of.description.files if entry.file == name)
    with pytest.raises(DataRefused, match=f"{name} .*sha256"):
        of.read(entry)


@pytest.mark.parametrize("name", FILES)
def test_a_missing_a_shortened_and_a_linked_file_are_named(spoiled: Path, name: str) -> None:
    of = ObjectFile.open(spoiled)
    entry = next(entry for entry in of.description.files if entry.file == name)
    whole = (spoiled / name).read_bytes()
    (spoiled / name).write_bytes(whole[:-1])
    with pytest.raises(DataRefused, match=f"{len(whole) - 1} bytes .*{len(whole)}"):
        of.read(entry)
    (spoiled / name).unlink()
    with pytest.raises(DataRefused, match=name):
        of.read(entry)
    (spoiled.parent / "elsewhere").write_bytes(whole)
    (spoiled / name).symlink_to(spoiled.parent / "elsewhere")
    with pytest.raises(DataRefused, match=f"{name} .*elsewhere"):
        of.read(entry)


def test_a_file_that_never_ends_is_not_read(spoiled: Path) -> None:
    (spoiled / "audio.onnx").unlink()
    os.mkfifo(spoiled / "audio.onnx")
    of = ObjectFile.open(spoiled)
    assert of.description.audio is not None
    assert of.description.audio.network is not None
    with pytest.raises(DataRefused, match=r"audio\.onnx"):
        of.read(of.description.audio.network)


def put(*keys: str | int, value: Any) -> Any:
    def change(tree: Any) -> None:
        for key in keys[:-1]:
            tree = tree[key]
        tree[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (put("nmae", value="egg"), "'nmae'.*'name'"),
        (put("audio", "frequency_hz", value=[]), "'audio.frequency_hz'.*'frequencies_hz'"),
        (
            put("audio", "network", "inputs", 0, "domain", "near_surface", value=1),
            "'audio.network.inputs.0..domain.near_surface'.*'near_surface_m'",
        ),
        (
            put("audio", "network", "self_test", "outputs", 0, "value", value=1),
            "value'.*'values'",
        ),
        (put("schema", value=2), "schema 2.* 1"),
        (put("units", value="mm"), "'units' = 'mm'"),
        (put("mesh", "file", value="../egg/mesh.ply"), "object.json"),
        (put("mesh", "file", value="/etc/passwd"), "object.json"),
        (put("mesh", "file", value="object.json"), "object.json"),
        (put("mesh", "file", value="audio.onnx"), "'audio.onnx'"),
        (put("mesh", "bytes", value=2**40), "mesh.bytes"),
        (put("mesh", "sha256", value="abc"), "mesh.sha256"),
        (put("audio", "mass_kg", value="0.3 kg"), "audio.mass_kg"),
        (put("audio", "mass_kg", value=-0.3), "audio.mass_kg"),
        (put("audio", "dampings_per_s", value=[1.0]), "7 frequencies .*1 dampings"),
        (put("audio", "frequencies_hz", 2, value=1.0), "ascend"),
        (put("audio", "near_surface_m", value=0.005), "near_surface_m = 0.005"),
        (put("audio", "network", "outputs", 0, "shape", value=["n", 8, 3]), "gains \\(n, 7, 3\\)"),
        (put("audio", "network", "inputs", 0, "shape", value=[4, 3]), "'n'"),
        (put("audio", "network", "self_test", "outputs", 0, "name", value="gain"), "self_test"),
        (put("audio", "network", "self_test", "tolerance", value=10.0), "tolerance"),
        (put("audio", "table", "scales", value=[1.0]), "scales"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_the_description_may_not_say(spoiled: Path, change: Any, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        rewrite(spoiled, change)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "JSON"),
        ("[1, 2", "JSON"),
        ("[" * 100_000, "JSON"),
        ("[]", "schema None"),
        ('{"schema": 1, "schema": 1}', "'schema' .*twice"),
        ('{"schema": 1, "mass_kg": NaN}', "NaN"),
        ('{"schema": true}', "schema True"),
    ],
    ids=["empty", "cut", "deep", "list", "twins", "nan", "bool"],
)
def test_a_description_that_is_none(spoiled: Path, text: str, said: str) -> None:
    (spoiled / "object.json").write_text(text)
    with pytest.raises(DataRefused, match=said):
        ObjectFile.open(spoiled)


def test_a_folder_without_a_description_is_no_object(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"object\.json"):
        ObjectFile.open(tmp_path)


def test_an_object_is_not_overwritten_but_its_sound_may_be(spoiled: Path) -> None:
    with pytest.raises(WrongUse, match="ObjectFile"):
        create_object(spoiled, "egg", egg(), MATERIALS["ceramic"], PROVENANCE)
    again = with_audio(ObjectFile.open(spoiled), egg_part(egg()))
    assert again.description.audio is not None
    assert len(again.description.audio.frequencies_hz) == MODES


def test_a_part_is_written_with_its_own_bytes_only(egg_object: ObjectFile, spoiled: Path) -> None:
    audio = egg_object.description.audio
    assert audio is not None
    of = ObjectFile.open(spoiled)
    with pytest.raises(DataRefused, match=r"'audio\.onnx'"):
        with_part(of, "audio", audio, {"audio.onnx": b"something else"})
    with pytest.raises(DataRefused, match=r"notes\.txt"):
        with_part(of, "audio", audio, {"notes.txt": b"x"})
    bare = create_object(spoiled.parent / "bare", "egg", egg(), MATERIALS["ceramic"], PROVENANCE)
    with pytest.raises(DataRefused, match="bytes"):
        with_part(bare, "audio", audio, {})
    assert ObjectFile.open(bare.folder).description.audio is None


@pytest.mark.parametrize(("factor", "said"), [(0.0, "surface"), (1e9, "1e.06 m"), (np.nan, "1e.06 m")])
def test_a_surface_that_is_none_is_refused(factor: float, said: str) -> None:
    mesh = egg()
    with pytest.raises(MeshRefused, match=said):
        mesh_from_ply(ply_bytes(Mesh(factor * mesh.vertices, mesh.faces)), "mesh.ply")


def test_a_surface_reads_back_in_metres() -> None:
    mesh = egg()
    again = mesh_from_ply(ply_bytes(mesh), "mesh.ply", 1e-3)
    np.testing.assert_array_equal(again.vertices, mesh.vertices * 1e-3)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda data: data[:-1], "bytes .*642 vertices"),
        (lambda data: data.replace(b"double x", b"float x"), "PLY"),
        (lambda data: data.replace(b"vertex 642", b"vertex 999999999"), "bytes .*999999999"),
        (lambda data: data[:-4] + b"\xff\xff\xff\x7f", "triangle .*642"),
        (lambda data: data[:-13] + b"\x04" + data[-12:], "triangle .*642"),
        (lambda data: b"", "PLY"),
    ],
    ids=["short", "float", "count", "index", "quad", "empty"],
)
def test_a_damaged_surface_is_refused(damage: Any, said: str) -> None:
    with pytest.raises(MeshRefused, match=said):
        mesh_from_ply(damage(ply_bytes(egg())), "mesh.ply")
