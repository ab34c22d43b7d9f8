"""glTF 2.0 and GLB: triangles of the default scene with their colours, or a refusal that names the cause.

Everything that the file requires is either followed or refused by its name.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import read_bounded
from harness.basics.files.referenced_file import referenced_path
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.gltf_data import COMPONENTS, GltfData, parse_json, shown, split_glb
from harness.sim.solid.formats.parts import (
    MeshFile,
    MeshPart,
    TextureFile,
    require_placed,
    require_triangles,
    transform_part,
)

_INSTANCES = "EXT_mesh_gpu_instancing"
_TRANSFORM = "KHR_texture_transform"
_DRACO = "KHR_draco_mesh_compression"
_WEBP = "EXT_texture_webp"
_GLOSSY = "KHR_materials_pbrSpecularGlossiness"
_READ = frozenset({_INSTANCES, _TRANSFORM, _WEBP, _GLOSSY, "KHR_mesh_quantization", "KHR_materials_unlit"})
_HARMLESS = frozenset({"KHR_lights_punctual", "KHR_xmp", "KHR_xmp_json_ld"})
"""Extensions that change neither the shape nor the colours of an object."""

_FALLBACK = frozenset({"EXT_meshopt_compression", "KHR_meshopt_compression", _DRACO, "KHR_texture_basisu"})
"""Extensions next to which a file keeps plain data, unless it requires them."""

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_REPEAT = 10497


def read_gltf(path: Path, colours: bool = False) -> MeshFile:
    """Read the triangles of the default scene.

    Args:
        path: ``.gltf`` or ``.glb``; the content decides which.
        colours: whether colours and textures are read too.

    Raises:
        MeshRefused: a damaged file, one that refers outside its folder, or one that requires an extension
            that is not read.
    """
    data = read_bounded(path, "a mesh", refused=MeshRefused)
    if data[:4] == b"glTF":
        tree, binary = split_glb(data, path.name)
    else:
        tree, binary = parse_json(data, path.name), None
    return _Reader(path, tree, binary, colours=colours).read()


@dataclass(eq=False)
class _Reader(GltfData):
    """Reads the triangles and colours of one file."""

    colours: bool = False
    notes: list[str] = field(default_factory=list)
    colour_notes: list[str] = field(default_factory=list)
    meshes: dict[int, tuple[MeshPart, ...]] = field(default_factory=dict)

    def read(self) -> MeshFile:
        asset = self.mapping(self.tree.get("asset", {}), "asset")
        version = asset.get("minVersion", asset.get("version"))
        if not isinstance(version, str) or not version.startswith("2."):
            raise MeshRefused(f"{self.path.name} is glTF of version {shown(version)}; export it as glTF 2.0")
        self._check_extensions()
        parts: list[MeshPart] = []
        triangles = placed = 0
        reached: set[int] = set()
        for node, matrix in self._placed_nodes():
            if "mesh" not in node:
                continue
            number = self.index(node["mesh"], "meshes", "a node's mesh")
            reached.add(number)
            own = self._mesh(number, node)
            instances = self._instances(node)
            placed += len(own) * len(instances)
            triangles += sum(len(part.faces) for part in own) * len(instances)
            require_placed(placed, self.path.name)
            require_triangles(triangles, self.path.name)
            parts += [transform_part(part, matrix @ local) for local in instances for part in own]
        missing = len(self.entries("meshes")) - len(reached)
        if missing:
            self.notes.append(f"{missing} meshes that the default scene does not place are left out")
        if not parts:
            raise MeshRefused(f"{self.path.name} holds no triangle; export a surface")
        return MeshFile(
            tuple(parts),
            1.0,
            "y",
            tuple(dict.fromkeys(self.notes)),
            tuple(dict.fromkeys(self.colour_notes)),
        )

    # What the file requires

    def _check_extensions(self) -> None:
        for name in self.entries("extensionsRequired"):
            if name not in _READ | _HARMLESS:
                raise MeshRefused(
                    f"{self.path.name} requires the glTF extension {shown(name)}, which is not read; export "
                    "it without this extension"
                )
        unread = [
            str(name) for name in self.entries("extensionsUsed") if name not in _READ | _HARMLESS | _FALLBACK
        ]
        materials = [name for name in unread if "_materials_" in name or "_texture_" in name]
        if materials:
            self.colour_notes.append(f"glTF extensions that are not followed: {', '.join(materials)}")
        if len(unread) > len(materials):
            others = ", ".join(name for name in unread if name not in materials)
            self.notes.append(f"glTF extensions that are not followed: {others}")

    # The scene

    def _placed_nodes(self) -> Iterator[tuple[dict[str, Any], FloatArray]]:
        """Every node of the default scene with its matrix in the scene; each at most once."""
        nodes = self.entries("nodes")
        scenes = self.entries("scenes")
        if scenes:
            scene = self.entry("scenes", self.tree.get("scene", 0), "the default scene")
            roots = scene.get("nodes", [])
        else:
            children = {child for node in nodes for child in _children(node)}
            roots = [number for number in range(len(nodes)) if number not in children]
        waiting = [(number, np.eye(4)) for number in reversed(_listed(roots))]
        seen: set[int] = set()
        while waiting:
            number, above = waiting.pop()
            number = self.index(number, "nodes", "a node")
            if number in seen:
                raise self.refuse(f"node {number} is reached twice: nodes form a cycle or share a child")
            seen.add(number)
            node = self.mapping(nodes[number], "a node")
            matrix = above @ self._matrix(node)
            yield node, matrix
            waiting += [(child, matrix) for child in reversed(_children(node))]

    def _matrix(self, node: dict[str, Any]) -> FloatArray:
        if not node.keys() & {"translation", "rotation", "scale", "matrix"}:
            return np.eye(4)
        if "matrix" in node:
            return np.ascontiguousarray(self.numbers(node["matrix"], 16, "a node's matrix").reshape(4, 4).T)
        move = self.numbers(node.get("translation", [0, 0, 0]), 3, "a node's translation")
        turn = self.numbers(node.get("rotation", [0, 0, 0, 1]), 4, "a node's rotation")
        size = self.numbers(node.get("scale", [1, 1, 1]), 3, "a node's scale")
        return np.asarray(self._composed(move[None], turn[None], size[None])[0])

    def _composed(self, moves: FloatArray, turns: FloatArray, sizes: FloatArray) -> FloatArray:
        """``(n, 4, 4)`` of translations, quaternions (x, y, z, w) and scales."""
        lengths = np.linalg.norm(turns, axis=1)
        if not np.all(np.isfinite(lengths) & (lengths > 0.0)):
            raise self.refuse("a rotation is a quaternion of length zero")
        x, y, z, w = (turns / lengths[:, None]).T
        rotations = np.stack(
            [
                np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1),
                np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1),
                np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1),
            ],
            axis=1,
        )
        matrices = np.tile(np.eye(4), (len(moves), 1, 1))
        matrices[:, :3, :3] = rotations * sizes[:, None, :]
        matrices[:, :3, 3] = moves
        return matrices

    def _instances(self, node: dict[str, Any]) -> FloatArray:
        """``(n, 4, 4)``: where a node's mesh is placed within the node."""
        instancing = self.extension(node, _INSTANCES)
        if instancing is None:
            return np.eye(4)[None]
        named = self.mapping(instancing.get("attributes"), f"the attributes of {_INSTANCES}")
        kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
        found = {
            name: self.accessor(named[name], (kind,), f"{_INSTANCES} {name}")
            for name, kind in kinds.items()
            if name in named
        }
        counts = {len(values) for values in found.values()}
        if len(counts) != 1:
            raise self.refuse(f"{_INSTANCES} has attributes of {sorted(counts)} instances")
        count = counts.pop()
        require_placed(count, self.path.name)
        return self._composed(
            found.get("TRANSLATION", np.zeros((count, 3))),
            found.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
            found.get("SCALE", np.ones((count, 3))),
        )

    # Meshes

    def _mesh(self, number: int, node: dict[str, Any]) -> tuple[MeshPart, ...]:
        """The primitives of a mesh, in the node's frame."""
        if "skin" in node:
            self.notes.append("a skinned mesh is read in the pose that it was modelled in")
        mesh = self.mapping(self.entries("meshes")[number], "a mesh")
        weights = _listed(node.get("weights", mesh.get("weights", [])))
        if any(weights):
            return tuple(self._primitives(mesh, weights))
        if number not in self.meshes:
            parts = tuple(self._primitives(mesh, []))
            vertices = np.vstack([np.zeros((0, 3)), *(part.vertices for part in parts)])
            if np.isfinite(vertices).all() and len(vertices) and np.ptp(vertices, axis=0).max() > 0.0:
                move_near(vertices, np.arange(len(vertices)), self.path.name, single=True)
            self.meshes[number] = parts
        return self.meshes[number]

    def _primitives(self, mesh: dict[str, Any], weights: list[Any]) -> Iterator[MeshPart]:
        for entry in _listed(mesh.get("primitives", [])):
            primitive = self.mapping(entry, "a primitive")
            mode = primitive.get("mode", _TRIANGLES)
            if mode not in (_TRIANGLES, _STRIP, _FAN):
                self.notes.append("points and lines are left out")
                continue
            part = self._primitive(primitive, mode, weights)
            if part is not None:
                yield part

    def _primitive(self, primitive: dict[str, Any], mode: int, weights: list[Any]) -> MeshPart | None:
        attributes = self.mapping(primitive.get("attributes", {}), "attributes")
        packed = self.extension(primitive, _DRACO) is not None
        position = attributes.get("POSITION")
        plain = position is not None and "bufferView" in self.entry("accessors", position, "POSITION")
        if packed and not plain:
            raise MeshRefused(
                f"{self.path.name} holds triangles compressed by {_DRACO}, which is not read; export it "
                "without compression"
            )
        if position is None:
            self.notes.append("a primitive without positions is left out")
            return None
        vertices = self.accessor(position, ("VEC3",), "POSITION")
        for target, weight in zip(_listed(primitive.get("targets", [])), weights, strict=False):
            moved = self.mapping(target, "a morph target").get("POSITION")
            amount = self.numbers([weight], 1, "the weight of a morph target")[0]
            if moved is not None and amount:
                shift = self.accessor(moved, ("VEC3",), "a morph target")
                if len(shift) != len(vertices):
                    raise self.refuse(f"a morph target moves {len(shift)} of {len(vertices)} vertices")
                vertices = vertices + amount * shift
        faces = self._faces(primitive, mode, len(vertices))
        require_triangles(len(faces), self.path.name)
        if not self.colours:
            return MeshPart(vertices, faces)
        return self._coloured(MeshPart(vertices, faces), primitive, attributes)

    def _faces(self, primitive: dict[str, Any], mode: int, count: int) -> IntArray:
        if "indices" in primitive:
            accessor = self.entry("accessors", primitive["indices"], "indices")
            if accessor.get("componentType") not in (5121, 5123, 5125):
                raise self.refuse("indices are not unsigned integers")
            order = self.accessor(primitive["indices"], ("SCALAR",), "indices")[:, 0].astype(np.int64)
            if order.max() >= count:
                raise self.refuse(f"a face has vertex {order.max()}, but there are {count} vertices")
        else:
            order = np.arange(count, dtype=np.int64)
        if mode == _TRIANGLES:
            if len(order) % 3:
                raise self.refuse(f"{len(order)} indices are no whole number of triangles")
            return order.reshape(-1, 3)
        if len(order) < 3:
            return np.zeros((0, 3), np.int64)
        if mode == _FAN:
            first = np.full(len(order) - 2, order[0])
            return np.stack([first, order[1:-1], order[2:]], axis=1)
        strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        strip[1::2] = strip[1::2, [1, 0, 2]]
        return strip

    # Colours

    def _coloured(self, part: MeshPart, primitive: dict[str, Any], attributes: dict[str, Any]) -> MeshPart:
        """A piece with its material: base colour times vertex colour times texture, all linear."""
        factor, texture = np.ones(3), None
        if "material" in primitive:
            material = self.entry("materials", primitive["material"], "a material")
            factor, texture = self._base_colour(material)
        tints = np.broadcast_to(factor, (len(part.faces), 3, 3))
        stated = "material" in primitive
        if "COLOR_0" in attributes:
            tints = tints * self._vertex_colours(attributes["COLOR_0"], len(part.vertices))[part.faces]
            stated = True
        if texture is None:
            return MeshPart(part.vertices, part.faces, tints if stated else None)
        picture, places = self._texture(texture, attributes, part)
        return MeshPart(part.vertices, part.faces, tints, places, picture)

    def _vertex_colours(self, number: Any, count: int) -> FloatArray:
        colours = self.accessor(number, ("VEC3", "VEC4"), "COLOR_0")
        accessor = self.entry("accessors", number, "COLOR_0")
        dtype = np.dtype(COMPONENTS[int(accessor["componentType"])])
        if dtype.kind in "iu" and accessor.get("normalized") is not True:
            colours = colours / float(np.iinfo(dtype).max)
        if len(colours) != count or not np.all(np.isfinite(colours)):
            raise self.refuse(f"COLOR_0 holds {len(colours)} colours for {count} vertices, or no numbers")
        if colours.shape[1] == 4 and colours[:, 3].min() < 1.0:
            self.colour_notes.append("vertex colours are partly transparent: rendered opaque")
        return np.clip(colours[:, :3], 0.0, 1.0)

    def _base_colour(self, material: dict[str, Any]) -> tuple[FloatArray, dict[str, Any] | None]:
        """Linear ``(3,)`` factor, and the texture's entry."""
        glossy = self.extension(material, _GLOSSY)
        if glossy is not None and "pbrMetallicRoughness" not in material:
            rough, factor_key, texture_key = glossy, "diffuseFactor", "diffuseTexture"
        else:
            rough = self.mapping(material.get("pbrMetallicRoughness", {}), "pbrMetallicRoughness")
            factor_key, texture_key = "baseColorFactor", "baseColorTexture"
        factor = self.numbers(rough.get(factor_key, [1, 1, 1, 1]), 4, factor_key)
        if factor.min() < 0.0 or factor.max() > 1.0:
            raise self.refuse(f"{factor_key} is {factor.tolist()}; 0 to 1 is needed")
        if material.get("alphaMode", "OPAQUE") != "OPAQUE":
            self.colour_notes.append(
                f"a material has alphaMode {shown(material['alphaMode'])}: rendered opaque"
            )
        unused: list[str] = [key for key in ("normalTexture", "emissiveTexture") if key in material]
        if any(_listed(material.get("emissiveFactor", []))):
            unused.append("emissiveFactor")
        if unused:
            self.colour_notes.append(f"not followed of a material: {', '.join(unused)}")
        texture = rough.get(texture_key)
        return factor[:3], None if texture is None else self.mapping(texture, texture_key)

    def _texture(
        self, info: dict[str, Any], attributes: dict[str, Any], part: MeshPart
    ) -> tuple[TextureFile | None, FloatArray | None]:
        transform = self.extension(info, _TRANSFORM) or {}
        number = self.count(transform.get("texCoord", info.get("texCoord", 0)), "texCoord")
        texture = self.entry("textures", info.get("index"), "a texture")
        picture = self._picture(texture)
        name = f"TEXCOORD_{number}"
        if picture is None or name not in attributes:
            if picture is not None:
                self.colour_notes.append(f"a texture is mapped by {name}, which a piece has not: left out")
            return None, None
        at = self.accessor(attributes[name], ("VEC2",), name)
        if len(at) != len(part.vertices) or not np.all(np.isfinite(at)):
            raise self.refuse(
                f"{name} holds {len(at)} places for {len(part.vertices)} vertices, or no numbers"
            )
        # Texture coordinates after ``KHR_texture_transform``: scaled, rotated counter-clockwise, then moved.
        scale = self.numbers(transform.get("scale", [1, 1]), 2, "a texture's scale")
        offset = self.numbers(transform.get("offset", [0, 0]), 2, "a texture's offset")
        angle = self.numbers([transform.get("rotation", 0)], 1, "a texture's rotation")[0]
        cosine, sine = np.cos(angle), np.sin(angle)
        # v points down: the rotation that looks counter-clockwise has the sine's other sign.
        at = np.asarray((at * scale) @ np.array([[cosine, sine], [-sine, cosine]]).T + offset)
        self._note_wrapping(texture, at)
        return picture, np.stack([at[:, 0], 1.0 - at[:, 1]], axis=1)[part.faces]

    def _note_wrapping(self, texture: dict[str, Any], at: FloatArray) -> None:
        if "sampler" not in texture or (at.min() >= -1e-6 and at.max() <= 1.0 + 1e-6):
            return
        sampler = self.entry("samplers", texture["sampler"], "a sampler")
        if any(sampler.get(key, _REPEAT) != _REPEAT for key in ("wrapS", "wrapT")):
            self.colour_notes.append("a texture that the file clamps or mirrors at its edge is repeated")

    def _picture(self, texture: dict[str, Any]) -> TextureFile | None:
        webp = self.extension(texture, _WEBP)
        source = texture.get("source") if webp is None else webp.get("source")
        if source is None:
            named = ", ".join(self.mapping(texture.get("extensions", {}), "extensions")) or "no source"
            self.colour_notes.append(f"a texture cannot be read ({named}): its material's colour is used")
            return None
        image = self.entry("images", source, "an image")
        if "bufferView" in image:
            view = image["bufferView"]
            return TextureFile(f"image {source}", partial(self._view_bytes, view))
        uri = image.get("uri")
        if not isinstance(uri, str):
            raise self.refuse(f"image {source} has neither data nor an address")
        if not uri.startswith("data:") and referenced_path(self.path, uri, MeshRefused) is None:
            self.colour_notes.append(f"the texture {uri!r} is not there: its material's colour is used")
            return None
        name = f"image {source}" if uri.startswith("data:") else uri
        return TextureFile(name, partial(self._resource, uri, "an image"))

    def _view_bytes(self, view: Any) -> bytes:
        return self._view(view, "the buffer view of an image")[0]


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _children(node: Any) -> list[Any]:
    found = _listed(node.get("children", [])) if isinstance(node, dict) else []
    return [child for child in found if isinstance(child, int)]
