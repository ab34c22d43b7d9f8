"""Results worth keeping, on disk, found again by what they were computed from.

Nothing in the store is ever wrong or out of date: a key names every input, level and version.
Deleting any of it costs time and changes no result.
"""

import contextlib
import hashlib
import os
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from harness.basics.arrays import AnyArray

_SINGLE = "value"
_CHECK = "sha256"

Storable = AnyArray | Mapping[str, AnyArray]


@runtime_checkable
class OnDisk(Protocol):
    """What lies on the disk and knows, without reading it all, what it holds."""

    @property
    def content_key(self) -> str:
        """Another one for other content, wherever it lies."""
        ...


def default_folder() -> Path:
    """``TOUCHSTONE_CACHE``, or a folder of the user's cache directory."""
    named = os.environ.get("TOUCHSTONE_CACHE")
    if named:
        return Path(named).expanduser()
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "touchstone"


@dataclass(frozen=True)
class Store:
    """A folder of results; any number of processes may share it."""

    folder: Path  #: made on first use.
    limit: int | None = None  #: bytes; the results longest unused are dropped beyond it. None for no limit.

    def get(self, key: str) -> Storable | None:
        """The result under ``key``; None where there is none, or where it does not read back whole."""
        path = self._path(key)
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
        except FileNotFoundError:
            return None
        except Exception:  # noqa: BLE001 - numpy and zipfile fail on damage in any way, and it is made anew
            path.unlink(missing_ok=True)
            return None
        check = arrays.pop(_CHECK, None)
        if check is None or str(check) != digest(arrays):
            path.unlink(missing_ok=True)
            return None
        with contextlib.suppress(OSError):
            path.touch()  # it was used just now
        return arrays[_SINGLE] if list(arrays) == [_SINGLE] else arrays

    def put(self, key: str, value: Storable) -> None:
        """Keep a result: written aside, flushed, renamed, so that it is there whole or not at all.

        Raises:
            TypeError: the result is not an array or a mapping of arrays.
        """
        arrays: dict[str, Any] = dict(value) if isinstance(value, Mapping) else {_SINGLE: value}
        if not all(isinstance(array, np.ndarray) and array.dtype != object for array in arrays.values()):
            raise TypeError("only arrays, and mappings from names to arrays, can be stored")
        path = self._path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, part = tempfile.mkstemp(suffix=".part", dir=path.parent)
        try:
            with os.fdopen(descriptor, "wb") as stream:
                np.savez(stream, **{**arrays, _CHECK: np.array(digest(arrays))})
                stream.flush()
                os.fsync(stream.fileno())
            Path(part).replace(path)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
        self._trim()

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key[2:]}.npz"

    def _trim(self) -> None:
        if self.limit is None:
            return
        kept = []
        for path in self.folder.glob("*/*.npz"):
            with contextlib.suppress(FileNotFoundError):  # another process trims too
                stat = path.stat()
                kept.append((stat.st_mtime_ns, stat.st_size, path))
        excess = sum(size for _, size, _ in kept) - self.limit
        for _, size, path in sorted(kept):
            if excess <= 0:
                return
            path.unlink(missing_ok=True)
            excess -= size


def digest(value: Any) -> str:
    """Hash a value's content: bytes, types and shapes of its arrays, and its numbers to the last bit.

    A dataclass is hashed by its ``key_name`` and its fields. The ``key_name`` is permanent: it stays when the
    class is renamed or moved, so that stored results are found again.

    Raises:
        TypeError: the value is neither of these, or a dataclass without a ``key_name``.
    """
    state = hashlib.sha256()
    for piece in _pieces(value):
        state.update(struct.pack("<Q", len(piece)))
        state.update(piece)
    return state.hexdigest()


def _pieces(value: Any) -> "list[bytes]":
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            raise TypeError("an array of objects cannot be hashed")
        about = f"array {value.dtype.str} {value.shape}".encode()
        return [about, np.ascontiguousarray(value).tobytes()]
    if value is None or isinstance(value, bool | int | str | bytes | np.generic):
        return [f"{type(value).__name__} {value!r}".encode()]
    if isinstance(value, float):
        return [f"float {value.hex()}".encode()]
    if isinstance(value, list | tuple):
        return [f"sequence {len(value)}".encode(), *(p for item in value for p in _pieces(item))]
    if isinstance(value, Mapping):
        items = sorted((str(key), item) for key, item in value.items())
        return [f"mapping {len(items)}".encode(), *(p for pair in items for p in _pieces(pair))]
    if isinstance(value, OnDisk):
        return [f"on disk {value.content_key}".encode()]
    if is_dataclass(value) and not isinstance(value, type):
        name = getattr(value, "key_name", None)
        if not isinstance(name, str):
            raise TypeError(f"{type(value).__qualname__} cannot be hashed: it defines no key_name")
        parts = [(item.name, vars(value)[item.name]) for item in fields(value)]
        return [name.encode(), *(p for part in parts for p in _pieces(part))]
    raise TypeError(f"a {type(value).__qualname__} cannot be hashed; pass arrays, numbers or dataclasses")
