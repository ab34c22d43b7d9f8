"""The unit of work: the same object and spec are the same bytes, and a change makes what depends on it."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from harness.authoring.catalogue.build import build_plan, held
from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, read_record, stands
from harness.authoring.catalogue.spec import BuildSpec, build_item
from harness.authoring.catalogue.unit import build_object
from harness.authoring.catalogue.worker import Job
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.objectfile.file import ObjectFile
from harness.objectfile.verify import verify
from tests.samples.tiny_catalogue import BOTH, TOUCH, all_bytes, block, block_row, tiny_job


def done(job: Job) -> ObjectRecord:
    return build_object(job.item, job.spec, job.folder, lambda _doing, _share: None)


@dataclass(frozen=True)
class Built:
    meshes: Path
    out: BuildFolder
    record: ObjectRecord


@pytest.fixture(scope="module")
def block_of_both(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """A block with sound and touch; read only."""
    folder = tmp_path_factory.mktemp("once")
    out = BuildFolder(folder / "a")
    return Built(folder, out, done(tiny_job(folder, "block", out, BOTH)))


@pytest.mark.slow  # two builds; each sense's own build is compared in quick tests
def test_two_builds_of_one_object_are_the_same_bytes(block_of_both: Built, tmp_path: Path) -> None:
    """The second knows the first's tetrahedra and nothing else."""
    second = BuildFolder(tmp_path / "b")
    shutil.copytree(block_of_both.out.arrays, second.arrays)
    records = (block_of_both.record, done(tiny_job(block_of_both.meshes, "block", second, BOTH)))
    assert [record.outcome for record in records] == ["built", "built"]
    assert all(part.made for record in records for part in record.senses.values())
    a, b = all_bytes(block_of_both.out.object("block")), all_bytes(second.object("block"))
    assert set(a) == {"object.json", "mesh.ply", "audio.onnx", "audio_table.npy", "audio_surface.ply",
                      "touch.onnx", "touch_nodes.npy"}  # fmt: skip
    assert a == b


def test_what_a_clock_measured_is_in_the_record_alone(block_of_both: Built) -> None:
    text = (block_of_both.out.object("block") / "object.json").read_text()
    assert "seconds_per" not in text
    audio = block_of_both.record.senses["audio"]
    assert audio.seconds["solve"] > 0.0
    assert audio.clock["audio.network.measured.seconds_per_vertex"] > 0.0
    assert "audio.provenance.cpu_seconds.solve" in audio.clock


def test_an_object_of_stages_verifies_under_its_own_name(block_of_both: Built) -> None:
    of = ObjectFile.open(block_of_both.out.object("block"))
    assert of.description.name == "block"
    assert [check for check in verify(of) if not check.passed] == []


def test_another_material_makes_the_sound_anew_and_keeps_the_touch(
    block_of_both: Built, tmp_path: Path
) -> None:
    out = BuildFolder(Path(shutil.copytree(block_of_both.out.folder, tmp_path / "copy")))
    before = all_bytes(out.object("block"))
    record = done(tiny_job(block_of_both.meshes, "block", out, BOTH, "plastic"))
    assert {sense: part.made for sense, part in record.senses.items()} == {"audio": True, "touch": False}
    after = all_bytes(out.object("block"))
    assert ObjectFile.open(out.object("block")).material == MATERIALS["plastic"]
    assert {name for name in before if before[name] == after[name]} == {
        "mesh.ply", "touch.onnx", "touch_nodes.npy", "audio_surface.ply"
    }  # fmt: skip
    assert stands(out, read_record(out, "block"), record.key)


def test_what_stands_is_not_planned_again_and_what_is_damaged_is(block_of_both: Built) -> None:
    rows = [(block_row("block"), block(block_of_both.meshes, "block"))]
    out = block_of_both.out
    assert build_plan(rows, BOTH, out).waiting == ()
    network = out.object("block") / "touch.onnx"
    content = network.read_bytes()
    network.unlink()
    assert len(build_plan(rows, BOTH, out).waiting) == 1
    network.write_bytes(content)
    assert build_plan(rows, BOTH, out).standing == {"block"}


