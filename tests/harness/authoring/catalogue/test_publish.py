"""What a build made is copied whole, once, and goes on where a copy was stopped."""

import json
from pathlib import Path

import fsspec
import pytest

from harness.authoring.catalogue.layout import BuildFolder, read_record
from harness.authoring.catalogue.publish import ObjectStore, publish
from harness.basics.errors import DataRefused, WrongUse
from harness.cli import invoke
from harness.objectfile.file import ObjectFile
from tests.samples.tiny_catalogue import block


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> BuildFolder:
    """Two blocks' touch, and a file that is no mesh."""
    folder = tmp_path_factory.mktemp("catalogue")
    for name, length in (("one", 0.08), ("two", 0.09)):
        block(folder, name, length)
    (folder / "bad.stl").write_bytes(b"solid nothing")
    (folder / "objects.csv").write_text("name,material,units\none,wood,m\ntwo,steel,m\nbad,steel,m\n")
    small = ["--profile", "smoke", "--senses", "touch", "--workers", "1"]
    assert invoke(["catalogue", "build", str(folder / "objects.csv"), "--out", str(folder / "out"), *small])
    return BuildFolder(folder / "out")


def outcomes(of: BuildFolder, store: ObjectStore) -> dict[str, str]:
    return {each.name: each.outcome for each in publish(of, store)}


def test_objects_are_sent_once_and_open_where_they_were_sent(built: BuildFolder, tmp_path: Path) -> None:
    store = ObjectStore(f"file://{tmp_path}/there")
    assert outcomes(built, store) == {"one": "sent", "two": "sent", "bad": "not built"}
    assert ObjectFile.open(tmp_path / "there" / "one").description.name == "one"
    for path in built.object("two").iterdir():
        assert (tmp_path / "there" / "two" / path.name).read_bytes() == path.read_bytes()
    assert outcomes(built, store) == {"one": "there", "two": "there", "bad": "not built"}


def test_a_copy_that_was_stopped_is_no_object_and_goes_on(
    built: BuildFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whichever file it stops at: an older description is gone by then, the new one not there."""
    memory = fsspec.filesystem("memory")
    store = ObjectStore("memory://stopped")
    memory.pipe_file("/stopped/one/object.json", b"an older object")
    whole = memory.pipe_file
    sent: list[str] = []

    def full(path: str, value: bytes, **others: object) -> None:
        if sent:
            raise OSError(28, "No space left on device", path)
        sent.append(path)
        whole(path, value, **others)

    monkeypatch.setattr(type(memory), "pipe_file", lambda _, *arguments, **others: full(*arguments, **others))
    with pytest.raises(OSError, match="No space left"):
        publish(built, store)
    assert not memory.exists("/stopped/one/object.json")
    monkeypatch.undo()
    assert outcomes(built, store) == {"one": "sent", "two": "sent", "bad": "not built"}
    assert memory.exists("/stopped/one/object.json")


def test_a_file_that_is_not_the_one_that_was_built_is_not_sent(
    built: BuildFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = read_record(built, "one")
    assert record is not None
    spoilt = record.files[0].model_copy(update={"sha256": "0" * 64})
    with pytest.raises(DataRefused, match=r"one/.*build"):
        ObjectStore("memory://spoilt").put(
            built.object("one"), record.model_copy(update={"files": (spoilt, *record.files[1:])})
        )
    assert not fsspec.filesystem("memory").exists("/spoilt/one/object.json")


def test_a_driver_s_own_failure_names_the_file(built: BuildFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    class NoCredentials(Exception):
        pass

    def refuse(*_: object, **__: object) -> None:
        raise NoCredentials("unable to locate credentials")

    store = ObjectStore("memory://closed")
    monkeypatch.setattr(type(fsspec.filesystem("memory")), "pipe_file", refuse)
    with pytest.raises(OSError, match=r"/closed/one/.*NoCredentials: unable to locate credentials"):
        publish(built, store)


@pytest.mark.parametrize("url", ["nothing://there", "s3://bucket/objects"])
def test_an_address_of_no_driver_is_wrong_use(url: str) -> None:
    with pytest.raises(WrongUse, match="driver"):
        ObjectStore(url)


def test_the_command_says_what_it_sent(built: BuildFolder, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    command = ["catalogue", "publish", str(built.folder), "memory://command", "--json"]
    assert invoke(command) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["counts"] == {"sent": 2, "not built": 1}
    assert answer["bytes"] == sum(each["bytes"] for each in answer["objects"]) > 0
    assert invoke(command[:-1]) == 1
    assert "3 objects: 2 there, 1 not built; 0 MB sent to memory://command" in capsys.readouterr().out
