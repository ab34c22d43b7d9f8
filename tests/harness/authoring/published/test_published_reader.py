"""A .pth file is read without running anything of it; a foreign or damaged one is refused in one sentence."""

import json
import pickle
import sys
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.authoring.published.reader import (
    ALLOWED,
    Budget,
    PickledArray,
    PickledDtype,
    plain_tree,
    read_container,
)
from harness.basics.errors import DataRefused, TouchstoneError, WrongUse
from harness.cli import invoke
from tests.samples import published_trees
from tests.samples.published_files import write_published


def with_torch() -> Any:
    pytest.importorskip("onnxscript", reason="the extra `author` is not installed")
    return pytest.importorskip("torch", reason="the extra `author` is not installed")


class Unpickler(pickle.Unpickler):
    """A reader that knows the stand-ins alone."""

    def find_class(self, module: str, name: str) -> Any:
        import _codecs

        allowed = {place: ours for ours, place in ALLOWED} | {"_codecs.encode": _codecs.encode}
        if f"{module}.{name}" not in allowed:
            raise pickle.UnpicklingError(f"{module}.{name}")
        return allowed[f"{module}.{name}"]


def reread(value: Any, path: Path) -> Any:
    path.write_bytes(pickle.dumps(value, protocol=2))
    with path.open("rb") as stream:
        return Unpickler(stream).load()


@pytest.mark.parametrize(
    "array",
    [
        np.arange(12.0).reshape(3, 4),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        np.array(7.0, np.float32),
        np.array([True, False]),
    ],
    ids=["c", "fortran", "scalar", "bool"],
)
def test_arrays_of_numbers_come_through_the_stand_ins(array: Any, tmp_path: Path) -> None:
    found = reread(array, tmp_path / "a.pkl")
    assert isinstance(found, PickledArray)
    assert found.array is not None
    assert found.array.dtype == array.dtype
    assert np.array_equal(found.array, array)
    assert found.array.shape == array.shape


def test_numbers_of_numpy_come_through_as_numbers(tmp_path: Path) -> None:
    assert reread(np.float32(0.5), tmp_path / "a.pkl") == 0.5
    assert reread(np.int64(-3), tmp_path / "a.pkl") == -3


@pytest.mark.parametrize(
    "value",
    [
        np.array([{}], object),
        np.zeros(2, [("a", "f8"), ("b", "O")]),
        np.array(["text"]),
        np.zeros(2, ">f8"),
        np.zeros(2, np.complex128),
        np.datetime64("2020-01-01"),
    ],
    ids=["objects", "structure", "text", "big-endian", "complex", "date"],
)
def test_arrays_of_anything_else_are_refused(value: Any, tmp_path: Path) -> None:
    with pytest.raises(pickle.UnpicklingError):
        reread(value, tmp_path / "a.pkl")


