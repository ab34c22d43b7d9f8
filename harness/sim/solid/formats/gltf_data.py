"""Data of a glTF 2.0 or GLB file: its JSON tree, buffers and accessors, each checked before it is used.

Every number of the file that leads to memory is compared with the bytes that the file holds before anything
is allocated.
"""

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, MOST_JSON, read_bounded
from harness.basics.files.referenced_file import referenced_path
from harness.sim.solid.formats.parts import MAX_VERTICES

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Number types by the code of an accessor's component type."""

_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_MAX_INDEX = 2**53
_MAX_JSON_VALUES = 5_000_000
"""Lists and objects of JSON: so many take 0.5 GB of memory and some seconds."""


@dataclass(eq=False)
class GltfData:
    """The JSON tree of one file with checked access to its entries and to its binary data."""

    path: Path
    tree: dict[str, Any]
    binary: bytes | None
    loaded: dict[int, bytes] = field(default_factory=dict, init=False)

    # Checked access

    def refuse(self, reason: str) -> MeshRefused:
        """Build the error of a damaged file."""
        return MeshRefused(f"{self.path.name}: {reason}; the file is damaged, export it again")

    def entries(self, key: str) -> list[Any]:
        """Return the file's list ``key``; empty where it has none."""
        found = self.tree.get(key, [])
        if not isinstance(found, list):
            raise self.refuse(f"{key} is no list")
        return found

    def index(self, value: Any, key: str, what: str) -> int:
        """``value`` if it is an index into the file's list ``key``."""
        count = len(self.entries(key))
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < count:
            raise self.refuse(f"{what} is number {shown(value)} of {count} {key}")
        return value

    def entry(self, key: str, value: Any, what: str) -> dict[str, Any]:
        """Entry ``value`` of the file's list ``key``."""
        return self.mapping(self.entries(key)[self.index(value, key, what)], what)

    def mapping(self, value: Any, what: str) -> dict[str, Any]:
        """Return ``value`` if it is a JSON object."""
        if not isinstance(value, dict):
            raise self.refuse(f"{what} is no JSON object")
        return value

    def count(self, value: Any, what: str, least: int = 0) -> int:
        """Return ``value`` if it is a whole number of at least ``least``."""
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value < _MAX_INDEX:
            raise self.refuse(f"{what} is {shown(value)}; a whole number of at least {least} is needed")
        return value

    def numbers(self, value: Any, length: int, what: str) -> FloatArray:
        """Return ``value`` if it is a list of ``length`` finite numbers."""
        good = isinstance(value, list) and len(value) == length
        if not good or not all(isinstance(each, (int, float)) for each in value):
            raise self.refuse(f"{what} is {shown(value)}; {length} numbers are needed")
        try:
            found = np.array(value, np.float64)
        except OverflowError:
            found = np.full(length, np.inf)
        if not np.all(np.isfinite(found)):
            raise self.refuse(f"{what} is {shown(value)}; {length} finite numbers are needed")
        return found

    def extension(self, of: dict[str, Any], name: str) -> dict[str, Any] | None:
        """Return the named extension of an entry; None where it has none."""
        extensions = self.mapping(of.get("extensions", {}), "extensions")
        return self.mapping(extensions[name], name) if name in extensions else None

    # Bytes

    def _buffer(self, number: int) -> bytes:
        if number not in self.loaded:
            buffer = self.entry("buffers", number, "a buffer")
            length = self.count(buffer.get("byteLength"), "a buffer's byteLength", 1)
            if "uri" in buffer:
                data = self._resource(buffer["uri"], "a buffer")
            elif number == 0 and self.binary is not None:
                data = self.binary
            else:
                named = self.mapping(buffer.get("extensions", {}), "extensions")
                because = f" (the data is in {', '.join(named)})" if named else ""
                raise self.refuse(f"buffer {number} has no data{because}")
            if len(data) < length:
                raise self.refuse(f"buffer {number} states {length:,} bytes and has {len(data):,}")
            self.loaded[number] = data[:length]
        return self.loaded[number]

    def _resource(self, uri: Any, what: str) -> bytes:
        """The bytes of a data URI or of a file in the mesh's folder."""
        if not isinstance(uri, str):
            raise self.refuse(f"the address of {what} is {shown(uri)}")
        if uri.startswith("data:"):
            head, comma, body = uri.partition(",")
            if not comma or not head.endswith(";base64"):
                raise self.refuse(f"the data URI of {what} is not base64")
            try:
                return base64.b64decode(body, validate=True)
            except (binascii.Error, ValueError) as error:
                raise self.refuse(f"the data URI of {what} is not base64") from error
        found = referenced_path(self.path, uri, MeshRefused)
        if found is None:
            raise MeshRefused(
                f"{self.path.name} refers to {uri!r} for {what}, and there is no such file in its folder"
            )
        return read_bounded(found, what, MOST_DATA, MeshRefused)

    def _view(self, number: Any, what: str) -> tuple[bytes, int]:
        """The bytes of a buffer view, and its stride (0 where it states none)."""
        view = self.entry("bufferViews", number, what)
        compressed = [name for name in view.get("extensions", {}) if "meshopt" in name]
        data = self._buffer(self.index(view.get("buffer"), "buffers", "a buffer view's buffer"))
        offset = self.count(view.get("byteOffset", 0), "a buffer view's byteOffset")
        length = self.count(view.get("byteLength"), "a buffer view's byteLength", 1)
        if offset + length > len(data):
            because = f" (compressed by {compressed[0]})" if compressed else ""
            raise self.refuse(
                f"buffer view {number} ends at byte {offset + length:,} of a buffer of {len(data):,}{because}"
            )
        return data[offset : offset + length], self.count(view.get("byteStride", 0), "a stride")

    def accessor(self, number: Any, widths: tuple[str, ...], what: str) -> FloatArray:
        """``(count, width)`` values of an accessor; normalised integers as 0 to 1 or -1 to 1."""
        accessor = self.entry("accessors", number, what)
        kind, component = accessor.get("type"), accessor.get("componentType")
        if kind not in widths or component not in COMPONENTS:
            raise self.refuse(
                f"{what} is of type {shown(kind)} and component type {shown(component)}; "
                f"{' or '.join(widths)} is needed"
            )
        count = self.count(accessor.get("count"), f"the count of {what}", 1)
        # More elements than this make more triangles than are read, whatever they are for.
        if count > MAX_VERTICES:
            raise self.refuse(f"{what} states {count:,} elements; at most {MAX_VERTICES:,} are read")
        dtype, width = np.dtype(COMPONENTS[component]), _WIDTHS[kind]
        if "bufferView" in accessor:
            offset = self.count(accessor.get("byteOffset", 0), f"the byteOffset of {what}")
            values = self._strided(accessor["bufferView"], offset, count, width, dtype, what)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._substituted(values, self.mapping(accessor["sparse"], "sparse"), what)
        if accessor.get("normalized") is True and dtype.kind in "iu":
            return np.asarray(np.maximum(values / float(np.iinfo(dtype).max), -1.0))
        return np.asarray(values, np.float64)

    def _strided(
        self, view: Any, offset: int, count: int, width: int, dtype: "np.dtype[Any]", what: str
    ) -> Any:
        data, stride = self._view(view, f"the buffer view of {what}")
        size = width * dtype.itemsize
        stride = stride or size
        if stride < size:
            raise self.refuse(f"{what} has elements of {size} bytes every {stride} bytes")
        if offset + stride * (count - 1) + size > len(data):
            raise self.refuse(
                f"{what} states {count:,} elements of {size} bytes in a view of {len(data):,} bytes"
            )
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize)).copy()

    def _substituted(self, values: Any, sparse: dict[str, Any], what: str) -> Any:
        """An accessor's values after its sparse substitution."""
        count = self.count(sparse.get("count"), f"the sparse count of {what}", 1)
        of = self.mapping(sparse.get("indices"), "the sparse indices")
        new = self.mapping(sparse.get("values"), "the sparse values")
        if of.get("componentType") not in (5121, 5123, 5125) or count > len(values):
            raise self.refuse(f"the sparse part of {what} is no list of at most {len(values)} elements")
        start = self.count(of.get("byteOffset", 0), "a sparse byteOffset")
        where = self._strided(
            of.get("bufferView"), start, count, 1, np.dtype(COMPONENTS[of["componentType"]]), what
        )[:, 0].astype(np.int64)
        if where.max() >= len(values):
            raise self.refuse(f"the sparse part of {what} changes element {where.max()} of {len(values)}")
        start = self.count(new.get("byteOffset", 0), "a sparse byteOffset")
        values[where] = self._strided(
            new.get("bufferView"), start, count, values.shape[1], values.dtype, what
        )
        return values


