"""Read the grid points and elements of Nastran bulk data in free, small and large fields.

Grid points in other coordinate systems are converted to the basic one. What makes grid points in another way
(other files, superelements) is refused by its name.
"""

import io
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA
from harness.basics.files.text_file import read_text_bytes
from harness.sim.solid.formats.cells import CellBlock, CellFile, node_indices
from harness.sim.solid.plain_formats import MAX_LINE, refuse_number, require_few, show

_ELEMENTS = {
    "CTETRA": {4: "tetra", 10: "tetra10"},
    "CPYRAM": {5: "pyramid", 13: "pyramid13"},
    "CPYRA": {5: "pyramid", 13: "pyramid13"},
    "CPENTA": {6: "wedge", 15: "wedge15"},
    "CHEXA": {8: "hexahedron", 20: "hexahedron20"},
    "CTRIA3": {3: "triangle"},
    "CTRIAR": {3: "triangle"},
    "CTRIA6": {6: "triangle6"},
    "CQUAD4": {4: "quad"},
    "CQUADR": {4: "quad"},
    "CQUAD8": {8: "quad8"},
    "CSHEAR": {4: "quad"},
}
"""Kinds of cells by the name of their entry and the number of their nodes."""

_SURFACES = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 6, "CQUAD4": 4, "CQUADR": 4, "CQUAD8": 8, "CSHEAR": 4}
"""Nodes of entries that further fields follow, of angles and thicknesses."""

_NAME = re.compile(rb"[A-Za-z][A-Za-z0-9]{0,7}")
_EXPONENT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))([+-]\d+)")
"""A number whose exponent has no letter, e.g. 1.5-3."""

_ENTRY = 64
"""Lines of one entry at most."""

_SYSTEMS = re.compile(r"CORD([12])([RCS])")
_SMALL, _LARGE = (8, 8), (16, 4)
"""Width and number of the data fields of a line."""


@dataclass(frozen=True)
class _Entry:
    """A bulk data entry."""

    name: str  #: in upper case, without its star.
    fields: list[bytes]  #: data fields of all its lines, stripped.
    line: int  #: number of its first line, from 1.


@dataclass(frozen=True, eq=False)
class _System:
    """A coordinate system: three points that define it, in another system or by their grid points."""

    kind: str
    reference: int
    points: FloatArray
    grids: tuple[int, ...]
    line: int


def read_nastran(path: Path) -> CellFile:
    """Read the grid points and elements of a bulk data file.

    Raises:
        MeshRefused: damaged, or with entries that are not read, by their names.
    """
    return _Reader(path).read()


