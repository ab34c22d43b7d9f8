"""Machine code of kernels: kept by the hash of its sources, wherever the checkout is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

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


def test_a_copy_of_the_same_sources_compiles_nothing(tmp_path: Path) -> None:
    _write(tmp_path / "first", 5.0)
    _write(tmp_path / "second", 5.0)
    os.utime(tmp_path / "second" / "callee.py", (0, 0))
    assert _run(tmp_path / "first", tmp_path / "cache") == [30.0, 0, 1]
    assert _run(tmp_path / "second", tmp_path / "cache") == [30.0, 1, 0]


@pytest.mark.parametrize("extra", ["", "import math"])
def test_an_edited_callee_is_compiled_again(tmp_path: Path, extra: str) -> None:
    code, cache = tmp_path / "code", tmp_path / "cache"
    _write(code, 5.0)
    assert _run(code, cache) == [30.0, 0, 1]
    _write(code, 7.0, extra)
    assert _run(code, cache) == [42.0, 0, 1]


def test_an_edited_constant_of_another_module_is_compiled_again(tmp_path: Path) -> None:
    code, cache = tmp_path / "code", tmp_path / "cache"
    _write(code, 5.0)
    assert _run(code, cache) == [30.0, 0, 1]
    _write(code, 5.0, two=3.0)
    assert _run(code, cache) == [45.0, 0, 1]


def test_a_damaged_file_is_compiled_again_and_replaced(tmp_path: Path) -> None:
    code, cache = tmp_path / "code", tmp_path / "cache"
    _write(code, 5.0)
    _run(code, cache)
    for path in cache.rglob("*.nb[ic]"):
        path.write_bytes(path.read_bytes()[:40])
    assert _run(code, cache) == [30.0, 0, 1]


def test_without_a_folder_to_write_kernels_still_run(tmp_path: Path) -> None:
    _write(tmp_path / "code", 5.0)
    (tmp_path / "cache").write_text("a file where the folder belongs")
    assert _run(tmp_path / "code", tmp_path / "cache") == [30.0, 0, 1]


def test_old_versions_of_a_module_are_deleted(tmp_path: Path) -> None:
    from harness.basics import compiled

    code, cache = tmp_path / "code", tmp_path / "cache"
    module = cache / "kernels" / "caller"
    for number in range(compiled.MAX_SOURCE_VERSIONS + 3):
        (module / f"old{number}").mkdir(parents=True)
        os.utime(module / f"old{number}", (number, number))
    _write(code, 5.0)
    _run(code, cache)
    names = {path.name for path in module.iterdir()}
    assert len(names) == compiled.MAX_SOURCE_VERSIONS
    assert {"old0", "old3"}.isdisjoint(names)
