"""3MF: the objects that the file builds, with their colours, or a refusal that names the cause."""

import zipfile
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import require_unpackable
from harness.picture.srgb import PEAK, linear_from_srgb
from harness.sim.solid.formats.parts import (
    MAX_NODES,
    MAX_TRIANGLES,
    MeshFile,
    MeshPart,
    require_placed,
    require_triangles,
    transform_part,
)
from harness.sim.solid.formats.xml_stream import parse_xml

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
_MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_MODEL_RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
_READ = frozenset({_CORE, _PRODUCTION, _MATERIALS})
_UNITS = {
    "micron": 1e-6,
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}
"""Metres in each unit that a model may state."""
_MAX_VERTICES = 3 * MAX_TRIANGLES // 2
"""Vertices of a 3MF, whose triangles share them: reading so many takes some 10 s."""

_Key = tuple[str, str]


@dataclass(eq=False)
class _Object:
    """An object of a model part: a mesh, or components of other objects."""

    kind: str  #: its ``type``.
    vertices: "array[float]" = field(default_factory=lambda: array("d"))  #: x, y and z of each vertex.
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    """three vertex indices of each triangle."""
    colours: dict[int, tuple[str, int, int, int]] = field(default_factory=dict)
    """of each triangle, its property group and the three entries in it; empty where none has any."""
    default: tuple[str, int] | None = None  #: property group and entry of the object.
    components: list[tuple[_Key, FloatArray]] = field(default_factory=list)  #: object and matrix each.


def read_3mf(path: Path, colours: bool = False) -> MeshFile:
    """Read what the file's build places.

    Args:
        path: a 3MF.
        colours: whether colours are read too.

    Raises:
        MeshRefused: a damaged file, one that unpacks to more than any container may, or one that requires an
            extension that is not read.
    """
    if not zipfile.is_zipfile(path):
        raise MeshRefused(
            f"{path.name} is no ZIP archive, as a 3MF is: it is cut short or damaged, export it again"
        )
    require_unpackable(path, "a 3MF", MeshRefused)
    with zipfile.ZipFile(path) as archive:
        return _Reader(path.name, archive, colours).read()


