"""The store: what is read is what was kept, or nothing; a key is what a value holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder, digest
from harness.bench.sensor import MarkerGrid, TactileSensor

KEY = "ab" * 32


def test_what_was_kept_is_read_to_the_bit(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put(KEY, {"a": np.arange(6.0).reshape(2, 3), "b": np.array([True, False])})
    read = store.get(KEY)
    assert isinstance(read, dict)
    assert np.array_equal(read["a"], np.arange(6.0).reshape(2, 3))
    assert read["b"].dtype == bool
    store.put("cd" * 32, np.array([1, 2], dtype=np.uint8))
    assert np.array_equal(np.asarray(store.get("cd" * 32)), [1, 2])
    assert store.get("ef" * 32) is None


@pytest.mark.parametrize("damage", ["cut", "empty", "flipped", "text"])
def test_a_damaged_result_is_none_and_is_dropped(tmp_path: Path, damage: str) -> None:
    store = Store(tmp_path)
    store.put(KEY, np.arange(1000.0))
    path = next(tmp_path.glob("*/*.npz"))
    whole = bytearray(path.read_bytes())
    if damage == "cut":
        whole = whole[: len(whole) // 2]
    elif damage == "empty":
        whole = bytearray()
    elif damage == "flipped":
        whole[len(whole) // 2] ^= 0xFF
    else:
        whole = bytearray(b"not a zip at all")
    path.write_bytes(whole)
    assert store.get(KEY) is None
    assert not path.exists()
    store.put(KEY, np.arange(1000.0))
    assert np.array_equal(np.asarray(store.get(KEY)), np.arange(1000.0))


def test_a_result_of_another_key_s_file_is_whole_or_absent(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put(KEY, np.zeros(3))
    assert [path.suffix for path in tmp_path.glob("*/*")] == [".npz"]


def test_objects_are_not_stored(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        Store(tmp_path).put(KEY, np.array([object()]))
    assert not list(tmp_path.glob("*/*"))


def test_the_limit_drops_what_was_used_longest_ago(tmp_path: Path) -> None:
    import os

    big = np.zeros(10_000)
    keys = [f"{i:02d}" * 32 for i in range(3)]
    store = Store(tmp_path, limit=170_000)
    for age, key in zip((300, 100), keys, strict=False):
        store.put(key, big)
        path = next(tmp_path.glob(f"{key[:2]}/*.npz"))
        os.utime(path, (path.stat().st_atime - age, path.stat().st_mtime - age))
    assert store.get(keys[0]) is not None  # used just now, so the other one is the older
    store.put(keys[2], big)
    assert [store.get(key) is not None for key in keys] == [True, False, True]


def test_the_folder_follows_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path))
    assert default_folder() == tmp_path
    monkeypatch.delenv("TOUCHSTONE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "x"))
    assert default_folder() == tmp_path / "x" / "touchstone"


@dataclass(frozen=True)
class Part:
    key_name: ClassVar[str] = "part"

    a: Any
    b: Any = None


@given(hnp.arrays(np.float64, hnp.array_shapes(max_dims=3, max_side=4)))
def test_equal_arrays_have_equal_digests(array: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    assert digest(array) == digest(np.asfortranarray(array))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.zeros(4), np.zeros((2, 2))),
        (np.zeros(4), np.zeros(4, dtype=np.float32)),
        (np.zeros(4), -np.zeros(4)),
        (1, 1.0),
        (1, True),
        ("1", 1),
        (("a", "b"), ("ab",)),
        ((("a",), "b"), (("a", "b"),)),
        ({"a": 1}, {"b": 1}),
        (Part(1), Part(None, 1)),
        (0.1 + 0.2, 0.3),
    ],
    ids=str,
)
def test_different_values_have_different_digests(one: Any, other: Any) -> None:
    assert digest(one) != digest(other)


@given(st.dictionaries(st.text(max_size=3), st.integers(), max_size=4))
def test_the_order_of_a_mapping_does_not_matter(mapping: dict[str, int]) -> None:
    assert digest(mapping) == digest(dict(reversed(mapping.items())))


def test_a_mesh_can_be_hashed_and_a_stranger_cannot() -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    same = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    _ = mesh.corners  # what is cached on first use is no part of what it holds
    assert digest(mesh) == digest(same)
    with pytest.raises(TypeError, match="object"):
        digest(object())


def test_a_dataclass_without_a_key_name_is_refused() -> None:
    @dataclass(frozen=True)
    class Unnamed:
        a: int

    with pytest.raises(TypeError, match="key_name"):
        digest(Unnamed(1))


def test_stored_types_keep_the_keys_they_always_had() -> None:
    # Computed at 027a4fe2; another value would make every stored result of a user's cache useless.
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    sensor = TactileSensor("gel", 2, 3, 1e-4, 2e-3, None, (0.03, 0.03), MarkerGrid(2, 2, 0.001, 0.001))
    assert digest(mesh).startswith("a6c719d3da74d3d4")
    assert digest(MATERIALS["steel"]).startswith("5838775fb26d9f9e")
    assert digest(sensor).startswith("c5e66238c06a396c")
