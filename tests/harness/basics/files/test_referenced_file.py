"""Files that a file names: regular ones inside its folder."""

import os
from pathlib import Path

import pytest

from harness.basics.errors import DataRefused
from harness.basics.files.referenced_file import referenced_path


def test_files_inside_the_folder_are_found(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("a.png", "a b.png", "sub/c.png", "50%25.png"):
        (tmp_path / name).write_bytes(b"x")
    of = tmp_path / "mesh.obj"
    for name, file in (
        *(("a.png", "a.png"), ("./a.png", "a.png"), ("a%20b.png", "a b.png"), ("sub\\c.png", "sub/c.png")),
        ("50%25.png", "50%25.png"),
    ):
        assert referenced_path(of, name) == (tmp_path / file).resolve()
    assert referenced_path(of, "gone.png") is None
    assert referenced_path(of, "n" * 5000) is None


@pytest.mark.parametrize(
    "name",
    [
        *("../a.png", "sub/../../a.png", "/a.png", "\\a.png", "C:/a.png", "c:a.png", "\\\\host\\a.png"),
        *("http://host/a.png", "file:///a.png", "%2e%2e/a.png", "%2Fa.png", "a\0.png", "", "link.png"),
    ],
)
def test_names_that_leave_the_folder_are_refused(tmp_path: Path, name: str) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "a.png").write_bytes(b"x")
    (inner / "link.png").symlink_to(tmp_path / "a.png")
    with pytest.raises(DataRefused, match=r"inside|link"):
        referenced_path(inner / "mesh.obj", name)


def test_what_is_no_regular_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "pipe"):
        with pytest.raises(DataRefused, match=name):
            referenced_path(tmp_path / "mesh.obj", name)