class _Reader:
    """One archive; its model parts are streamed, so that memory follows the mesh and not the text."""

    def __init__(self, name: str, archive: zipfile.ZipFile, colours: bool) -> None:
        self.name, self.archive, self.colours = name, archive, colours
        self.members = {member.lower().lstrip("/"): member for member in archive.namelist()}
        self.objects: dict[_Key, _Object] = {}
        self.groups: dict[_Key, list[FloatArray]] = {}
        self.items: list[tuple[_Key, FloatArray]] = []
        self.unit = ""
        self.parts_read: set[str] = set()
        self.parts_wanted: list[str] = []
        self.notes: list[str] = []
        self.colour_notes: list[str] = []
        self.triangles = self.vertices = 0

    def read(self) -> MeshFile:
        root = self._root()
        self.parts_wanted.append(root)
        while self.parts_wanted:
            part = self.parts_wanted.pop()
            if part not in self.parts_read:
                self.parts_read.add(part)
                _Model(self, part, is_root=part == root).parse()
        if not self.items:
            raise MeshRefused(f"{self.name} builds nothing: it has no item in <build>; export it again")
        parts = tuple(self._placed())
        if not any(len(part.faces) for part in parts):
            why = f" ({'; '.join(self.notes)})" if self.notes else ""
            raise MeshRefused(
                f"{self.name} holds no triangle of an object of type model{why}; export a surface"
            )
        notes, colour_notes = tuple(dict.fromkeys(self.notes)), tuple(dict.fromkeys(self.colour_notes))
        return MeshFile(parts, _UNITS[self.unit], None, notes, colour_notes)

    def refuse(self, reason: str) -> MeshRefused:
        return MeshRefused(f"{self.name}: {reason}; the file is damaged, export it again")

    def member(self, part: str) -> IO[bytes]:
        """An open member of the archive."""
        name = self.members.get(part.lower().lstrip("/"))
        if name is None:
            raise self.refuse(f"it has no part {part!r}")
        return self.archive.open(name)

    def _root(self) -> str:
        """The part that holds the build, as the package's relations name it."""
        if "_rels/.rels" in self.members:
            found: list[str] = []

            def start(tag: str, attributes: dict[str, str]) -> None:
                if tag.endswith("Relationship") and attributes.get("Type") == _MODEL_RELATION:
                    found.append(attributes.get("Target", ""))

            with self.member("_rels/.rels") as stream:
                parse_xml(stream, start, lambda _: None, f"{self.name}: _rels/.rels")
            if found:
                return found[0].lower().lstrip("/")
        return "3d/3dmodel.model"

    # The build

    def _placed(self) -> Iterator[MeshPart]:
        """Pieces of the build's items, each placed."""
        self._check_amount()
        meshes: dict[_Key, MeshPart] = {}
        waiting = [(key, matrix) for key, matrix in reversed(self.items)]
        while waiting:
            key, matrix = waiting.pop()
            found = self.objects[key]
            if found.kind != "model":
                self.notes.append(f"objects of type {found.kind!r} are no part of the object: left out")
                continue
            waiting += [(of, matrix @ local) for of, local in reversed(found.components)]
            if found.corners:
                if key not in meshes:
                    meshes[key] = self._part(key, found)
                yield transform_part(meshes[key], matrix)

    def _check_amount(self) -> None:
        """Refuse cycles of components, and more pieces or triangles than are read, before they are placed."""
        amounts: dict[_Key, tuple[int, int, int]] = {}
        for first, _ in self.items:
            waiting = [(first, False)]
            above: set[_Key] = set()
            while waiting:
                key, is_left = waiting.pop()
                if key not in self.objects:
                    raise self.refuse(f"object {key[1]!r} is built, and {key[0]} has no such object")
                found = self.objects[key]
                if is_left:
                    above.discard(key)
                    inner = [amounts[of] for of, _ in found.components]
                    own = (1, 1 if found.corners else 0, len(found.corners) // 3)
                    amounts[key] = tuple(map(sum, zip(own, *inner, strict=True)))  # type: ignore[assignment]
                elif key not in amounts:
                    if key in above:
                        raise self.refuse(f"object {key[1]!r} contains itself")
                    above.add(key)
                    waiting.append((key, True))
                    waiting += [(of, False) for of, _ in found.components]
        nodes, pieces, triangles = map(sum, zip(*(amounts[key] for key, _ in self.items), strict=True))
        require_placed(pieces, self.name)
        require_triangles(triangles, self.name)
        if nodes > MAX_NODES:
            raise MeshRefused(
                f"{self.name} nests {nodes:,} components; at most {MAX_NODES:,} are read, join them"
            )

    def _part(self, key: _Key, found: _Object) -> MeshPart:
        vertices = np.array(found.vertices).reshape(-1, 3)
        faces = np.array(found.corners, dtype=np.int64).reshape(-1, 3)
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise self.refuse(
                f"a face of object {key[1]!r} has vertex {faces.max() if faces.min() >= 0 else faces.min()}, "
                f"but there are {len(vertices)} vertices"
            )
        return MeshPart(vertices, faces, self._tints(key[0], found, faces) if self.colours else None)

    def _tints(self, part: str, found: _Object, faces: IntArray) -> FloatArray | None:
        """``(m, 3, 3)`` linear colours of the triangles' corners; None where the file states none."""
        default = None
        if found.default is not None:
            default = self._colour(part, *found.default)
        if default is None and not found.colours:
            return None
        grey = np.full(3, 0.5)
        tints = np.tile(grey if default is None else default, (len(faces), 3, 1))
        for number, (group, *entries) in found.colours.items():
            for corner, entry in enumerate(entries):
                colour = self._colour(part, group, entry)
                if colour is not None:
                    tints[number, corner] = colour
        return tints

    def _colour(self, part: str, group: str, entry: int) -> FloatArray | None:
        colours = self.groups.get((part, group))
        if colours is None:
            self.colour_notes.append(f"colours of property group {group!r} are not read")
            return None
        if not 0 <= entry < len(colours):
            raise self.refuse(f"a colour is entry {entry} of {len(colours)} in property group {group!r}")
        return colours[entry]


class _Model:
    """The handlers of one model part."""

    def __init__(self, reader: _Reader, part: str, is_root: bool) -> None:
        self.reader, self.part, self.is_root = reader, part, is_root
        self.now: _Object | None = None
        self.group: list[FloatArray] | None = None
        self.spaces: dict[str, str] = {}
        self.is_model = False

    def parse(self) -> None:
        with self.reader.member(self.part) as stream:
            where = f"{self.reader.name}: {self.part}"
            parse_xml(stream, self.start, self.end, where, self._declare)
        if not self.is_model:
            raise self.reader.refuse(f"{self.part} is no 3MF model")

    def _declare(self, prefix: str | None, space: str) -> None:
        self.spaces[prefix or ""] = space or ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        space, _, name = tag.rpartition(" ")
        if not self.is_model:
            self._begin(name, attributes)
            return
        if space not in ("", _CORE):
            self._begin_foreign(space, name, attributes)
        elif name == "vertex":
            now = self._mesh(name)
            try:
                now.vertices.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
            except (KeyError, ValueError) as error:
                raise self.reader.refuse(f"a <vertex> without three numbers: {attributes!r:.80}") from error
            self.reader.vertices += 1
            if self.reader.vertices > _MAX_VERTICES:
                raise MeshRefused(
                    f"{self.reader.name} holds more than {_MAX_VERTICES:,} vertices, the most that are read"
                )
        elif name == "triangle":
            self._triangle(self._mesh(name), attributes)
        elif name == "object":
            key = (self.part, attributes.get("id", ""))
            if key in self.reader.objects:
                raise self.reader.refuse(f"two objects have the id {key[1]!r}")
            self.now = _Object(attributes.get("type", "model"))
            if "pid" in attributes:
                self.now.default = (attributes["pid"], self._int(attributes.get("pindex", "0")))
            self.reader.objects[key] = self.now
        elif name == "component":
            self._mesh(name).components.append(self._reference(attributes))
        elif name == "item" and self.is_root and attributes.get("printable", "1") in ("0", "false"):
            self.reader.notes.append("items of the build that are not to be printed are left out")
        elif name == "item" and self.is_root:
            self.reader.items.append(self._reference(attributes))
        elif name == "basematerials":
            self.group = self.reader.groups.setdefault((self.part, attributes.get("id", "")), [])
        elif name == "base" and self.group is not None:
            self.group.append(self._rgb(attributes.get("displaycolor", "")))

    def end(self, tag: str) -> None:
        name = tag.rpartition(" ")[2]
        if name == "object":
            self.now = None
        elif name in ("basematerials", "colorgroup"):
            self.group = None

    def _begin(self, name: str, attributes: dict[str, str]) -> None:
        if name != "model":
            raise self.reader.refuse(f"{self.part} is no 3MF model")
        self.is_model = True
        for prefix in attributes.get("requiredextensions", "").split():
            space = self.spaces.get(prefix, prefix)
            if space not in _READ:
                raise MeshRefused(
                    f"{self.reader.name} requires the 3MF extension {prefix!r} ({space}), which is not read; "
                    "export it without this extension"
                )
        unit = attributes.get("unit", "millimeter")
        if unit not in _UNITS:
            raise MeshRefused(
                f"{self.reader.name} states the unit {unit!r}; 3MF has {', '.join(_UNITS)}: export it again"
            )
        if self.is_root:
            self.reader.unit = unit
        elif unit != self.reader.unit:
            raise self.reader.refuse(f"its parts are in {self.reader.unit} and in {unit}")

    def _begin_foreign(self, space: str, name: str, attributes: dict[str, str]) -> None:
        """An element of an extension."""
        if space != _MATERIALS:
            if self.now is not None:
                self.reader.notes.append(f"an object's <{name}> ({space}) is not read")
        elif name == "colorgroup":
            self.group = self.reader.groups.setdefault((self.part, attributes.get("id", "")), [])
        elif name == "color" and self.group is not None:
            self.group.append(self._rgb(attributes.get("color", "")))

    def _mesh(self, name: str) -> _Object:
        if self.now is None:
            raise self.reader.refuse(f"a <{name}> stands outside an object")
        return self.now

    def _triangle(self, now: _Object, attributes: dict[str, str]) -> None:
        self.reader.triangles += 1
        require_triangles(self.reader.triangles, self.reader.name)
        try:
            now.corners.extend([int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])])
        except (KeyError, ValueError, OverflowError) as error:
            raise self.reader.refuse(
                f"a <triangle> without three vertex numbers: {attributes!r:.80}"
            ) from error
        if self.reader.colours and "p1" in attributes:
            group = attributes.get("pid", "" if now.default is None else now.default[0])
            first = self._int(attributes["p1"])
            others = (self._int(attributes.get(key, attributes["p1"])) for key in ("p2", "p3"))
            now.colours[len(now.corners) // 3 - 1] = (group, first, *others)  # type: ignore[assignment]

    def _reference(self, attributes: dict[str, str]) -> tuple[_Key, FloatArray]:
        """The object that a component or an item places, and its matrix."""
        path = attributes.get(f"{_PRODUCTION} path")
        part = self.part if path is None else path.lower().lstrip("/")
        self.reader.parts_wanted.append(part)
        matrix = np.eye(4)
        if "transform" in attributes:
            try:
                rows = np.array([float(word) for word in attributes["transform"].split()]).reshape(4, 3)
            except ValueError as error:
                raise self.reader.refuse(f"a transform is {attributes['transform']!r:.80}") from error
            # A point is a row there: its matrix is ours transposed.
            matrix[:3] = rows.T
            if not np.all(np.isfinite(rows)) or np.linalg.det(matrix[:3, :3]) == 0.0:
                raise self.reader.refuse(f"a transform is {attributes['transform']!r:.80}")
        return (part, attributes.get("objectid", "")), matrix

    def _int(self, text: str) -> int:
        try:
            return int(text)
        except ValueError as error:
            raise self.reader.refuse(f"{text!r:.40} is no whole number") from error

    def _rgb(self, text: str) -> FloatArray:
        """Linear colour of ``#RRGGBB`` or ``#RRGGBBAA`` in sRGB."""
        try:
            levels = bytes.fromhex(text.removeprefix("#"))
        except ValueError:
            levels = b""
        if len(levels) not in (3, 4):
            raise self.reader.refuse(f"a colour is {text!r:.40}; #RRGGBB is needed")
        if len(levels) == 4 and levels[3] < PEAK:
            self.reader.colour_notes.append("a colour is partly transparent: rendered opaque")
        return linear_from_srgb(np.array(list(levels[:3])) / PEAK)