@pytest.mark.parametrize(
    ("change", "keys"),
    [
        ({"material": "steel"}, {"audio"}),
        ({"wall": 2e-3}, {"audio", "touch"}),
        ({"licence": "CC0"}, {"audio", "touch"}),
        ({"name": "other"}, set()),
        ({"mass": 1.0, "source": "x", "number": "9"}, None),
    ],
)
def test_a_key_has_all_that_a_result_depends_on_and_nothing_else(
    tmp_path: Path, change: dict[str, object], keys: set[str] | None
) -> None:
    mesh, row = block(tmp_path, "block"), block_row("block")
    one, other = build_item(row, mesh, BOTH), build_item(replace(row, **change), mesh, BOTH)  # type: ignore[arg-type]
    assert {sense for sense in one.stages if one.stages[sense] != other.stages[sense]} == (keys or set())
    assert (one.key == other.key) == (keys is None)


def test_keys_change_with_the_mesh_and_its_textures(tmp_path: Path) -> None:
    looks = BuildSpec(("vision",), "smoke")
    mesh = tmp_path / "a.obj"
    mesh.write_text("mtllib a.mtl\nv 0 0 0\n")
    (tmp_path / "a.mtl").write_text("newmtl x\nmap_Kd -s 1 1 1 a.png\n")
    (tmp_path / "a.png").write_bytes(b"1")
    keys = [build_item(block_row("a"), str(mesh), looks).key]
    for path, data in (("a.png", b"2"), ("a.mtl", b"map_Kd a.png\n"), ("a.obj", b"mtllib a.mtl\n")):
        (tmp_path / path).write_bytes(data)
        keys.append(build_item(block_row("a"), str(mesh), looks).key)
    assert len(set(keys)) == 4


def test_a_poisoned_object_is_kept_apart_with_its_reason(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path / "out")
    job = tiny_job(tmp_path, "bad", of)
    Path(job.item.mesh).write_bytes(b"solid nothing")
    job = Job(build_item(job.item.row, job.item.mesh, TOUCH), TOUCH, of)
    record = done(job)
    assert record.outcome == "refused"
    assert "bad.stl" in record.reason
    assert (of.failed("bad") / "record.json").is_file()
    rows = [(job.item.row, job.item.mesh)]
    assert list(build_plan(rows, TOUCH, of).known) == ["bad"]
    assert len(build_plan(rows, TOUCH, of, retry=True).waiting) == 1
    block(tmp_path, "bad")
    assert len(build_plan(rows, TOUCH, of).waiting) == 1


def test_a_mesh_that_changed_since_the_plan_is_refused(tmp_path: Path) -> None:
    job = tiny_job(tmp_path, "block", BuildFolder(tmp_path / "out"))
    block(tmp_path, "block", 0.081)
    assert "version" in done(job).reason


def test_one_program_builds_into_a_folder(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path)
    with held(of), pytest.raises(WrongUse, match=f"process {os.getpid()}"), held(of):
        pass
    with held(of):
        pass


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of two megabytes, less than a touch."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["/bin/mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root can mount a small disk")
    yield folder
    subprocess.run(["/bin/umount", str(folder)], check=True)


def test_a_full_disk_is_named_and_tried_again_once_there_is_space(small_disk: Path, tmp_path: Path) -> None:
    of = BuildFolder(small_disk / "out")
    job = tiny_job(tmp_path, "block", of)
    record = done(job)
    assert record.outcome == "disk full"
    assert "free space" in record.reason
    assert not of.object("block").exists()
    assert len(build_plan([(job.item.row, job.item.mesh)], TOUCH, of).waiting) == 1
    subprocess.run(["/bin/mount", "-o", "remount,size=20m", str(small_disk)], check=True)
    assert done(job).outcome == "built"