class _Reader:
    """One pass over the entries of a file."""

    def __init__(self, path: Path) -> None:
        self._path, self._name = path, path.name
        self._numbers, self._systems_of, self._places = array("q"), array("q"), array("d")
        self._systems: dict[int, _System] = {}
        self._cells: dict[str, tuple[array[int], int]] = {}
        self._default = 0

    def read(self) -> CellFile:
        """Read the file; may be called once."""
        for entry in self._entries():
            if entry.name in ("GRID", "GRDSET"):
                self._read_grid(entry)
            elif entry.name in _ELEMENTS:
                self._read_element(entry)
            elif system := _SYSTEMS.fullmatch(entry.name):
                self._read_system(entry, *system.groups())
            elif entry.name in ("INCLUDE", "SEBULK", "CORD3G", "BEGIN"):
                raise MeshRefused(
                    f"{self._name}, line {entry.line}: {entry.name} is not read; write all into one file"
                )
        require_few(len(self._numbers), "grid points", self._name)
        numbers = np.array(self._numbers, dtype=np.int64)
        order = np.argsort(numbers, kind="stable")
        again = np.flatnonzero(np.diff(numbers[order]) == 0)
        if len(again):
            raise MeshRefused(
                f"{self._name}: there are two grid points {numbers[order[again[0]]]}; export it again"
            )
        points = self._basic(numbers, order)
        blocks = []
        for kind, (nodes, width) in self._cells.items():
            rows = np.array(nodes, dtype=np.int64).reshape(-1, width)
            blocks.append(CellBlock(kind, self._indices(rows, numbers, order)))
        return CellFile(points, tuple(blocks))

    def _entries(self) -> Iterator[_Entry]:
        """Join the lines of each entry of the bulk data section."""
        data = read_text_bytes(self._path, "a Nastran file", MOST_DATA, MeshRefused)
        begin = re.search(rb"(?im)^[ \t]*BEGIN[ \t]+(?:BULK|SUPER).*$", data)
        start, before = (begin.start(), data.count(b"\n", 0, begin.start())) if begin else (0, 0)
        if begin and re.search(rb"(?i)SUPER", begin[0]):
            raise MeshRefused(
                f"{self._name}, line {before + 1}: superelements are not read; export one model"
            )
        include = re.search(rb"(?im)^[ \t]*INCLUDE\b.*$", data[:start])
        if include:
            raise MeshRefused(
                f"{self._name}: {show(include[0].strip())!r} is not read; write it into one file"
            )
        entry: _Entry | None = None
        ended = b""
        for number, line in enumerate(io.BytesIO(memoryview(data)[start:]), before + 1):
            if len(line) > MAX_LINE:
                raise MeshRefused(f"{self._name}, line {number} has more than {MAX_LINE:,} characters")
            text = line.split(b"$", 1)[0].rstrip().expandtabs(8)
            if not text or (begin and number == before + 1):
                continue
            head, fields, tail = _fields(text)
            if head[:1] in (b"+", b"*") or not head:
                entry = self._continued(entry, head, fields, ended, number)
            else:
                if entry is not None:
                    yield entry
                if head.upper() == b"ENDDATA":
                    return
                if not _NAME.fullmatch(head.rstrip(b"*")):
                    raise refuse_number(text.split(), self._name, number, "the name of an entry")
                entry = _Entry(head.rstrip(b"*").decode().upper(), fields, number)
            ended = tail
        if entry is not None:
            yield entry

    def _continued(
        self, entry: _Entry | None, head: bytes, fields: list[bytes], ended: bytes, number: int
    ) -> _Entry | None:
        """Add a continuation line to its entry."""
        marks = head.lstrip(b"+*"), ended.lstrip(b"+*")
        if entry is None or (all(marks) and marks[0] != marks[1]):
            raise MeshRefused(
                f"{self._name}, line {number} continues another entry than the one before it; sort the file"
            )
        if number - entry.line > _ENTRY and len(entry.fields) > _ENTRY * _SMALL[1]:
            if entry.name in _ELEMENTS or entry.name == "GRID":
                raise MeshRefused(
                    f"{self._name}, line {entry.line}: {entry.name} has more than {_ENTRY} lines"
                )
            return entry
        entry.fields.extend(fields)
        return entry

    def _read_grid(self, entry: _Entry) -> None:
        fields = entry.fields + [b""] * 6
        system = self._integer(entry, fields[1], self._default if entry.name == "GRID" else 0)
        if entry.name == "GRDSET":
            self._default = system
            return
        self._numbers.append(self._integer(entry, fields[0]))
        self._systems_of.append(system)
        self._places.extend([self._float(entry, word) for word in fields[2:5]])

    def _read_element(self, entry: _Entry) -> None:
        fields = entry.fields[2:]
        fields = fields[: _SURFACES.get(entry.name, len(fields))]
        nodes = [self._integer(entry, word, 0) for word in fields]
        while nodes and nodes[-1] == 0:
            nodes.pop()
        kind = _ELEMENTS[entry.name].get(len(nodes))
        if kind is None or 0 in nodes:
            wanted = " or ".join(map(str, _ELEMENTS[entry.name]))
            raise MeshRefused(
                f"{self._name}, line {entry.line}: {entry.name} has {sum(map(bool, nodes))} nodes where "
                f"{wanted} are read; export it again"
            )
        stored, _ = self._cells.setdefault(kind, (array("q"), len(nodes)))
        stored.extend(nodes)

    def _read_system(self, entry: _Entry, by: str, kind: str) -> None:
        fields = entry.fields
        if by == "1":  # up to two systems in one entry, by three grid points each
            for first in range(0, len(fields), 4):
                if fields[first]:
                    number, *grids = (
                        self._integer(entry, word) for word in (fields + [b""] * 4)[first : first + 4]
                    )
                    self._systems[number] = _System(kind, 0, np.zeros((0, 3)), tuple(grids), entry.line)
            return
        fields = fields + [b""] * 11
        points = np.array([self._float(entry, word) for word in fields[2:11]]).reshape(3, 3)
        number, reference = self._integer(entry, fields[0]), self._integer(entry, fields[1], 0)
        self._systems[number] = _System(kind, reference, points, (), entry.line)

    def _integer(self, entry: _Entry, word: bytes, blank: int | None = None) -> int:
        try:
            return blank if not word and blank is not None else int(word)
        except ValueError as error:
            raise refuse_number([word], self._name, entry.line, f"a whole number in {entry.name}") from error

    def _float(self, entry: _Entry, word: bytes) -> float:
        text = word.decode("ascii", "replace").upper().replace("D", "E")
        bare = _EXPONENT.fullmatch(text)
        try:
            return float(f"{bare[1]}E{bare[2]}" if bare else text or "0")
        except ValueError as error:
            raise refuse_number([word], self._name, entry.line, f"a coordinate in {entry.name}") from error

    def _basic(self, numbers: IntArray, order: IntArray) -> FloatArray:
        """Convert the grid points of every coordinate system to the basic one."""
        places = np.array(self._places).reshape(-1, 3)
        of, points = np.array(self._systems_of, dtype=np.int64), places.copy()
        done: set[int] = {0}
        waiting = [int(number) for number in np.unique(of) if number != 0]
        frames: dict[int, tuple[str, FloatArray, FloatArray]] = {}

        def frame(number: int, behind: tuple[int, ...]) -> tuple[str, FloatArray, FloatArray]:
            """Compute a system's kind, origin and ``(3, 3)`` axes in the basic system."""
            system = self._systems.get(number)
            if system is None or number in behind or len(behind) > _ENTRY:
                said = "is not defined" if system is None else "is defined by itself"
                raise MeshRefused(f"{self._name}: the coordinate system {number} {said}; export it again")
            if number not in frames:
                if system.grids:
                    at = self._indices(np.array([system.grids]), numbers, order)[0]
                    for other in set(of[at].tolist()) - {0}:
                        convert(other, (*behind, number))
                    corners = points[at]
                elif system.reference:
                    corners = _to_basic(system.points, *frame(system.reference, (*behind, number)))
                else:
                    corners = system.points
                frames[number] = (system.kind, *self._axes(number, corners))
            return frames[number]

        def convert(number: int, behind: tuple[int, ...] = ()) -> None:
            """Convert the grid points of a system."""
            if number not in done:
                made = frame(number, behind)
                points[of == number] = _to_basic(places[of == number], *made)
                done.add(number)

        for number in waiting:
            convert(number)
        return points

    def _axes(self, number: int, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute origin and axes from the origin, a point on z and a point in the plane of x and z."""
        origin, along, plane = corners
        z = along - origin
        y = np.cross(z, plane - origin)
        if not (np.linalg.norm(z) > 0.0 and np.linalg.norm(y) > 0.0):
            raise MeshRefused(f"{self._name}: three points on a line define the coordinate system {number}")
        z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
        return origin, np.array([np.cross(y, z), y, z])

    def _indices(self, rows: IntArray, numbers: IntArray, order: IntArray) -> IntArray:
        return node_indices(rows, numbers, order, f"{self._name}: an entry names grid point")


def _to_basic(places: FloatArray, kind: str, origin: FloatArray, axes: FloatArray) -> FloatArray:
    """Convert ``(n, 3)`` coordinates of a system: rectangular, cylindrical or spherical with degrees."""
    a, b, c = places.T
    if kind == "C":
        places = np.column_stack([a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c])
    elif kind == "S":
        from_z, about = np.radians(b), np.radians(c)
        across = a * np.sin(from_z)
        places = np.column_stack([across * np.cos(about), across * np.sin(about), a * np.cos(from_z)])
    return np.asarray(places @ axes + origin)


def _fields(text: bytes) -> tuple[bytes, list[bytes], bytes]:
    """Split a line into its first field, its data fields padded to a whole line, and its last field."""
    if b"," in text:
        words = [word.strip() for word in text.split(b",")]
        head, count = words[0], _LARGE[1] if words[0].endswith(b"*") or words[0][:1] == b"*" else _SMALL[1]
        data, tail = words[1 : count + 1], b"".join(words[count + 1 : count + 2])
    else:
        head = text[:8].strip()
        width, count = _LARGE if b"*" in head else _SMALL
        data = [text[at : at + width].strip() for at in range(8, 8 + width * count, width)]
        tail = text[8 + width * count :].strip()
    return head, data + [b""] * (count - len(data)), tail
