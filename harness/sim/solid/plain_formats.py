"""OBJ, STL and OFF: their shape alone, as their many writers write them, and what is odd of a file.

A file that was cut short is refused here, where it can still be told from one that is whole.
"""

import io
import re
import tempfile
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, read_bounded
from harness.basics.files.text_file import GZIP, plain_bytes, read_text_bytes, unpack
from harness.sim.solid.polygons import triangulated

MAX_ELEMENTS = 4_000_000
"""Vertices or faces of one text file: more do not fit into the memory of later stages."""

MAX_LINE = 2**20
"""Bytes of one line: a polygon of 100,000 corners has fewer."""

_MAX_SHOWN = 40
_SEPARATOR = re.compile(rb";|\xc2\xa0")
_SEPARATOR_NAMES = {b";": "semicolons", b",": "commas", b"\xc2\xa0": "no-break spaces"}
_DECIMAL_COMMA = re.compile(rb"[+-]?\d*,\d+(?:[eE][+-]?\d+)?,?")


_STL_HEADER = 84
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_STL_WORDS = (rb"^\s*solid\b", rb"^\s*endsolid\b", rb"\bfacet\s+normal", rb"\bendfacet\b")
_OFF_KINDS = frozenset({b"OFF", b"COFF", b"NOFF", b"CNOFF"})

_OBJ_SHAPES = frozenset({b"surf", b"curv", b"bzp", b"bsp", b"cdp", b"cdc", b"res", b"call", b"csh"})
"""Statements of an OBJ that hold shape in another way than faces do: free-form surfaces, and other files."""

_SEPARATED_STATEMENT = re.compile(rb"[vf](;|,|\xc2\xa0)")
"""A vertex or face statement of an OBJ whose words have no spaces between them."""

_MAX_LINES = 3 * MAX_ELEMENTS
"""Lines of a text file: vertices, faces, and all that is left out."""

_WEIGHTED = 5
"""Words of a vertex statement that ends with a weight."""

_HEADER = 2**16
"""Bytes in which the header ends."""

_SINGLE = (b"float", b"float32")

_COUNTS = re.compile(rb"\$(?:Nodes|Elements)[ \t\r]*\n[ \t]*(\d{1,20})(?:[ \t]+(\d{1,20}))?")
"""Numbers of blocks and of nodes or elements that a Gmsh file announces."""


@dataclass(frozen=True, eq=False)
class PlainMesh:
    """Triangles of a file without units."""

    vertices: FloatArray  #: ``(n, 3)`` in the file's unit; may not be numbers.
    faces: IntArray  #: ``(m, 3)`` indices, from 0.
    notes: tuple[str, ...] = ()  #: what is odd of the file, a sentence each.
    single: bool = False  #: the file holds float32 coordinates.


