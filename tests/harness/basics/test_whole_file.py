"""A file is there whole or not at all, and a disk that is full is named with the file."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest

from harness.basics.npz_file import write_arrays
from harness.basics.whole_file import make_folder, removed_on_failure, whole_file, write_text_whole


def full(descriptor: int) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_leaves_the_old_file_and_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "some.npz"
    write_arrays(path, {"a": np.arange(3)})
    before = path.read_bytes()
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*some\.npz'"):
        write_arrays(path, {"a": np.arange(4)})
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_device_is_named() -> None:
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        write_arrays(Path("/dev/full"), {"a": np.arange(3)})


def test_a_program_that_fails_while_it_writes_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_file(tmp_path / "some") as stream:
            stream.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_one_and_a_device_is_written_to(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there" / "file")
    write_text_whole(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "there" / "file").read_text() == "text"
    write_text_whole(Path("/dev/null"), "text")
    assert not Path("/dev/null").is_file()


def test_what_a_failing_block_put_there_is_removed_and_nothing_else(tmp_path: Path) -> None:
    def fail(folder: Path) -> None:
        with removed_on_failure(folder, ("a", ".hidden", "mine")):
            make_folder(folder / "a" / "b")
            (folder / "a" / "c").write_text("half")
            (folder / ".hidden").symlink_to(tmp_path / "mine")
            raise ZeroDivisionError

    (tmp_path / "mine").write_text("of before")
    for folder in (tmp_path, tmp_path / "new"):
        with pytest.raises(ZeroDivisionError):
            fail(folder)
    assert list(tmp_path.iterdir()) == [tmp_path / "mine"]
    assert (tmp_path / "mine").read_text() == "of before"


def test_files_of_another_program_are_kept_by_a_failing_block(tmp_path: Path) -> None:
    folder = tmp_path / "new"

    def fail() -> None:
        with removed_on_failure(folder, ("own",)):
            make_folder(folder)
            (folder / "own").write_text("half")
            (folder / "of-another").write_text("whole")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [path.name for path in folder.iterdir()] == ["of-another"]


def test_two_writers_of_one_path_do_not_share_a_temporary_file(tmp_path: Path) -> None:
    path = tmp_path / "some"
    with whole_file(path) as first:
        first.write(b"first")
        with whole_file(path) as second:
            second.write(b"2")
        assert path.read_bytes() == b"2"
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_with_the_longest_name_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("a" * 255)
    write_text_whole(path, "text")
    assert path.read_text() == "text"