@pytest.mark.parametrize("shape", [(3,), (1,), (2**40,), (-2,), (2.0,), 2])
def test_an_array_has_the_bytes_of_its_shape_or_is_refused(shape: Any) -> None:
    with pytest.raises(pickle.UnpicklingError, match=r"bytes for an array|of the shape"):
        PickledArray().__setstate__((1, shape, PickledDtype("f8"), False, bytes(16)))


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("empty", b""),
        ("text", b"an ObjectFile, honestly\n" * 100),
        ("picture", b"\x89PNG\r\n\x1a\n" + bytes(100)),
        ("pickle", pickle.dumps({"VisionNet": {}}, protocol=2)),
        ("half an archive", b"PK\x03\x04" + bytes(300)),
    ],
)
def test_a_foreign_file_gets_one_sentence_before_torch_is_needed(
    name: str, data: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "ObjectFile.pth"
    path.write_bytes(data)
    assert invoke(["object", "import", str(path), "--out", str(tmp_path / "out"), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert "ObjectFile.pth" in said["error"]
    assert "\n" not in said["error"]
    assert said["exit_code"] == 1
    assert not (tmp_path / "out").exists()


def test_an_archive_of_something_else_is_refused_by_what_it_lacks(tmp_path: Path) -> None:
    path = tmp_path / "arrays.pth"
    with path.open("wb") as stream:
        np.savez(stream, a=np.zeros(3))
    with pytest.raises(DataRefused, match=r"data\.pkl"):
        read_container(path)


def test_without_torch_the_extra_that_has_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "ObjectFile.pth"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("archive/data.pkl", b"")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(WrongUse, match=r"pip install '\.\[author\]'"):
        read_container(path)


def test_a_file_that_is_not_there_is_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"ObjectFile\.pth"):
        read_container(tmp_path / "ObjectFile.pth")


@pytest.mark.parametrize("tree", [{(1, 2): 3}, {"a": object()}, {"a": b"bytes"}, {"a": {1, 2}}])
def test_tables_of_anything_but_numbers_and_text_are_refused(tree: Any) -> None:
    with pytest.raises(DataRefused, match=r"\.pth"):
        plain_tree(tree, "a file")


def test_tables_within_tables_end_somewhere() -> None:
    tree: Any = {}
    tree["again"] = tree
    with pytest.raises(DataRefused, match="deeper"):
        plain_tree(tree, "a file")


def same(found: Any, wanted: Any) -> bool:
    if isinstance(wanted, dict):
        return list(found) == list(wanted) and all(same(found[key], wanted[key]) for key in wanted)
    if isinstance(wanted, list | tuple):
        return len(found) == len(wanted) and all(same(*pair) for pair in zip(found, wanted, strict=True))
    return bool(np.array_equal(found, wanted)) if wanted is not None else found is None


@pytest.mark.parametrize("which", ["second", "first"])
def test_a_published_file_reads_back_as_the_tables_it_was_made_of(which: str, tmp_path: Path) -> None:
    with_torch()
    tree = getattr(published_trees, which)()
    found = read_container(write_published(tree, tmp_path / "ObjectFile.pth"))
    for sense in ("VisionNet", "TouchNet"):
        assert same(found[sense], tree[sense])
    assert found["AudioNet"].keys() == tree["AudioNet"].keys()


class _Malicious:
    """What a pickle may hold: a call of anything."""

    def __init__(self, call: Any, *arguments: Any) -> None:
        self._reduced = call, arguments

    def __reduce__(self) -> Any:
        return self._reduced


@pytest.mark.parametrize("where", ["alone", "beside the networks", "as a weight"])
@pytest.mark.parametrize("call", ["touch", "eval", "exec", "system"])
def test_a_malicious_file_runs_nothing(
    where: str, call: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import os

    torch = with_torch()
    mark = tmp_path / "it ran"
    code = f"open({str(mark)!r}, 'w').close()"
    calls = {
        "touch": _Malicious(Path.touch, mark),
        "eval": _Malicious(eval, code),
        "exec": _Malicious(exec, code),
        "system": _Malicious(os.system, f"touch '{mark}'"),
    }
    tree = published_trees.second()
    if where == "beside the networks":
        tree["VisionNet"]["cfg"]["perturb"] = calls[call]
    elif where == "as a weight":
        tree["AudioNet"]["model_state_dict"]["module.model_x.pts_linears.0.weight"] = calls[call]
    path = tmp_path / "ObjectFile.pth"
    torch.save(calls[call] if where == "alone" else tree, path)
    assert invoke(["object", "import", str(path), "--out", str(tmp_path / "out"), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)["error"]
    assert "ObjectFile.pth" in said
    assert "\n" not in said
    assert not mark.exists()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_short_gets_one_sentence(share: float, tmp_path: Path) -> None:
    with_torch()
    path = write_published(published_trees.second(), tmp_path / "ObjectFile.pth")
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(DataRefused, match=r"damaged|archive"):
        read_container(path)


@pytest.mark.parametrize("seed", range(20))
def test_a_damaged_file_is_read_or_refused_and_nothing_else(seed: int, tmp_path: Path) -> None:
    with_torch()
    path = write_published(published_trees.second(), tmp_path / "ObjectFile.pth")
    random, data = np.random.default_rng(seed), bytearray(path.read_bytes())
    start = data.find(b"data.pkl")
    for at in random.integers(start, start + 6000, 8):
        data[at] = random.integers(256)
    path.write_bytes(bytes(data))
    with suppress(TouchstoneError):
        read_container(path)


def test_tables_that_refer_to_each_other_are_counted_as_often_as_they_are_referred_to() -> None:
    tree: Any = [0.0] * 100
    for _ in range(6):
        tree = [tree] * 100
    with pytest.raises(DataRefused, match="1000000 entries"):
        plain_tree(tree, "a file")


def test_views_of_little_that_are_large_are_refused_before_they_are_copied() -> None:
    class View:
        """As torch shows one number in the shape (2^27,)."""

        def detach(self) -> None:
            raise AssertionError("it was copied")

        def numel(self) -> int:
            return 2**27

        def element_size(self) -> int:
            return 2

    with pytest.raises(DataRefused, match=r"a file\['b'\]: .*512 MiB"):
        plain_tree({"a": 1.0, "b": View(), "c": View()}, "a file", budget=Budget(bytes=2**29 - 1))


def test_an_archive_whose_pickle_is_huge_is_refused_before_torch_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "large.pth"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("archive/data.pkl", bytes(2**24 + 1))
    with pytest.raises(DataRefused, match=r"16 MiB.* 16"):
        read_container(path)
