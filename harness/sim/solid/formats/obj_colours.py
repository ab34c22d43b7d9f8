"""Wavefront OBJ with its colours: textures and diffuse colours of its libraries, colours of vertices."""

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, MOST_JSON, read_bounded
from harness.basics.files.referenced_file import referenced_path
from harness.basics.files.text_file import read_text_bytes
from harness.picture.srgb import PEAK, linear_from_srgb
from harness.sim.solid.formats.parts import MeshFile, MeshPart, TextureFile, require_triangles
from harness.sim.solid.polygons import triangulated

_NUMBERS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2}
"""Most numbers after these options of a texture; one word follows any other."""

_FOLLOWED = frozenset({"-o", "-s", "-bm", "-blendu", "-blendv", "-texres", "-clamp"})
"""Options that are followed, or that concern filtering and bumps alone."""

_OPTION = re.compile(r"\s*(-[A-Za-z]+)(?=\s)")
_COMMENT = re.compile(r"(?:^|\s)#")
_WORD = re.compile(r"\s*(\S+)(?=\s)")


@dataclass(eq=False)
class _Material:
    """A material of a library."""

    tint: FloatArray | None = None  #: ``(3,)`` linear diffuse colour; None where none is stated.
    picture: TextureFile | None = None  #: its texture; None without one.
    scale: FloatArray = field(default_factory=lambda: np.ones(2))
    """``(2,)`` by which texture places are multiplied."""
    offset: FloatArray = field(default_factory=lambda: np.zeros(2))  #: ``(2,)`` that is added to them then.
    clamps: bool = False  #: whether the texture is not to repeat.


@dataclass(eq=False)
class _Faces:
    """Polygons of one material: corners one after the other, and how many each polygon has."""

    corners: "array[int]" = field(default_factory=lambda: array("q"))
    places: "array[int]" = field(default_factory=lambda: array("q"))
    lengths: "array[int]" = field(default_factory=lambda: array("q"))


_NO_PLACE = -(2**62)


