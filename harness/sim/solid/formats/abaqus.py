"""Read the nodes and elements of an Abaqus input file, with its parts placed by their instances.

Keywords that make nodes or elements in a way that is not read here are refused by their names: the object
without them would be another one.
"""

import re
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA
from harness.basics.files.text_file import read_text_bytes
from harness.sim.solid.formats.cells import CellBlock, CellFile, node_indices
from harness.sim.solid.plain_formats import refuse_number, require_few, show

_REFUSED = frozenset(
    {
        *("INCLUDE", "SYSTEM", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "PARAMETER", "IMPORT"),
        *("SYMMETRIC MODEL GENERATION", "SUBSTRUCTURE GENERATE", "IMPERFECTION"),
    }
)
"""Keywords that make, move or remove nodes or elements."""

_SOLID = re.compile(r"(?:DC|AC|C)3D(\d+)")
_SHELL = re.compile(r"(?:DS|SFM3D|STRI|S|R3D|M3D|F3D|CPEG|CPE|CPS|CAX|DC2D|AC2D)(\d+)")
_SOLID_KINDS = {
    4: "tetra",
    5: "pyramid",
    6: "wedge",
    8: "hexahedron",
    10: "tetra10",
    15: "wedge15",
    20: "hexahedron20",
    27: "hexahedron27",
}
_SHELL_KINDS = {3: "triangle", 4: "quad", 6: "triangle6", 65: "triangle6", 8: "quad8", 9: "quad9"}
_CORNERS = {"triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 9, "tetra": 4, "pyramid": 5} | {
    "wedge": 6,
    "hexahedron": 8,
    "tetra10": 10,
    "wedge15": 15,
    "hexahedron20": 20,
    "hexahedron27": 27,
}

_MOST_INSTANCES = 10_000
_MAX_KEYWORD = 4096
"""Characters of a keyword line with its continuations."""


@dataclass
class _Scope:
    """Nodes, elements and sets of a part, of an instance, or of the file outside all parts."""

    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    places: "array[float]" = field(default_factory=lambda: array("d"))
    elements: list[tuple[str, IntArray, int]] = field(default_factory=list)
    sets: dict[str, list[int | str]] = field(default_factory=dict)

    def is_empty(self) -> bool:
        """Test for a scope without elements."""
        return not self.elements


@dataclass
class _Instance:
    """A part placed in the assembly."""

    name: str
    part: str
    line: int
    placement: list[list[float]] = field(default_factory=list)
    own: _Scope = field(default_factory=_Scope)


@dataclass(frozen=True)
class _Keyword:
    """A keyword line and where it is."""

    name: str  #: in upper case, without its star.
    options: dict[str, str]  #: values by their names in upper case; "" for an option without a value.
    line: int  #: its number, from 1.


def read_abaqus(path: Path) -> CellFile:
    """Read nodes, elements and node sets; every instance of a part is placed as the assembly states.

    Raises:
        MeshRefused: damaged, or made by keywords that are not read, by their names.
    """
    return _Reader(path).read()


