"""COLLADA: the triangles and polygons that the file's scene places, with their colours."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, MOST_JSON, read_bounded
from harness.basics.files.referenced_file import referenced_path
from harness.picture.srgb import linear_from_srgb
from harness.sim.solid.formats.parts import (
    MAX_NODES,
    Axis,
    MeshFile,
    MeshPart,
    TextureFile,
    require_placed,
    require_triangles,
    transform_part,
)
from harness.sim.solid.formats.xml_stream import parse_xml
from harness.sim.solid.polygons import triangulated

_MAX_ELEMENTS = 2_000_000
"""XML elements of a file: each takes some 200 bytes of memory, however short it is."""

_AXES: dict[str, Axis] = {"X_UP": "x", "Y_UP": "y", "Z_UP": "z"}
_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_SHADERS = ("phong", "lambert", "blinn", "constant")


def read_collada(path: Path, colours: bool = False) -> MeshFile:
    """Read what the file's scene places.

    Args:
        path: a ``.dae`` file.
        colours: whether colours and textures are read too.

    Raises:
        MeshRefused: a damaged file, a unit or an axis that cannot be, or content that is not read and without
            which the object would be another.
    """
    data = read_bounded(path, "a COLLADA file", MOST_JSON, MeshRefused)
    # Refuse a document type and more elements than are read, before a tree is built.
    count = 0

    def start(*_: Any) -> None:
        nonlocal count
        count += 1
        if count > _MAX_ELEMENTS:
            raise MeshRefused(
                f"{path.name} holds more than {_MAX_ELEMENTS:,} XML elements, the most that are read"
            )

    parse_xml(BytesIO(data), start, lambda _: None, path.name)
    # No document type is left that could declare entities.
    root = ET.fromstring(data)  # noqa: S314
    return _Reader(path, root, colours).read()


@dataclass(frozen=True, eq=False)
class _Material:
    """A colour or a texture."""

    tint: FloatArray | None  #: ``(3,)`` linear; None where the file states none.
    picture: TextureFile | None  #: of the texture; None without one.
    coordinates: str  #: name of the texture's coordinates, as the effect calls them.


@dataclass(frozen=True, eq=False)
class _Piece:
    """The triangles of one primitive, and of what they may be coloured."""

    symbol: str  #: of the material, bound where the geometry is placed.
    part: MeshPart  #: triangles, with the tints of the vertices.
    coordinates: dict[int, FloatArray]  #: ``(m, 3, 2)`` texture places of each set.


class _Reader:
    """One document."""

    def __init__(self, path: Path, root: Any, colours: bool) -> None:
        self.path, self.root, self.colours = path, root, colours
        self.elements = {each.get("id"): each for each in root.iter() if each.get("id") is not None}
        self.geometries: dict[str, list[_Piece]] = {}
        self.sources: dict[str, FloatArray] = {}
        self.notes: list[str] = []
        self.colour_notes: list[str] = []

    def read(self) -> MeshFile:
        if _name(self.root) != "COLLADA":
            raise MeshRefused(f"{self.path.name} is XML, but no COLLADA; export it again")
        metres, axis = self._declared()
        parts: list[MeshPart] = []
        triangles = 0
        for instance, geometry, matrix in self._placed_geometries():
            if geometry not in self.geometries:
                self.geometries[geometry] = list(self._pieces(self.elements[geometry]))
            own = self.geometries[geometry]
            triangles += sum(len(piece.part.faces) for piece in own)
            require_triangles(triangles, self.path.name)
            require_placed(len(parts) + len(own), self.path.name)
            parts += [transform_part(self._bound(piece, instance), matrix) for piece in own]
        if not any(len(part.faces) for part in parts):
            raise MeshRefused(f"{self.path.name} places no triangle in its scene; export a surface")
        notes, colour_notes = tuple(dict.fromkeys(self.notes)), tuple(dict.fromkeys(self.colour_notes))
        return MeshFile(tuple(parts), metres, axis, notes, colour_notes)

    def refuse(self, reason: str) -> MeshRefused:
        return MeshRefused(f"{self.path.name}: {reason}; the file is damaged, export it again")

    def _declared(self) -> tuple[float, Axis]:
        """Metres in the file's unit, and its up axis; a metre and y by the format where it states none."""
        asset = _child(self.root, "asset")
        unit, up = _child(asset, "unit"), _child(asset, "up_axis")
        text = "1" if unit is None else unit.get("meter", "1")
        try:
            metres = float(text)
        except ValueError:
            metres = np.nan
        if not (np.isfinite(metres) and metres > 0.0):
            raise MeshRefused(
                f"{self.path.name} states a unit of {text!r:.40} m; a length above zero is needed: correct "
                "<unit meter=...>"
            )
        axis = "Y_UP" if up is None else (up.text or "").strip()
        if axis not in _AXES:
            raise MeshRefused(
                f"{self.path.name} states the up axis {axis!r:.40}; COLLADA has {', '.join(_AXES)}: correct "
                "<up_axis>"
            )
        return metres, _AXES[axis]

    def target(self, url: str | None, kind: str) -> Any:
        """The element of this document at which ``#id`` points."""
        found = self.elements.get((url or "").removeprefix("#")) if (url or "").startswith("#") else None
        if found is None or _name(found) != kind:
            raise self.refuse(f"it refers to {url!r:.60}, and holds no {kind} of that name")
        return found

    # The scene

    def _placed_geometries(self) -> Iterator[tuple[Any, str, FloatArray]]:
        """Each placed geometry: the element that places it, the geometry's id, and its matrix."""
        instance = _child(_child(self.root, "scene"), "instance_visual_scene")
        if instance is None:
            raise MeshRefused(
                f"{self.path.name} has no scene, which would place its geometry; export it again"
            )
        scene = self.target(instance.get("url"), "visual_scene")
        waiting: list[tuple[Any, FloatArray | None]] = [
            (node, np.eye(4)) for node in reversed(_children(scene, "node"))
        ]
        visited = 0
        while waiting:
            node, above = waiting.pop()
            visited += 1
            if visited > MAX_NODES:
                raise MeshRefused(
                    f"{self.path.name} places more than {MAX_NODES:,} nodes, the most that are read: its "
                    "instances form a cycle or multiply"
                )
            matrix = self._matrix(node, above)
            for child in node:
                kind = _name(child)
                if kind in ("instance_geometry", "instance_controller"):
                    if matrix is None:
                        raise MeshRefused(
                            f"{self.path.name} places geometry by <lookat> or <skew>, which are not read; "
                            "export it with matrices"
                        )
                    geometry, bind = self._geometry(child, kind)
                    if geometry is not None:
                        yield child, geometry, matrix @ bind
                elif kind == "node":
                    waiting.append((child, matrix))
                elif kind == "instance_node":
                    waiting.append((self.target(child.get("url"), "node"), matrix))

    def _matrix(self, node: Any, above: FloatArray | None) -> FloatArray | None:
        """A node's matrix in the scene; None below a transformation that is not read."""
        matrix = above
        for child in node:
            kind = _name(child)
            if kind in ("lookat", "skew"):
                return None
            lengths = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3}
            if kind not in lengths or matrix is None:
                continue
            values = self._floats(child.text, kind)
            if len(values) != lengths[kind] or not np.all(np.isfinite(values)):
                raise self.refuse(
                    f"a <{kind}> holds {len(values)} numbers; {lengths[kind]} finite ones are needed"
                )
            matrix = matrix @ self._transformation(kind, values)
        return matrix

    def _transformation(self, kind: str, values: FloatArray) -> FloatArray:
        local = np.eye(4)
        if kind == "matrix":
            return values.reshape(4, 4)
        if kind == "translate":
            local[:3, 3] = values
        elif kind == "scale":
            local[:3, :3] = np.diag(values)
        else:
            length = float(np.linalg.norm(values[:3]))
            if not length > 0.0:
                raise self.refuse("a <rotate> turns about an axis of length zero")
            x, y, z = values[:3] / length
            angle = np.radians(values[3])
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            local[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        return local

    def _geometry(self, instance: Any, kind: str) -> tuple[str | None, FloatArray]:
        """The id of the geometry that an instance places, None if it is no mesh; and a skin's own matrix."""
        bind = np.eye(4)
        if kind == "instance_geometry":
            geometry = self.target(instance.get("url"), "geometry")
        else:
            controller = self.target(instance.get("url"), "controller")
            self.notes.append("skinned and morphed geometry is read in the pose that it was modelled in")
            skin = _child(controller, "skin")
            shape = _child(skin, "bind_shape_matrix")
            if shape is not None:
                bind = self._floats(shape.text, "bind_shape_matrix").reshape(4, 4)
            of = skin if skin is not None else _child(controller, "morph")
            if of is None:
                raise self.refuse("a controller is neither skin nor morph")
            geometry = self.target(of.get("source"), "geometry")
        if _child(geometry, "mesh") is None:
            self.notes.append(
                f"geometry {geometry.get('id')!r:.40} is no mesh (a spline or convex hull): left out"
            )
            return None, bind
        return str(geometry.get("id")), bind

    # Geometry

    def _pieces(self, geometry: Any) -> Iterator[_Piece]:
        mesh = _child(geometry, "mesh")
        for element in mesh:
            kind = _name(element)
            if kind in _PRIMITIVES:
                found = self._piece(element, kind)
                if found is not None:
                    yield found
            elif kind in ("lines", "linestrips"):
                self.notes.append("lines are left out")

    def _piece(self, element: Any, kind: str) -> _Piece | None:
        inputs = self._inputs(element)
        stride = 1 + max((offset for offset, _, _, _ in inputs), default=0)
        index, lengths = self._corners(element, kind, stride)
        if not len(index):
            return None
        if lengths.sum() != len(index):
            raise self.refuse(f"polygons of {lengths.sum()} corners in all have {len(index)}")
        require_triangles(len(index) // 3, self.path.name)
        at = {
            (semantic, number): (index[:, offset], source)
            for offset, semantic, source, number in reversed(inputs)
        }
        used = next((found for (semantic, _), found in at.items() if semantic == "POSITION"), None)
        if used is None:
            raise self.refuse("a primitive has no positions")
        position, vertices = used[0], self._source(used[1], 3)
        self._check_index(position, len(vertices), "vertex")
        corners = triangulated(vertices[position], np.arange(len(position)), lengths)
        tints, coordinates = None, {}
        if self.colours:
            for (semantic, number), (entries, source) in at.items():
                if semantic not in ("TEXCOORD", "COLOR"):
                    continue
                values = self._source(source, 2 if semantic == "TEXCOORD" else 3)
                self._check_index(entries, len(values), semantic)
                if semantic == "TEXCOORD":
                    coordinates[number] = values[entries][corners]
                else:
                    tints = linear_from_srgb(np.clip(values[entries][corners], 0.0, 1.0))
        part = MeshPart(vertices, position[corners], tints)
        return _Piece(element.get("material", ""), part, coordinates)

    def _inputs(self, element: Any) -> list[tuple[int, str, str, int]]:
        """Offset, semantic, source and set of a primitive's inputs; those of its vertices in their place."""
        found: list[tuple[int, str, str, int]] = []
        for each in _children(element, "input"):
            offset, number = self._whole(each.get("offset", "0")), self._whole(each.get("set", "0"))
            semantic, source = each.get("semantic", ""), each.get("source", "")
            if semantic != "VERTEX":
                found.append((offset, semantic, source, number))
                continue
            for inner in _children(self.target(source, "vertices"), "input"):
                found.append((offset, inner.get("semantic", ""), inner.get("source", ""), 0))
        return found

    def _whole(self, text: str) -> int:
        if not text.isascii() or not text.isdigit() or int(text[:9]) > 64:
            raise self.refuse(f"an input's offset or set is {text!r:.40}; 0 to 64 is needed")
        return int(text)

    def _corners(self, element: Any, kind: str, stride: int) -> tuple[IntArray, IntArray]:
        """``(n, stride)`` entries of all corners one after the other, and how many each polygon has."""
        if any(_name(child) == "ph" for child in element):
            raise MeshRefused(
                f"{self.path.name} holds polygons with holes (<ph>), which are not read; export triangles"
            )
        lists = []
        for each in _children(element, "p"):
            values = self._whole_numbers(each.text)
            if len(values) % stride:
                raise self.refuse(f"a <p> of {len(values)} numbers is no whole number of corners of {stride}")
            lists.append(values.reshape(-1, stride))
        index = np.concatenate(lists) if lists else np.zeros((0, stride), np.int64)
        if kind == "triangles":
            if len(index) % 3:
                raise self.refuse(f"{len(index)} corners are no whole number of triangles")
            return index, np.full(len(index) // 3, 3)
        if kind == "polylist":
            return index, self._whole_numbers(getattr(_child(element, "vcount"), "text", None))
        if kind == "polygons":
            return index, np.array([len(each) for each in lists], np.int64)
        split = [_strip(each) if kind == "tristrips" else _fan(each) for each in lists]
        index = np.concatenate(split) if split else index
        return index, np.full(len(index) // 3, 3)

    def _check_index(self, entries: IntArray, count: int, what: str) -> None:
        if entries.min() < 0 or entries.max() >= count:
            wrong = entries.max() if entries.min() >= 0 else entries.min()
            raise self.refuse(f"a face has {what} {wrong}, but there are {count}")

    def _source(self, url: str, width: int) -> FloatArray:
        """``(n, width)`` values of a source, by the parameters that its accessor names."""
        key = f"{url} {width}"
        if key in self.sources:
            return self.sources[key]
        source = self.target(url, "source")
        accessor = _child(_child(source, "technique_common"), "accessor")
        if accessor is None:
            raise self.refuse(f"source {url!r:.60} has no accessor")
        values = self._floats(self.target(accessor.get("source"), "float_array").text, "float_array")
        stride, offset, count = (
            int(text) if text.isascii() and text.isdigit() and len(text) < 12 else -1
            for text in (accessor.get("stride", "1"), accessor.get("offset", "0"), accessor.get("count", ""))
        )
        named = [number for number, each in enumerate(_children(accessor, "param")) if each.get("name")]
        columns = (named or list(range(stride)))[:width]
        if min(stride, count) < 1 or offset < 0 or len(columns) < width or max(columns) >= stride:
            raise self.refuse(f"the accessor of source {url!r:.60} gives no {width} numbers an element")
        if offset + stride * (count - 1) + max(columns) >= len(values):
            raise self.refuse(
                f"source {url!r:.60} states {count:,} elements of {stride} and holds {len(values):,} numbers"
            )
        rows = np.arange(count)[:, None] * stride + offset + np.array(columns)
        self.sources[key] = values[rows]
        return self.sources[key]

    def _floats(self, text: str | None, what: str) -> FloatArray:
        return np.asarray(self._parsed(text, np.dtype(np.float64), what), np.float64)

    def _whole_numbers(self, text: str | None) -> IntArray:
        return np.asarray(self._parsed(text, np.dtype(np.int64), "index list"), np.int64)

    def _parsed(self, text: str | None, dtype: "np.dtype[Any]", what: str) -> Any:
        if text is None or not text.strip():
            return np.zeros(0, dtype)
        try:
            with warnings.catch_warnings():
                # A word that is no number ends the array there, with no more than a warning.
                warnings.simplefilter("error")
                return np.fromstring(text, dtype, sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise self.refuse(f"a {what} holds what is no number") from error

    # Colours

    def _bound(self, piece: _Piece, instance: Any) -> MeshPart:
        """A piece with the material that its instance binds; vertex colours multiply a texture."""
        if not self.colours:
            return piece.part
        found = next(
            (
                each
                for each in instance.iter()
                if _name(each) == "instance_material" and each.get("symbol") == piece.symbol
            ),
            None,
        )
        if found is None:
            return piece.part
        material = self._material(found)
        part, tints = piece.part, piece.part.tints
        if tints is None and material.tint is not None and material.picture is None:
            tints = np.broadcast_to(material.tint, (len(part.faces), 3, 3))
        places = piece.coordinates.get(_set_of(found, material.coordinates, piece.coordinates))
        if material.picture is None or places is None:
            if material.picture is not None:
                self.colour_notes.append("a textured piece has no texture places: its texture is left out")
            return MeshPart(part.vertices, part.faces, tints)
        if not np.all(np.isfinite(places)):
            raise self.refuse("texture places are no finite numbers")
        return MeshPart(part.vertices, part.faces, tints, places, material.picture)

    def _material(self, binding: Any) -> _Material:
        material = self.target(binding.get("target"), "material")
        instance = _child(material, "instance_effect")
        effect = self.target(None if instance is None else instance.get("url"), "effect")
        shader = next((each for each in effect.iter() if _name(each) in _SHADERS), None)
        diffuse = _child(shader, "diffuse")
        colour, texture = _child(diffuse, "color"), _child(diffuse, "texture")
        if colour is not None:
            values = self._floats(colour.text, "colour")
            if len(values) < 3 or not np.all((values[:3] >= 0.0) & (values[:3] <= 1.0)):
                raise self.refuse(f"a colour is {colour.text!r:.60}; three numbers of 0 to 1 are needed")
            return _Material(linear_from_srgb(values[:3]), None, "")
        if texture is None:
            return _Material(None, None, "")
        return _Material(None, self._picture(effect, texture.get("texture", "")), texture.get("texcoord", ""))

    def _picture(self, effect: Any, sampler: str) -> TextureFile | None:
        """The picture of a texture: through a sampler and a surface, or by the image's id."""
        of = {each.get("sid"): each for each in effect.iter() if _name(each) == "newparam"}
        name = sampler
        for _ in range(3):
            if name not in of:
                break
            link = next((each for each in of[name].iter() if _name(each) in _LINKS), None)
            name = (
                "" if link is None else (link.get("url", "").removeprefix("#") or (link.text or "").strip())
            )
        image = self.elements.get(name)
        start = None if image is None or _name(image) != "image" else _child(image, "init_from")
        ref = _child(start, "ref")
        address = ((ref if ref is not None else start).text or "").strip() if start is not None else ""
        if not address:
            self.colour_notes.append(f"the picture of texture {sampler!r:.40} is not in the file: left out")
            return None
        found = referenced_path(self.path, address, MeshRefused)
        if found is None:
            self.colour_notes.append(f"the texture {address!r:.80} is not there: left out")
            return None
        return TextureFile(address, partial(read_bounded, found, "a texture", MOST_DATA, MeshRefused))


_LINKS = ("source", "init_from", "instance_image")


def _name(element: Any) -> str:
    tag = element.tag
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


def _child(element: Any, name: str) -> Any:
    return None if element is None else next((each for each in element if _name(each) == name), None)


def _children(element: Any, name: str) -> list[Any]:
    return [each for each in element if _name(each) == name]


def _set_of(binding: Any, coordinates: str, there: dict[int, FloatArray]) -> int:
    """The set of texture places that a material's texture uses: the bound one, or the first."""
    for each in _children(binding, "bind_vertex_input"):
        text = each.get("input_set", "0")
        if each.get("semantic") == coordinates and text.isascii() and text.isdigit():
            return int(text[:9])
    return min(there, default=0)


def _strip(corners: IntArray) -> IntArray:
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles.reshape(-1, corners.shape[1])


def _fan(corners: IntArray) -> IntArray:
    first = np.repeat(corners[:1], max(len(corners) - 2, 0), axis=0)
    return np.stack([first, corners[1:-1], corners[2:]], axis=1).reshape(-1, corners.shape[1])