def split_glb(data: bytes, name: str) -> tuple[dict[str, Any], bytes | None]:
    """Split a GLB into its JSON tree and its binary chunk."""
    if len(data) < 20:
        raise MeshRefused(
            f"{name} is cut short: {len(data)} bytes, and a GLB begins with 20; export it again"
        )
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise MeshRefused(f"{name} is a GLB of version {version}; export it as glTF 2.0")
    if length > len(data):
        raise MeshRefused(
            f"{name} is cut short: it states {length:,} bytes and has {len(data):,}; export it again"
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > length:
            raise MeshRefused(
                f"{name} is cut short: a chunk of {size:,} bytes begins at byte {at + 8:,} of {length:,}; "
                "export it again"
            )
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if b"JSON" not in chunks:
        raise MeshRefused(f"{name} has no JSON chunk; export it again")
    return parse_json(chunks[b"JSON"], name), chunks.get(b"BIN\0")


def parse_json(data: bytes, name: str) -> dict[str, Any]:
    """Parse the JSON tree of a glTF file."""
    if len(data) > MOST_JSON and b'"data:' not in data:
        raise MeshRefused(
            f"{name} has {len(data) / 2**20:,.0f} MiB of JSON; at most {MOST_JSON / 2**20:,.0f} MiB are read"
        )
    if data.count(b"[") + data.count(b"{") > _MAX_JSON_VALUES:
        raise MeshRefused(
            f"{name} holds more than {_MAX_JSON_VALUES:,} lists and objects of JSON, the maximum"
        )
    try:
        tree = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError, MemoryError) as error:
        raise MeshRefused(
            f"{name} is no readable JSON: it is cut short or damaged, export it again"
        ) from error
    if not isinstance(tree, dict):
        raise MeshRefused(f"{name} is JSON, but no glTF: its top level is no object; export it again")
    return tree


def shown(value: Any) -> str:
    """A value of the file for a message: short, and without control characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