def read_obj(path: Path) -> PlainMesh:
    """Read the polygons of a Wavefront OBJ, numbered from 1, from 0 or backwards.

    Raises:
        MeshRefused: a face names a vertex that is not there, a word is not a number, or the file holds
            free-form surfaces or names other files.
    """
    vertices, corners, lengths = array("d"), array("q"), array("q")
    relative, name = False, path.name
    for line, words in _logical_lines(path):
        kind = words[0]
        if kind == b"v":
            vertices.extend(_place(words, name, line))
            require_few(len(vertices) // 3, "vertices", name)
        elif kind == b"f":
            try:
                numbers = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            except ValueError as error:
                raise refuse_number(words[1:], name, line, "the numbers of vertices") from error
            relative |= min(numbers, default=1) < 0
            corners.extend([_absolute(number, len(vertices) // 3, name) for number in numbers])
            lengths.append(len(numbers))
            require_few(len(corners) // 3, "faces", name)
        elif kind in _OBJ_SHAPES:
            raise MeshRefused(
                f"{name}, line {line}: the statement {show(kind)!r} is not read; export polygons only"
            )
        elif (separated := _SEPARATED_STATEMENT.match(kind)) is not None:
            raise _refuse_separator(separated[1], name, line)
    places, used = np.array(vertices).reshape(-1, 3), np.array(corners, dtype=np.int64)
    first, notes = _first_number(used, len(places), relative, name)
    return PlainMesh(places, triangulated(places, used - first, np.array(lengths, dtype=np.int64)), notes)


def read_stl(path: Path) -> PlainMesh:
    """Read an STL, text or binary, of any number of solids.

    Raises:
        MeshRefused: it is cut short, or a word is not a number.
    """
    data = unpack(
        read_bounded(path, "an STL", MOST_DATA, MeshRefused), path, "an STL", MOST_DATA, MeshRefused
    )
    # A binary STL is known by its length: many a header begins with ``solid``, as a text does.
    announced = int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
    if len(data) != _STL_HEADER + announced * _STL_FACET.itemsize:
        text = plain_bytes(data, path, MeshRefused)
        if text.lstrip()[:5].lower() == b"solid" and b"\0" not in text[:_STL_HEADER]:
            return _text_stl(text, path.name)
    return _binary_stl(data, path.name)


def read_off(path: Path) -> PlainMesh:
    """Read an OFF with faces of any number of corners; colours and normals are left out.

    Raises:
        MeshRefused: it is cut short, another kind of OFF, or a word is not a number.
    """
    name = path.name
    lines = _logical_lines(path)
    line, words = next(lines, (1, [b""]))
    if words[0] not in _OFF_KINDS:
        raise MeshRefused(f"{name} does not begin with OFF; export it again as plain OFF, OBJ or STL")
    line, counts = (line, words[1:]) if len(words) > 1 else next(lines, (line, []))
    try:
        points, faces = int(counts[0]), int(counts[1])
    except (ValueError, IndexError) as error:
        raise refuse_number(counts, name, line, "the numbers of vertices and faces") from error
    require_few(points, "vertices", name)
    require_few(faces, "faces", name)
    places, corners, lengths = array("d"), array("q"), array("q")
    for line, words in islice(lines, max(points, 0)):
        places.extend(_place([b"v", *words], name, line))
    for line, words in islice(lines, max(faces, 0)):
        polygon = _counted(words, points, name, line)
        corners.extend(polygon)
        lengths.append(len(polygon))
        require_few(len(corners) // 3, "faces", name)
    found = len(places) // 3
    if found != points or len(lengths) != faces:
        raise MeshRefused(
            f"{name} is cut short: it announces {points} vertices and {faces} faces, and {found} vertices "
            f"and {len(lengths)} faces follow; export it again"
        )
    vertices = np.array(places).reshape(-1, 3)
    faces_of = triangulated(vertices, np.array(corners, dtype=np.int64), np.array(lengths, dtype=np.int64))
    return PlainMesh(vertices, faces_of)


def _logical_lines(path: Path) -> Iterator[tuple[int, list[bytes]]]:
    """Split a file into lines of words with the number of their last line, without comments and empty lines.

    A line that ends in a backslash continues with the next.
    """
    begun: list[bytes] = []
    size = number = 0
    # Iterating the bytes makes one line at a time; splitting them takes ten times the memory of the file.
    for number, line in enumerate(io.BytesIO(read_text_bytes(path, "a mesh", MOST_DATA, MeshRefused)), 1):
        size += len(line)
        if size > MAX_LINE:
            raise MeshRefused(
                f"{path.name}, line {number} has more than {MAX_LINE:,} characters; export it again with one "
                "vertex or face to a line"
            )
        words = line.split(b"#", 1)[0].split()
        if words and words[-1].endswith(b"\\"):
            begun.extend([*words[:-1], words[-1][:-1]])
            continue
        if begun:
            words = [word for word in (*begun, *words) if word]
            begun = []
        size = 0
        if words:
            yield number, words
        if number > _MAX_LINES:
            raise MeshRefused(f"{path.name} has more than {_MAX_LINES:,} lines; reduce its resolution")
    if begun := [word for word in begun if word]:
        yield number, begun


def _place(words: list[bytes], name: str, line: int) -> list[float]:
    """Read the coordinates of a vertex statement; a colour may follow them.

    Raises:
        MeshRefused: fewer than three numbers, a word that is not a number, or a weight that is not 1.
    """
    try:
        x, y, z = (float(word) for word in words[1:4])
        if len(words) == _WEIGHTED and float(words[4]) != 1.0:
            raise MeshRefused(
                f"{name}, line {line}: the vertex has the weight {show(words[4])}; only a weight of 1 is "
                "read, export plain polygons"
            )
    except ValueError as error:
        raise refuse_number(words[1:], name, line, "3 coordinates") from error
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
        if len(used) and used.max() > count:
            raise MeshRefused(
                f"{name} has a face with vertex {used.max()}, but {count} vertices; the file is cut short or "
                "damaged, export it again"
            )
        return 1, ()
    if relative or used.max() >= count:
        raise MeshRefused(
            f"{name} has a face with vertex 0 and others with vertex {used.max()} of {count}: an OBJ counts "
            "from 1, and this one from neither 0 nor 1; export it again"
        )
    return 0, ("its faces count vertices from 0, where an OBJ counts from 1: taken as they are meant",)


def _counted(words: list[bytes], points: int, name: str, line: int) -> list[int]:
    """Read the corners of a face line; colours may follow them."""
    try:
        count = int(words[0])
        corners = [int(word) for word in words[1 : count + 1]] if count >= 0 else []
    except ValueError as error:
        raise refuse_number(words, name, line, "the numbers of a face's corners") from error
    if len(corners) != count or (corners and not 0 <= min(corners) <= max(corners) < points):
        raise MeshRefused(
            f"{name} has a face of {count} corners that names {len(corners)}, or a vertex that is none of "
            f"its {points}; the file is cut short or damaged, export it again"
        )
    return corners


def _text_stl(data: bytes, name: str) -> PlainMesh:
    begun, ended, opened, closed = (
        sum(1 for _ in re.finditer(rb"(?mi)" + word, data)) for word in _STL_WORDS
    )
    require_few(opened, "facets", name)
    numbers = array("d")
    for found in _VERTEX.finditer(data):
        try:
            numbers.extend(map(float, found.groups()))
        except ValueError as error:
            line = data.count(b"\n", 0, found.start()) + 1
            raise refuse_number(list(found.groups()), name, line, "3 coordinates") from error
    places = np.array(numbers).reshape(-1, 3)
    last = data.rstrip()[-MAX_LINE:].splitlines()[-1].lower()
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
    return PlainMesh(places, np.arange(len(places), dtype=np.int64).reshape(-1, 3), notes, single=True)


def read_ply(path: Path) -> PlainMesh:
    """Read the faces of a PLY; polygons are split, colours and normals are left out.

    Raises:
        MeshRefused: cut short, too large, or with a word that is not a number.
    """
    import trimesh

    data = unpack(read_bounded(path, "a PLY", MOST_DATA, MeshRefused), path, "a PLY", MOST_DATA, MeshRefused)
    plain = plain_bytes(data[:_HEADER], path)
    header = [line.split() for line in plain.partition(b"end_header")[0].split(b"\n")]
    is_text = [b"format", b"ascii"] in [words[:2] for words in header]
    if is_text:
        data = plain_bytes(data, path, MeshRefused)
        # Refuse lines that the library would read in part: it stops at the first word that is not a number.
        require_few(data.count(b"\n") // 2, "vertices or faces", path.name)
        start = data.find(b"end_header")
        comma = data.find(b",", max(start, 0))
        if comma >= 0:
            line = data.count(b"\n", 0, comma) + 1
            words = data[data.rfind(b"\n", 0, comma) + 1 : data.find(b"\n", comma)].split()
            raise refuse_number(words, path.name, line, "numbers")
    counts = [int(words[2]) for words in header if words[:1] == [b"element"] and len(words) == 3]
    require_few(max(counts, default=0), "vertices or faces", path.name)
    lines = data.count(b"\n") + 1
    if is_text and sum(counts) > lines:
        raise MeshRefused(
            f"{path.name} is cut short: it announces {sum(counts)} vertices and faces, and has {lines} lines;"
            " export it again"
        )
    loaded = trimesh.load_scene(
        io.BytesIO(data), file_type="ply", process=False, skip_materials=True, maintain_order=True
    )
    if not loaded.geometry:
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    mesh = loaded.to_mesh()
    single = any(
        words[:1] == [b"property"] and words[1] in _SINGLE and words[2:] == [b"x"] for words in header
    )
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    return PlainMesh(vertices, faces, single=single and not is_text)


@contextmanager
def plain_file(path: Path) -> Iterator[Path]:
    """Yield the path of a file that holds the same text as UTF-8 with LF line ends; binary files stay.

    Raises:
        MeshRefused: damaged compression or encoding, or too large.
    """
    data = read_bounded(path, "a mesh", MOST_DATA, MeshRefused)
    packed = data.startswith(GZIP)
    plain = unpack(data, path, "a mesh", MOST_DATA, MeshRefused)
    text = plain_bytes(plain, path, MeshRefused)
    plain = plain if b"\0" in text else text
    # A file of Gmsh may announce more than its bytes can hold: the library makes room for all.
    for found in _COUNTS.finditer(plain):
        announced = max(int(count) for count in found.groups(b"0"))
        if announced > len(plain):
            raise MeshRefused(
                f"{path.name} is cut short: it announces {announced} nodes or elements in {len(plain)} "
                "bytes; export it again"
            )
    if not packed and plain == data:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="touchstone-text-") as folder:
        copy = Path(folder) / (path.name[: -len(".gz")] if path.name.lower().endswith(".gz") else path.name)
        copy.write_bytes(plain)
        yield copy


def refuse_number(words: list[bytes], name: str, line: int, wanted: str) -> MeshRefused:
    """Describe a line whose words are not the numbers that its format wants.

    Args:
        words: words that should be numbers.
        name: name of the file.
        line: its number, from 1.
        wanted: the numbers that belong there, e.g. "3 coordinates".
    """
    text = show(b" ".join(words[:8]))
    if any(_DECIMAL_COMMA.fullmatch(word) for word in words):
        return MeshRefused(f"{name}, line {line}: {text!r} has decimal commas; export it with decimal points")
    if (found := _SEPARATOR.search(b" ".join(words))) is not None:
        return _refuse_separator(found[0], name, line)
    return MeshRefused(
        f"{name}, line {line}: expected {wanted}, found {text!r}; the file is cut short or damaged, "
        "export it again"
    )


def _refuse_separator(separator: bytes, name: str, line: int) -> MeshRefused:
    """Describe a line whose words are not separated by spaces."""
    shown = _SEPARATOR_NAMES.get(separator, show(separator))
    return MeshRefused(f"{name}, line {line}: words are separated by {shown}; export it with spaces")


def show(text: bytes) -> str:
    """Convert bytes of a file to a short string for a message."""
    shown = text.decode("utf-8", "replace")
    return shown if len(shown) <= _MAX_SHOWN else f"{shown[:_MAX_SHOWN]}..."


def require_few(count: int, what: str, name: str) -> None:
    """Refuse more vertices or faces than later stages have memory for.

    Raises:
        MeshRefused: more than ``MAX_ELEMENTS``.
    """
    if count > MAX_ELEMENTS:
        raise MeshRefused(
            f"{name} has more than {MAX_ELEMENTS:,} {what}; reduce its resolution and export it again"
        )
