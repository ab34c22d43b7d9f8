"""OBJ, STL and OFF: their shape alone, as their many writers write them, and what is odd of a file.

A file that was cut short is refused here, where it can still be told from one that is whole.
"""

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.sim.solid.polygons import triangulated

_STL_HEADER = 84
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_STL_WORDS = (rb"^\s*solid\b", rb"^\s*endsolid\b", rb"\bfacet\s+normal", rb"\bendfacet\b")
_OFF_KINDS = frozenset({b"OFF", b"COFF", b"NOFF", b"CNOFF"})


@dataclass(frozen=True, eq=False)
class PlainMesh:
    """Triangles of a file without units.

    Attributes:
        vertices: ``(n, 3)`` in the file's unit; may not be numbers.
        faces: ``(m, 3)`` indices, from 0.
        notes: what is odd of the file, a sentence each.
    """

    vertices: FloatArray
    faces: IntArray
    notes: tuple[str, ...] = ()


def read_obj(path: Path) -> PlainMesh:
    """Wavefront OBJ: vertices and faces of any number of corners, numbered from either end or from 0.

    Raises:
        MeshRefused: a face names a vertex that is not there.
        ValueError: a number that is none.
    """
    vertices, corners, lengths = array("d"), array("q"), array("q")
    relative = False
    for words in _logical_lines(path):
        if words[0] == b"v":
            vertices.extend(_place(words))
        elif words[0] == b"f":
            numbers = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            relative |= min(numbers, default=1) < 0
            corners.extend([_absolute(number, len(vertices) // 3, path.name) for number in numbers])
            lengths.append(len(numbers))
    places, used = np.array(vertices).reshape(-1, 3), np.array(corners, dtype=np.int64)
    first, notes = _first_number(used, len(places), relative, path.name)
    return PlainMesh(places, triangulated(places, used - first, np.array(lengths, dtype=np.int64)), notes)


def read_stl(path: Path) -> PlainMesh:
    """STL of either kind, any number of solids.

    Raises:
        MeshRefused: it is cut short.
        ValueError: a number that is none.
    """
    data = path.read_bytes()
    return _text_stl(data, path.name) if _is_text(data) else _binary_stl(data, path.name)


def read_off(path: Path) -> PlainMesh:
    """OFF: faces of any number of corners; colours and normals are left aside.

    Raises:
        MeshRefused: it is cut short, or another kind of OFF.
        ValueError: a number that is none.
    """
    lines = [line.split(b"#", 1)[0].split() for line in path.read_bytes().splitlines()]
    lines = [words for words in lines if words]
    if not lines or lines[0][0] not in _OFF_KINDS:
        raise MeshRefused(f"{path.name} does not begin with OFF; export it again as plain OFF, OBJ or STL")
    counts, rest = (lines[0][1:], lines[1:]) if len(lines[0]) > 1 else (lines[1], lines[2:])
    points, faces = int(counts[0]), int(counts[1])
    if points < 0 or faces < 0 or len(rest) < points + faces:
        raise MeshRefused(
            f"{path.name} is cut short: it announces {points} vertices and {faces} faces, and {len(rest)} "
            "lines follow; export it again"
        )
    places = np.array([[float(word) for word in words[:3]] for words in rest[:points]], np.float64)
    polygons = [_counted(words, points, path.name) for words in rest[points : points + faces]]
    corners = np.array([corner for polygon in polygons for corner in polygon], dtype=np.int64)
    lengths = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    places = places.reshape(-1, 3)
    return PlainMesh(places, triangulated(places, corners, lengths))


def _logical_lines(path: Path) -> Iterator[list[bytes]]:
    """The words of each line that has any, comments left out; one that ends in a backslash goes on."""
    begun: list[bytes] = []
    with path.open("rb") as lines:
        for line in lines:
            words = begun + line.split(b"#", 1)[0].split()
            goes_on = bool(words) and words[-1].endswith(b"\\")
            begun = [*words[:-1], words[-1][:-1]] if goes_on else []
            if words and not goes_on:
                yield [word for word in words if word]


def _place(words: list[bytes]) -> list[float]:
    """Of a vertex line; colours may follow it.

    Raises:
        ValueError: fewer than three numbers.
    """
    x, y, z = (float(word) for word in words[1:4])
    return [x, y, z]


def _absolute(number: int, so_far: int, name: str) -> int:
    """A vertex's number from 1; below zero it counts back from the last one read."""
    if number >= 0:
        return number
    if -number > so_far:
        raise MeshRefused(
            f"{name} has a face with vertex {number}, counted back from the {so_far} before it; the file is "
            "cut short or damaged, export it again"
        )
    return so_far + 1 + number


def _first_number(used: IntArray, count: int, relative: bool, name: str) -> tuple[int, tuple[str, ...]]:
    """The number of the first vertex, and what is odd of it."""
    if not len(used) or used.min() > 0:
        _refuse_beyond(used, count, name)
        return 1, ()
    if relative or used.max() >= count:
        raise MeshRefused(
            f"{name} has a face with vertex 0 and others with vertex {used.max()} of {count}: an OBJ counts "
            "from 1, and this one from neither 0 nor 1; export it again"
        )
    return 0, ("its faces count vertices from 0, where an OBJ counts from 1: taken as they are meant",)


def _refuse_beyond(used: IntArray, count: int, name: str) -> None:
    if len(used) and used.max() > count:
        raise MeshRefused(
            f"{name} has a face with vertex {used.max()}, but {count} vertices; the file is cut short or "
            "damaged, export it again"
        )


def _counted(words: list[bytes], points: int, name: str) -> list[int]:
    """The corners of a face line; colours may follow them."""
    count = int(words[0])
    corners = [int(word) for word in words[1 : count + 1]]
    if len(corners) < count or (corners and not 0 <= min(corners) <= max(corners) < points):
        raise MeshRefused(
            f"{name} has a face of {count} corners that names {len(corners)}, or a vertex that is none of "
            f"its {points}; the file is cut short or damaged, export it again"
        )
    return corners


def _is_text(data: bytes) -> bool:
    """Whether an STL is of words: many a binary one begins with ``solid`` too."""
    if data.lstrip()[:5].lower() != b"solid":
        return False
    announced = int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
    return len(data) != _STL_HEADER + announced * _STL_FACET.itemsize and b"\0" not in data[:_STL_HEADER]


def _text_stl(data: bytes, name: str) -> PlainMesh:
    begun, ended, opened, closed = (len(re.findall(rb"(?mi)" + word, data)) for word in _STL_WORDS)
    places = np.array([[float(word) for word in found] for found in _VERTEX.findall(data)], np.float64)
    places = places.reshape(-1, 3)
    last = data.rstrip().splitlines()[-1].lower()
    whole = begun == ended and opened == closed and len(places) == 3 * opened
    if not (whole and last.split()[0] == b"endsolid"):
        raise MeshRefused(
            f"{name} is cut short: {begun} solids begin and {ended} end, {opened} facets begin and {closed} "
            f"end, on {len(places)} vertices; export it again"
        )
    return PlainMesh(places, np.arange(len(places), dtype=np.int64).reshape(-1, 3))


def _binary_stl(data: bytes, name: str) -> PlainMesh:
    announced = int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
    held, after = divmod(len(data) - _STL_HEADER, _STL_FACET.itemsize)
    if len(data) < _STL_HEADER or announced > held:
        raise MeshRefused(
            f"{name} is cut short: its header announces {announced} triangles, and {max(held, 0)} follow; "
            "export it again"
        )
    notes: tuple[str, ...] = ()
    # A whole number of triangles to the end of the file: the header is wrong, not the file.
    count = held if after == 0 else announced
    if count != announced:
        notes = (f"its header announces {announced} triangles and it holds {held}: all are taken",)
    elif after or held > announced:
        beyond = len(data) - _STL_HEADER - announced * _STL_FACET.itemsize
        notes = (f"{beyond} bytes after its {announced} triangles are left out",)
    facets = np.frombuffer(data, _STL_FACET, count, _STL_HEADER)
    places = facets["corners"].reshape(-1, 3).astype(np.float64)
    return PlainMesh(places, np.arange(len(places), dtype=np.int64).reshape(-1, 3), notes)