def read_obj_colours(path: Path) -> MeshFile:
    """Read an OBJ, one piece a material, faces as ``read_obj`` reads them.

    Raises:
        MeshRefused: a damaged file, or one that refers outside its folder.
    """
    vertices, colours, places = array("d"), array("d"), array("d")
    libraries: list[str] = []
    of: dict[str, _Faces] = {}
    name, zero, relative = "", False, False
    for key, rest in _logical_lines(read_text_bytes(path, "a mesh", refused=MeshRefused)):
        if key == "v":
            words = [float(word) for word in rest.split()]
            vertices.extend(words[:3])
            if len(words) < 3:
                raise _refuse(path, "a vertex has fewer than three numbers")
            colours.extend(words[3:6] if len(words) >= 6 else (np.nan, np.nan, np.nan))
        elif key == "vt":
            u, *others = (float(word) for word in rest.split()[:2])
            places.extend((u, others[0] if others else 0.0))
        elif key == "f":
            faces = of.setdefault(name, _Faces())
            words_of = rest.split()
            for word in words_of:
                split = word.split("/")
                corner = int(split[0])
                zero, relative = zero or corner == 0, relative or corner < 0
                faces.corners.append(corner if corner >= 0 else len(vertices) // 3 + 1 + corner)
                place = int(split[1]) if len(split) > 1 and split[1] else None
                at_place = (
                    _NO_PLACE if place is None else place if place >= 0 else len(places) // 2 + 1 + place
                )
                faces.places.append(at_place)
            faces.lengths.append(len(words_of))
        elif key == "usemtl":
            name = rest
        elif key == "mtllib":
            libraries.append(rest)
    if zero and relative:
        raise _refuse(path, "faces count vertices from 0 and from the end at once")
    notes: list[str] = []
    materials = _materials(path, libraries, notes)
    own = np.array(vertices).reshape(-1, 3), np.array(colours).reshape(-1, 3), np.array(places).reshape(-1, 2)
    parts = [
        _part(path, own, faces, 0 if zero else 1, materials.get(material), material, notes)
        for material, faces in of.items()
    ]
    require_triangles(sum(len(part.faces) for part in parts), path.name)
    if not any(len(part.faces) for part in parts):
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    return MeshFile(tuple(parts), colour_notes=tuple(dict.fromkeys(notes)))


def _refuse(path: Path, reason: str) -> MeshRefused:
    return MeshRefused(f"{path.name}: {reason}; the file is damaged, export it again")


def _logical_lines(data: bytes) -> Iterator[tuple[str, str]]:
    """The first word of each line in lower case and the rest; a line that ends in a backslash continues."""
    text = data.decode("utf-8", "replace").replace("\\\n", " ")
    for line in text.splitlines():
        # A number sign within a word belongs to a name; before one, it begins a comment.
        words = _COMMENT.split(line, maxsplit=1)[0].split(maxsplit=1)
        if words:
            yield words[0].lower(), words[1].strip() if len(words) > 1 else ""


def _part(
    path: Path,
    own: tuple[FloatArray, FloatArray, FloatArray],
    faces: _Faces,
    first: int,
    material: _Material | None,
    name: str,
    notes: list[str],
) -> MeshPart:
    vertices, colours, places = own
    corners = np.array(faces.corners, np.int64) - first
    if corners.min(initial=0) < 0 or corners.max(initial=-1) >= len(vertices):
        raise _refuse(path, f"a face has a vertex that is none of its {len(vertices)}")
    triangles = triangulated(vertices[corners], np.arange(len(corners)), np.array(faces.lengths, np.int64))
    used, numbers = np.unique(corners, return_inverse=True)
    part = MeshPart(vertices[used], numbers.reshape(-1)[triangles])
    tints = None
    stated = colours[corners]
    if np.all(np.isfinite(stated)) and len(stated):
        tints = linear_from_srgb(np.clip(stated / (PEAK if stated.max() > 1.0 else 1.0), 0.0, 1.0))[triangles]
    if material is None:
        if name:
            notes.append(f"material {name!r} is in no library that is there")
        return MeshPart(part.vertices, part.faces, tints)
    if material.picture is None:
        if material.tint is not None:
            tints = np.broadcast_to(material.tint, (len(part.faces), 3, 3))
        return MeshPart(part.vertices, part.faces, tints)
    at = np.array(faces.places, np.int64)
    if (at == _NO_PLACE).any():
        notes.append(
            f"material {name!r} has a texture, and some of its faces no texture places: it is left out"
        )
        return MeshPart(part.vertices, part.faces, tints)
    at = at - first
    if at.min() < 0 or at.max() >= len(places):
        raise _refuse(path, f"a face has a texture place that is none of its {len(places)}")
    placed = places[at][triangles] * material.scale + material.offset
    if not np.all(np.isfinite(placed)):
        raise _refuse(path, "texture places are no finite numbers")
    if material.clamps and (placed.min() < -1e-6 or placed.max() > 1.0 + 1e-6):
        notes.append(f"the texture of material {name!r} is repeated, where the file clamps it (-clamp on)")
    # A scan's factor on its texture (Kd) is what its program writes for everything; 1 is used.
    return MeshPart(part.vertices, part.faces, None, placed, material.picture)


def _materials(path: Path, libraries: list[str], notes: list[str]) -> dict[str, _Material]:
    """The materials of all libraries, by name."""
    found: dict[str, _Material] = {}
    for stated in dict.fromkeys(libraries):
        # One library whose name has spaces, or several: as the files are there.
        whole = referenced_path(path, stated, MeshRefused)
        for name in [stated] if whole is not None else stated.split():
            library = referenced_path(path, name, MeshRefused)
            if library is None:
                notes.append(f"the material library {name!r} is not there: its colours are not used")
                continue
            now = _Material()
            for key, rest in _logical_lines(
                read_text_bytes(library, "a material library", MOST_JSON, MeshRefused)
            ):
                if key == "newmtl":
                    now = found.setdefault(rest, _Material())
                elif key == "kd" and not rest.startswith(("spectral", "xyz")):
                    try:
                        values = np.array([float(word) for word in rest.split()[:3]])
                    except ValueError as error:
                        raise _refuse(library, f"a colour is {rest!r:.60}") from error
                    if len(values) not in (1, 3) or not np.all((values >= 0.0) & (values <= 1.0)):
                        raise _refuse(
                            library, f"a colour is {rest!r:.60}; three numbers of 0 to 1 are needed"
                        )
                    # Programs that write these files write what their user picked on a screen, of 8 bits.
                    now.tint = linear_from_srgb(np.rint(np.resize(values, 3) * PEAK) / PEAK)
                elif key == "map_kd":
                    _set_texture(now, rest, library, path, notes)
                elif key == "map_d" or (key == "d" and _is_number(rest) and float(rest) < 1.0):
                    notes.append(f"{library.name} states transparency ({key}): rendered opaque")
    return found


def _set_texture(now: _Material, text: str, library: Path, of: Path, notes: list[str]) -> None:
    """Read ``map_Kd``: options, then the name of a file, which may have spaces."""
    options, name = _split_options(text)
    strange = sorted(set(options) - _FOLLOWED)
    if strange:
        notes.append(f"options of a texture that are not followed: {', '.join(strange)}")
    for option, default in (("-s", 1.0), ("-o", 0.0)):
        values = [float(word) for word in options.get(option, [])[:2]]
        pair = np.array(values + [default] * (2 - len(values)))
        if not np.all(np.isfinite(pair)):
            raise _refuse(library, f"option {option} of a texture is no finite number")
        now.scale, now.offset = (pair, now.offset) if option == "-s" else (now.scale, pair)
    now.clamps = options.get("-clamp") == ["on"]
    picture = referenced_path(library, name, MeshRefused)
    if picture is None:
        notes.append(
            f"the texture {name!r} that {library.name} names is not there: {of.name} has no texture from it"
        )
        return
    now.picture = TextureFile(name, partial(read_bounded, picture, "a texture", MOST_DATA, MeshRefused))


def _split_options(text: str) -> tuple[dict[str, list[str]], str]:
    """Options with their words, and the name after them."""
    options: dict[str, list[str]] = {}
    while (found := _OPTION.match(text)) is not None:
        option, text = found.group(1).lower(), text[found.end() :]
        words: list[str] = []
        while len(words) < _NUMBERS.get(option, 1) and (word := _WORD.match(text)) is not None:
            if option in _NUMBERS and not _is_number(word.group(1)):
                break
            words.append(word.group(1))
            text = text[word.end() :]
        options[option] = words
    return options, text.strip().strip('"')


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
