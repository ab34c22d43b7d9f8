"""Colours of a mesh file: its textures, the colours of its materials and those of its vertices."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.files.foreign_file import MOST_DATA, refused_as, require_readable
from harness.basics.files.named_file import require_file
from harness.basics.geometry import rotate_upright
from harness.basics.mesh import Mesh
from harness.picture.srgb import PEAK, linear_from_srgb
from harness.picture.texture import decode_texture
from harness.sim.light.appearance import CREASE, NO_TEXTURE, Appearance, smooth_normals
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.obj_colours import read_obj_colours
from harness.sim.solid.formats.parts import MeshFile, MeshPart, TextureFile, merge_parts
from harness.sim.solid.mesh_read import DECLARING, METRES, check_extent, choose_up_axis, unit_name

GREY = 0.5
"""Linear albedo of what says no colour."""


def read_appearance(
    path: Path, units: str, scale: float = 1.0, crease: float = CREASE, up_axis: str | None = None
) -> Appearance:
    """Read a file's surface with its colours, in the object's frame, every face as the file has it.

    ``harness.sim.solid.intake`` gives the same surface in the same frame, repaired, for touch and sound; a
    picture is of the file's faces, since colours belong to these. Normals are those of the faces,
    smoothed; the file's are not read.

    Args:
        path: a mesh file.
        units: "m", "cm", "mm", "um", "in" or "ft", or the unit that the file declares, as intake names it.
        scale: factor on top of the unit, greater than zero.
        crease: rad, as of ``smooth_normals``.
        up_axis: axis of the file that points up, "x", "y" or "z"; None for the one that it declares, else z.

    Raises:
        WrongUse: no such file or unit, or a scale that is none.
        MeshRefused: no surface in it, or a file that cannot be read.
    """
    if not (np.isfinite(scale) and scale > 0.0):
        raise WrongUse(f"a scale of {scale:g} makes no object; give a number greater than 0")
    require_file(path, "mesh file")
    require_readable(path, "a mesh", MOST_DATA, MeshRefused)
    damaged = (
        f"{path.name} does not read as {path.suffix or 'a mesh'}: it is cut short, damaged or of another "
        "format; export it again"
    )
    with refused_as(MeshRefused, damaged), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if path.suffix.lower() not in DECLARING:
            _metres(units, None)
        read = _read(path)
    metres = _metres(units, read.metres)
    axis, _ = choose_up_axis(up_axis, read.up_axis)
    vertices, faces = merge_parts(read.parts)
    if not np.all(np.isfinite(vertices)):
        raise MeshRefused(f"{path.name} has vertices that are not finite numbers; export it again")
    check_extent(vertices, faces, path.name)
    vertices, _ = move_near(vertices, faces, path.name)
    try:
        return _coloured(Mesh(rotate_upright(vertices, axis) * (metres * scale), faces), read, crease)
    except MemoryError as error:
        raise MeshRefused(
            f"{path.name}: {len(faces):,} triangles need more memory than there is; reduce the mesh"
        ) from error


def _metres(units: str, declared: float | None) -> float:
    """Metres in a unit that is named, or declared by the file."""
    if declared is not None and units == unit_name(declared):
        return declared
    if units not in METRES:
        raise WrongUse(f"unknown unit {units!r} for a mesh; say one of {', '.join(METRES)}")
    return METRES[units]


def _read(path: Path) -> MeshFile:
    if path.suffix.lower() == ".obj":
        return read_obj_colours(path)
    reader = DECLARING.get(path.suffix.lower())
    return _read_with_trimesh(path) if reader is None else reader(path, True)


def _read_with_trimesh(path: Path) -> MeshFile:
    """Files that have colours of vertices or faces at most, e.g. PLY, and no files of their own."""
    import trimesh

    loaded = trimesh.load_scene(
        path, process=False, maintain_order=True, skip_materials=True, resolver=_no_files()
    )
    pieces = [piece for piece in loaded.dump() if isinstance(piece, trimesh.Trimesh)]
    if not any(len(piece.faces) for piece in pieces):
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    return MeshFile(tuple(_part(piece) for piece in pieces))


def _no_files() -> Any:
    """A resolver that finds no file: what PLY and the like refer to is not read."""
    from trimesh.resolvers import ZipResolver

    return ZipResolver({})


def _part(piece: Any) -> MeshPart:
    visual, faces = piece.visual, np.asarray(piece.faces, np.int64)
    tints = None
    if visual.kind == "vertex":
        of_vertices = linear_from_srgb(np.asarray(visual.vertex_colors, np.float64)[:, :3] / PEAK)
        tints = np.asarray(of_vertices[faces])
    elif visual.kind == "face":
        tints = np.repeat(linear_from_srgb(np.asarray(visual.face_colors)[:, None, :3] / PEAK), 3, axis=1)
    return MeshPart(np.asarray(piece.vertices, np.float64), faces, tints)


def _coloured(mesh: Mesh, read: MeshFile, crease: float) -> Appearance:
    tints, places, texture_of = [], [], []
    textures: list[ByteArray] = []
    remarks = list(read.colour_notes)
    numbers: dict[str, int] = {}
    for part in read.parts:
        count = len(part.faces)
        if part.picture is None or part.places is None:
            places.append(np.zeros((count, 3, 2)))
            texture_of.append(np.full(count, NO_TEXTURE))
            if part.tints is None:
                remarks.append(f"the file says no colour: a grey of albedo {GREY:g} is taken")
            tints.append(np.full((count, 3, 3), GREY) if part.tints is None else part.tints)
        else:
            if part.picture.name not in numbers:
                numbers[part.picture.name] = len(textures)
                textures.append(_texture(part.picture, remarks))
            places.append(part.places)
            texture_of.append(np.full(count, numbers[part.picture.name]))
            tints.append(np.ones((count, 3, 3)) if part.tints is None else part.tints)
    return Appearance(
        mesh,
        smooth_normals(mesh, crease),
        np.vstack(tints),
        np.vstack(places),
        np.concatenate(texture_of),
        tuple(textures),
        tuple(dict.fromkeys(remarks)),
    )


def _texture(picture: TextureFile, remarks: list[str]) -> ByteArray:
    """A picture's pixels, sRGB."""
    pixels, is_transparent = decode_texture(picture.read(), picture.name)
    if is_transparent:
        remarks.append(f"the texture {picture.name} is partly transparent: rendered opaque")
    return pixels
