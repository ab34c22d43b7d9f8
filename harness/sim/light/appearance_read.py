"""The colours of a mesh file: its textures, and what it says where it has none."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.files.named_file import require_file
from harness.basics.mesh import Mesh
from harness.picture.srgb import PEAK, linear_from_srgb
from harness.sim.light.appearance import CREASE, NO_TEXTURE, Appearance, smooth_normals
from harness.sim.solid.mesh_read import METRES

GREY = 0.5
"""Linear albedo of what says no colour."""

_PLACEHOLDER = 2
"""Pixels a side of the picture that the reader puts where a file names a texture that is not there."""


def read_appearance(path: Path, units: str, scale: float = 1.0, crease: float = CREASE) -> Appearance:
    """A file's surface with its colours, in the file's own frame, every face as it stands in it.

    ``harness.sim.solid.intake`` gives the same surface in the same frame, mended, for touch and sound; a
    picture is of the file's faces, since colours belong to these. Normals are those of the faces,
    smoothed; the file's are not read.

    Args:
        path: a file that trimesh reads.
        units: "m", "cm", "mm" or "in".
        scale: factor on top of the unit, greater than zero.
        crease: rad, as of ``smooth_normals``.

    Raises:
        WrongUse: no such file or unit, or a scale that is none.
        MeshRefused: no surface in it.
    """
    if units not in METRES or not (np.isfinite(scale) and scale > 0.0):
        raise WrongUse(
            f"a mesh in {units!r} at scale {scale:g} was asked for; say one of {', '.join(METRES)} "
            "and a scale above zero"
        )
    require_file(path, "mesh file")
    pieces = _pieces(path)
    vertices = np.vstack([np.asarray(piece.vertices, np.float64) for piece in pieces])
    before = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    faces = np.vstack(
        [np.asarray(piece.faces, np.int64) + first for piece, first in zip(pieces, before[:-1], strict=True)]
    )
    if not np.all(np.isfinite(vertices)):
        raise MeshRefused(f"{path.name} has vertices that are not finite numbers; export it again")
    mesh = Mesh(vertices * (METRES[units] * scale), faces)
    return _coloured(mesh, pieces, crease)


def _pieces(path: Path) -> list[Any]:
    import trimesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = trimesh.load_scene(path, process=False, maintain_order=True)
            pieces = [piece for piece in loaded.dump() if isinstance(piece, trimesh.Trimesh)]
    # The readers raise whatever their parsers meet: there is no common class to name.
    except Exception as error:
        raise MeshRefused(
            f"{path.name} does not read as {path.suffix or 'a mesh'}: it is cut short, damaged or of another "
            "format; export it again"
        ) from error
    if not any(len(piece.faces) for piece in pieces):
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    return pieces


def _coloured(mesh: Mesh, pieces: list[Any], crease: float) -> Appearance:
    tints, places, texture_of = [], [], []
    textures: list[ByteArray] = []
    remarks: list[str] = []
    for piece in pieces:
        count = len(piece.faces)
        texture = _texture(piece, remarks)
        at = getattr(piece.visual, "uv", None)
        if texture is None or at is None:
            tints.append(_tints(piece, remarks))
            places.append(np.zeros((count, 3, 2)))
            texture_of.append(np.full(count, NO_TEXTURE))
        else:
            tints.append(np.ones((count, 3, 3)))
            places.append(np.asarray(at, np.float64)[piece.faces])
            texture_of.append(np.full(count, len(textures)))
            textures.append(texture)
    return Appearance(
        mesh,
        smooth_normals(mesh, crease),
        np.vstack(tints),
        np.vstack(places),
        np.concatenate(texture_of),
        tuple(textures),
        tuple(dict.fromkeys(remarks)),
    )


def _texture(piece: Any, remarks: list[str]) -> ByteArray | None:
    """A piece's diffuse texture, sRGB; None where it has none."""
    material = getattr(piece.visual, "material", None)
    picture = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    if picture is None or max(picture.size) <= _PLACEHOLDER:
        if getattr(piece.visual, "uv", None) is not None:
            remarks.append("the file has texture places and no texture: its material's colour is taken")
        return None
    if picture.mode not in ("RGB", "L"):
        remarks.append(
            f"the texture is {picture.mode}: its colours are taken, what it says beside them is not"
        )
    # A scan's factor on its texture (Kd) is what its program writes for everything; 1 is taken.
    return read_only(np.array(picture.convert("RGB"), dtype=np.uint8))


def _tints(piece: Any, remarks: list[str]) -> FloatArray:
    """``(faces, 3, 3)`` linear: of vertices or faces where they have colours, or of the material."""
    visual, count = piece.visual, len(piece.faces)
    if visual.kind == "vertex":
        of_vertices = linear_from_srgb(np.asarray(visual.vertex_colors, np.float64)[:, :3] / PEAK)
        return np.asarray(of_vertices[piece.faces])
    if visual.kind == "face":
        return np.repeat(linear_from_srgb(np.asarray(visual.face_colors)[:, None, :3] / PEAK), 3, axis=1)
    colour = getattr(getattr(visual, "material", None), "main_color", None)
    if colour is None:
        remarks.append(f"the file says no colour: a grey of albedo {GREY:g} is taken")
        return np.full((count, 3, 3), GREY)
    # Programs that write these files write what their user picked on a screen.
    tint = linear_from_srgb(np.asarray(colour, np.float64)[:3] / PEAK)
    return np.array(np.broadcast_to(tint, (count, 3, 3)))