class _Reader:
    """One pass over the lines of a file."""

    def __init__(self, path: Path) -> None:
        self._name = path.name
        self._lines = _numbered_lines(path)
        self._flat = _Scope()
        self._parts: dict[str, _Scope] = {}
        self._instances: list[_Instance] = []
        self._scope = self._flat
        self._left_out: set[str] = set()
        self._assembly_sets: list[tuple[str, str, list[int | str]]] = []
        self._data: list[tuple[int, bytes]] = []
        self._readers: dict[str, Callable[[_Keyword], None]] = {
            "NODE": self._read_nodes,
            "ELEMENT": self._read_elements,
            "NSET": self._read_set,
            "PART": self._begin_part,
            "END PART": self._leave,
            "INSTANCE": self._begin_instance,
            "END INSTANCE": self._leave,
        }

    def read(self) -> CellFile:
        """Read the file; may be called once."""
        item = next(self._lines, None)
        while item is not None:
            line, text = item
            if not text.startswith(b"*"):
                item = next(self._lines, None)
                continue
            keyword, item = self._keyword(line, text)
            self._data = []
            while item is not None and not item[1].startswith(b"*"):
                self._data.append(item)
                item = next(self._lines, None)
            if keyword.name in _REFUSED:
                self._refuse(
                    keyword, f"*{keyword.name} is not read; write all nodes and elements into the file"
                )
            if keyword.name in self._readers:
                self._readers[keyword.name](keyword)
        return self._placed()

    def _keyword(self, line: int, text: bytes) -> tuple[_Keyword, tuple[int, bytes] | None]:
        """Read a keyword line, which continues after a comma, and the line after it."""
        following = next(self._lines, None)
        while text.endswith(b",") and following is not None and not following[1].startswith(b"*"):
            text += following[1]
            if len(text) > _MAX_KEYWORD:
                raise MeshRefused(
                    f"{self._name}, line {line}: a keyword has over {_MAX_KEYWORD:,} characters"
                )
            following = next(self._lines, None)
        first, *options = text[1:].decode("utf-8", "replace").split(",")
        pairs = (option.partition("=") for option in options if option.strip())
        named = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
        return _Keyword(" ".join(first.split()).upper(), named, line), following

    def _refuse(self, keyword: _Keyword, sentence: str) -> NoReturn:
        raise MeshRefused(f"{self._name}, line {keyword.line}: {sentence}")

    def _begin_part(self, keyword: _Keyword) -> None:
        name = keyword.options.get("NAME", "")
        if name.upper() in self._parts:
            self._refuse(keyword, f"there are two parts {name!r}; export the file again")
        self._scope = self._parts[name.upper()] = _Scope()

    def _begin_instance(self, keyword: _Keyword) -> None:
        options = keyword.options
        if "PART" not in options:
            self._refuse(
                keyword, "*INSTANCE without PART= takes its mesh from another file, which is not read"
            )
        if len(self._instances) >= _MOST_INSTANCES:
            self._refuse(keyword, f"there are more than {_MOST_INSTANCES:,} instances; at most that are read")
        placement = [self._floats(line, text, 7) for line, text in self._data if text]
        if [len(row) for row in placement] not in ([], [3], [3, 7]):
            self._refuse(
                keyword, "an instance is placed by 3 numbers, then 7 for a rotation; export it again"
            )
        instance = _Instance(options.get("NAME", options["PART"]), options["PART"], keyword.line, placement)
        self._instances.append(instance)
        self._scope = instance.own

    def _leave(self, _: _Keyword) -> None:
        self._scope = self._flat

    def _read_nodes(self, keyword: _Keyword) -> None:
        system = keyword.options.get("SYSTEM", "R").upper()
        if "INPUT" in keyword.options:
            self._refuse(
                keyword, f"*NODE, INPUT={keyword.options['INPUT']} is not read; write the nodes here"
            )
        if system not in ("R", "C"):
            self._refuse(keyword, f"*NODE, SYSTEM={system} is not read; give rectangular coordinates (R)")
        for line, text in self._data:
            if not text:
                continue
            if text.rstrip(b", ").count(b",") > 3 and b"." not in text:  # a normal may follow the coordinates
                raise MeshRefused(
                    f"{self._name}, line {line}: {show(text)!r} has decimal commas; export it with points"
                )
            number, *place = self._floats(line, text, 4)
            place += [0.0] * (3 - len(place))
            if system == "C":
                angle = np.radians(place[1])
                place[:2] = place[0] * np.cos(angle), place[0] * np.sin(angle)
            self._scope.numbers.append(int(number))
            self._scope.places.extend(place)
        require_few(len(self._scope.numbers), "nodes", self._name)

    def _read_elements(self, keyword: _Keyword) -> None:
        # Name the kind of cell of an element type; None for springs, masses, beams and others without one.
        element = keyword.options.get("TYPE", "").upper()
        solid = _SOLID.match(element)
        if solid:
            kind = _SOLID_KINDS.get(int(solid[1]))
        else:
            shell = _SHELL.match(element)
            kind = _SHELL_KINDS.get(int(shell[1])) if shell else None
        if "INPUT" in keyword.options:
            self._refuse(keyword, f"*ELEMENT, INPUT={keyword.options['INPUT']} is not read; write them here")
        if kind is None:
            self._left_out.add(keyword.options.get("TYPE", "without a type"))
            return
        numbers = array("q")
        for line, text in self._data:
            numbers.extend(self._integers(line, text))
        width = _CORNERS[kind] + 1
        if len(numbers) % width:
            self._refuse(
                keyword,
                f"{len(numbers)} numbers are no whole number of elements of {width - 1} nodes; the file is "
                "cut short or damaged, export it again",
            )
        if not numbers:
            self._refuse(keyword, "no element follows; the file is cut short or damaged, export it again")
        require_few(len(numbers) // width, "elements", self._name)
        rows = np.array(numbers, dtype=np.int64).reshape(-1, width)[:, 1:]
        self._scope.elements.append((kind, rows, keyword.line))

    def _read_set(self, keyword: _Keyword) -> None:
        """Read a set of nodes; those of which the members cannot be named are left out."""
        name = keyword.options.get("NSET", "")
        members: list[int | str] = []
        for line, text in self._data:
            words = [word.strip() for word in text.split(b",") if word.strip()]
            if "GENERATE" in keyword.options:
                first, last, *step = self._integers(line, text) or (0, -1)
                if (last - first) / max(1, *step, 1) > len(self._scope.numbers) + len(
                    self._flat.numbers
                ) + 1e6:
                    self._refuse(
                        keyword, f"the set {name!r} names more nodes than there are; export it again"
                    )
                members.extend(range(first, last + 1, *step[:1]))
            else:
                members.extend(int(word) if word.isdigit() else show(word).strip('"') for word in words)
        if self._instances and self._scope is self._flat:
            self._assembly_sets.append((name, keyword.options.get("INSTANCE", ""), members))
        else:
            self._scope.sets.setdefault(name, []).extend(members)

    def _floats(self, line: int, text: bytes, most: int) -> list[float]:
        words = text.rstrip(b", ").split(b",")
        try:
            return [float(word.replace(b"D", b"E").replace(b"d", b"e")) for word in words[:most]]
        except ValueError as error:
            raise refuse_number(words, self._name, line, "numbers with commas between them") from error

    def _integers(self, line: int, text: bytes) -> list[int]:
        words = [word for word in text.split(b",") if word.strip()]
        try:
            return [int(word) for word in words]
        except ValueError as error:
            raise refuse_number(words, self._name, line, "whole numbers with commas between them") from error

    def _placed(self) -> CellFile:
        """Place every instance, and join them with what lies outside all parts."""
        notes = []
        pieces: list[tuple[_Scope, str, FloatArray, FloatArray]] = []
        unmoved = np.eye(3), np.zeros(3)
        for instance in self._instances:
            part = self._parts.get(instance.part.upper())
            if part is None:
                raise MeshRefused(
                    f"{self._name}, line {instance.line}: there is no part {instance.part!r}; export it again"
                )
            scope = part if instance.own.is_empty() else instance.own
            pieces.append((scope, instance.name, *_placement(instance.placement)))
        if not self._instances:
            pieces.extend((part, name, *unmoved) for name, part in self._parts.items())
        elif unused := self._parts.keys() - {instance.part.upper() for instance in self._instances}:
            notes.append(f"{len(unused)} parts without an instance are left out")
        pieces.append((self._flat, "", *unmoved))
        if len(pieces) > 2:
            notes.append(
                f"{len(pieces) - 1} {'instances' if self._instances else 'parts'} are read as one object"
            )
        if self._left_out:
            notes.append(
                f"elements of type {', '.join(sorted(self._left_out)[:5])} are left out: they have no volume"
            )
        return _joined(pieces, self._assembly_sets, tuple(notes), self._name)


def _numbered_lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Split a file into lines with their numbers, stripped and without comments."""
    data = read_text_bytes(path, "an Abaqus file", MOST_DATA, MeshRefused)
    start = number = 0
    while start <= len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        number += 1
        text = data[start:end].strip()
        if not text.startswith(b"**"):
            yield number, text
        start = end + 1


def _placement(rows: list[list[float]]) -> tuple[FloatArray, FloatArray]:
    """Convert the lines of an instance to a rotation matrix and an offset: it is moved, then rotated."""
    moved = np.array(rows[0]) if rows else np.zeros(3)
    if len(rows) < 2:
        return np.eye(3), moved
    start, end, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), rows[1][6]
    axis = end - start
    length = float(np.linalg.norm(axis))
    turn = np.eye(3) if length == 0.0 else Rotation.from_rotvec(np.radians(angle) * axis / length).as_matrix()
    return turn, turn @ (moved - start) + start


def _joined(
    pieces: list[tuple[_Scope, str, FloatArray, FloatArray]],
    assembly_sets: list[tuple[str, str, list[int | str]]],
    notes: tuple[str, ...],
    name: str,
) -> CellFile:
    """Join placed pieces: nodes one after the other, cells and sets by their new indices."""
    points, blocks = [np.zeros((0, 3))], []
    sets: dict[str, list[IntArray]] = {}
    scopes: dict[str, tuple[_Scope, IntArray, int]] = {}
    before = 0
    require_few(sum(len(scope.numbers) for scope, *_ in pieces), "nodes with all instances", name)
    require_few(
        sum(len(rows) for scope, *_ in pieces for _, rows, _ in scope.elements),
        "elements with all instances",
        name,
    )
    for scope, instance, turn, offset in pieces:
        places = np.array(scope.places).reshape(-1, 3)
        order = _order(scope, places, name)
        for kind, rows, line in scope.elements:
            where = f"{name}, line {line}: an element names node"
            numbers = np.array(scope.numbers, dtype=np.int64)
            blocks.append(CellBlock(kind, before + node_indices(rows, numbers, order, where)))
        for label in scope.sets:
            found = before + _members(scope.sets[label], scope, order)
            for known in (label, f"{instance}.{label}") if instance else (label,):
                sets.setdefault(known, []).append(found)
        scopes[instance.upper()] = (scope, order, before)
        points.append(places @ turn.T + offset)
        before += len(places)
    for label, instance, members in assembly_sets:
        scope, order, first = scopes.get(instance.upper(), scopes[""])
        sets.setdefault(label, []).append(first + _members(members, scope, order))
    joined = {label: np.unique(np.concatenate(found)) for label, found in sets.items()}
    return CellFile(np.concatenate(points), tuple(blocks), joined, notes)


def _order(scope: _Scope, places: FloatArray, name: str) -> IntArray:
    """Sort a scope's nodes by their numbers, and refuse two of one number in different places."""
    numbers = np.array(scope.numbers, dtype=np.int64)
    order = np.argsort(numbers, kind="stable")
    again = np.flatnonzero(np.diff(numbers[order]) == 0)
    moved = again[(places[order[again]] != places[order[again + 1]]).any(axis=1)]
    if len(moved):
        raise MeshRefused(
            f"{name}: node {numbers[order[moved[0]]]} has two different places; export it again"
        )
    return order


def _members(members: list[int | str], scope: _Scope, order: IntArray) -> IntArray:
    """Convert the numbers and set names in a set of nodes to indices; unknown ones are left out."""
    wanted = {member for member in members if isinstance(member, int)}
    for member in members:
        if isinstance(member, str):
            wanted.update(inner for inner in scope.sets.get(member, ()) if isinstance(inner, int))
    numbers = np.array(scope.numbers, dtype=np.int64)[order]
    return np.asarray(order[np.isin(numbers, np.array(sorted(wanted), dtype=np.int64))], dtype=np.int64)
