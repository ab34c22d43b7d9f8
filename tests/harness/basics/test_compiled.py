"""Machine code of kernels: kept by the hash of its sources, wherever the checkout is."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from harness.basics.compiled import MAX_SOURCE_VERSIONS

_CALLEE = """
from harness.basics.compiled import compiled
{extra}
FACTOR = {factor}
@compiled
def scale(x):
    return FACTOR * x
"""
_CALLER = """
from harness.basics.compiled import compiled
import constants
from callee import scale
@compiled
def twice(x):
    return constants.TWO * scale(x)
"""
_PROGRAM = """
import caller
value = caller.twice(3.0)
stats = caller.twice.stats
print(value, sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def _write(folder: Path, factor: float, extra: str = "", two: float = 2.0) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "callee.py").write_text(_CALLEE.format(factor=factor, extra=extra))
    (folder / "caller.py").write_text(_CALLER)
    (folder / "constants.py").write_text(f"TWO = {two}")


def _run(folder: Path, cache: Path) -> list[float]:
    environment = {
        **os.environ,
        "TOUCHSTONE_CACHE": str(cache),
        "NUMBA_CACHE_DIR": "",
        "PYTHONPATH": os.pathsep.join([str(folder), str(Path.cwd())]),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    program = [sys.executable, "-c", _PROGRAM]
    done = subprocess.run(program, env=environment, capture_output=True, text=True, check=True)
    return [float(word) for word in done.stdout.split()]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a program that ran once: ``code``, and ``cache`` with its kernels."""
    folder = tmp_path_factory.mktemp("first")
    module = folder / "cache" / "kernels" / "caller"
    for number in range(MAX_SOURCE_VERSIONS + 3):
        (module / f"old{number}").mkdir(parents=True)
        os.utime(module / f"old{number}", (number, number))
    _write(folder / "code", 5.0)
    assert _run(folder / "code", folder / "cache") == [30.0, 0, 1]
    return folder


@pytest.fixture
def copy(first: Path, tmp_path: Path) -> Path:
    """A copy of that folder to change."""
    return Path(shutil.copytree(first, tmp_path / "copy"))


def test_a_copy_of_the_same_sources_compiles_nothing(first: Path, tmp_path: Path) -> None:
    _write(tmp_path / "second", 5.0)
    os.utime(tmp_path / "second" / "callee.py", (0, 0))
    assert _run(tmp_path / "second", first / "cache") == [30.0, 1, 0]


@pytest.mark.parametrize("extra", ["", "import math"])
def test_an_edited_callee_is_compiled_again(copy: Path, extra: str) -> None:
    _write(copy / "code", 7.0, extra)
    assert _run(copy / "code", copy / "cache") == [42.0, 0, 1]


def test_an_edited_constant_of_another_module_is_compiled_again(copy: Path) -> None:
    _write(copy / "code", 5.0, two=3.0)
    assert _run(copy / "code", copy / "cache") == [45.0, 0, 1]


def test_a_damaged_file_is_compiled_again_and_replaced(copy: Path) -> None:
    damaged = list((copy / "cache").rglob("*.nb[ic]"))
    assert damaged
    for path in damaged:
        path.write_bytes(path.read_bytes()[:40])
    assert _run(copy / "code", copy / "cache") == [30.0, 0, 1]


def test_without_a_folder_to_write_kernels_still_run(tmp_path: Path) -> None:
    _write(tmp_path / "code", 5.0)
    (tmp_path / "cache").write_text("a file where the folder belongs")
    assert _run(tmp_path / "code", tmp_path / "cache") == [30.0, 0, 1]


def test_old_versions_of_a_module_are_deleted(first: Path) -> None:
    names = {path.name for path in (first / "cache" / "kernels" / "caller").iterdir()}
    assert len(names) == MAX_SOURCE_VERSIONS
    assert {"old0", "old3"}.isdisjoint(names)
