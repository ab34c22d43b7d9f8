"""The look of any object that a scene can name: built in, or a mesh file with its colours.

Colours for the built-in objects: stated here, since their shapes say none.

Each has the colour of its material and a print in another: bands and rings of dots that pass through the
object along the shortest side of its box. What is printed depends on where a place is and not on how
finely the surface is cut up, and has no seam.
"""

import warnings
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.files.foreign_file import MOST_DATA, refused_as, require_readable
from harness.basics.files.named_file import require_file
from harness.basics.geometry import rotate_upright
from harness.basics.mesh import Mesh
from harness.objects.builtin import BUILTIN, MATERIALS, build
from harness.picture.image_file import decode_texture
from harness.picture.srgb import PEAK, bytes_from_linear, linear_from_srgb
from harness.sim.light.appearance import CREASE, NO_TEXTURE, Appearance, smooth_normals
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.obj_colours import read_obj_colours
from harness.sim.solid.formats.parts import MeshFile, MeshPart, merge_parts
from harness.sim.solid.mesh_read import DECLARING, METRES, check_extent, choose_up_axis, unit_name

GREY = 0.5
"""Linear albedo of what says no colour."""

Colour = tuple[float, float, float]

COLOURS: MappingProxyType[str, tuple[Colour, Colour]] = MappingProxyType(
    {
        "ceramic": ((0.72, 0.70, 0.64), (0.06, 0.16, 0.38)),
        "polycarbonate": ((0.55, 0.14, 0.09), (0.70, 0.58, 0.30)),
        "wood": ((0.42, 0.24, 0.11), (0.17, 0.08, 0.035)),
        "steel": ((0.40, 0.41, 0.43), (0.10, 0.10, 0.11)),
    }
)
"""Linear albedo (red, green, blue) of each material, and of what is printed on it; all of them matt."""

_TEXELS = 512

_BAND_AT, _BAND_HALF = (0.16, 0.84), 0.035
"""Of the box's sides, from an edge: where the bands' middles are, and half their width."""

_DOTS, _DOT_RADIUS = 6, 0.045
"""Dots along a side, between the bands; radius as a share of that side."""


def appearance_of(
    mesh: str,
    units: str | None,
    scale: float = 1.0,
    edge: float = 1.5e-3,
    crease: float = CREASE,
    up_axis: str | None = None,
) -> Appearance:
    """What an object looks like, in metres, in the object's frame.

    Args:
        mesh: a file, or ``builtin:`` and a name.
        units: of the file's numbers, "m", "cm", "mm" or "in"; None for a built-in object only.
        scale: factor on top of the unit, greater than zero.
        edge: m between vertices of a built-in object; half of what touch and sound take, since outlines
            show corners.
        crease: rad, as of ``appearance.smooth_normals``.
        up_axis: axis of the file that points up, as at intake.

    Raises:
        WrongUse: no such object or unit, or a scale or an edge that is none.
        MeshRefused: a file without a surface.
    """
    if not mesh.startswith(BUILTIN):
        if units is None:
            raise WrongUse(f"{mesh} has colours to be read and its unit is not known; say m, cm, mm or in")
        return read_appearance(Path(mesh), units, scale, crease, up_axis)
    return builtin_appearance(mesh.removeprefix(BUILTIN), scale, edge, crease)


def builtin_appearance(
    name: str, scale: float = 1.0, edge: float = 1.5e-3, crease: float = CREASE
) -> Appearance:
    """A built-in object with the print of its material; arguments and errors as in ``appearance_of``."""
    built = build(name, edge)
    shape = type(built)(built.vertices * scale, built.faces)
    count = len(shape.faces)
    low, high = shape.bounds
    across = [int(axis) for axis in range(3) if axis != int(np.argmin(high - low))]
    places: FloatArray = ((shape.corners - low) / (high - low))[..., across]
    return Appearance(
        shape,
        smooth_normals(shape, crease),
        np.ones((count, 3, 3)),
        places,
        np.zeros(count, np.int64),
        (_print_of(MATERIALS[name]),),
    )


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
        kind = path.suffix.lower()
        if kind not in DECLARING:
            _metres(units, None)
        if kind == ".obj":
            read = read_obj_colours(path)
        elif kind in DECLARING:
            read = DECLARING[kind](path, True)
        else:
            read = _read_with_trimesh(path)
    metres = _metres(units, read.metres)
    axis, _ = choose_up_axis(up_axis, read.up_axis)
    vertices, faces = merge_parts(read.parts)
    if not np.all(np.isfinite(vertices)):
        raise MeshRefused(f"{path.name} has vertices that are not finite numbers; export it again")
    check_extent(vertices, faces, path.name)
    vertices, _ = move_near(vertices, faces, path.name)
    if not np.ptp(vertices[faces.ravel()], axis=0).any():
        raise MeshRefused(f"{path.name}: all {len(faces)} faces lie in one point; export it again")
    try:
        return _coloured(Mesh(rotate_upright(vertices, axis) * (metres * scale), faces), read, crease)
    except MemoryError as error:
        raise MeshRefused(
            f"{path.name}: {len(faces):,} triangles need more memory than there is; reduce the mesh"
        ) from error


def _metres(units: str, declared: float | None) -> float:
    if declared is not None and units == unit_name(declared):
        return declared
    if units not in METRES:
        raise WrongUse(f"unknown unit {units!r} for a mesh; say one of {', '.join(METRES)}")
    return METRES[units]


def _read_with_trimesh(path: Path) -> MeshFile:
    """Files that have colours of vertices or faces at most, e.g. PLY, and no files of their own."""
    import trimesh
    from trimesh.resolvers import ZipResolver

    loaded = trimesh.load_scene(
        path, process=False, maintain_order=True, skip_materials=True, resolver=ZipResolver({})
    )
    pieces = [piece for piece in loaded.dump() if isinstance(piece, trimesh.Trimesh)]
    if not any(len(piece.faces) for piece in pieces):
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    parts = []
    for piece in pieces:
        visual: Any = piece.visual
        faces = np.asarray(piece.faces, np.int64)
        tints = None
        if visual.kind == "vertex":
            of_vertices = linear_from_srgb(np.asarray(visual.vertex_colors, np.float64)[:, :3] / PEAK)
            tints = np.asarray(of_vertices[faces])
        elif visual.kind == "face":
            tints = np.repeat(linear_from_srgb(np.asarray(visual.face_colors)[:, None, :3] / PEAK), 3, axis=1)
        parts.append(MeshPart(np.asarray(piece.vertices, np.float64), faces, tints))
    return MeshFile(tuple(parts))


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
                # A picture's pixels, sRGB.
                pixels, is_transparent = decode_texture(part.picture.read(), part.picture.name)
                if is_transparent:
                    remarks.append(f"the texture {part.picture.name} is partly transparent: rendered opaque")
                textures.append(pixels)
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


def _print_of(material: str) -> ByteArray:
    """Return the print of a material, ``(rows, columns, 3)`` sRGB, with the aspect of the object's box."""
    if material not in COLOURS:
        raise WrongUse(f"no colour of {material!r} is known; there are {', '.join(COLOURS)}")
    base, printed = (np.array(colour) for colour in COLOURS[material])
    step = (np.arange(_TEXELS) + 0.5) / _TEXELS
    u, v = np.meshgrid(step, step)
    apart = np.min([np.abs(v - at) for at in _BAND_AT], axis=0)
    # Three rows between the bands, the middle one shifted by half a step.
    inked = np.zeros_like(u)
    for row, height in enumerate((0.32, 0.5, 0.68)):
        across = np.mod(_DOTS * u + 0.5 * (row % 2), 1.0) - 0.5
        inked = np.maximum(inked, np.hypot(across / _DOTS, v - height) < _DOT_RADIUS)
    inked = np.maximum(np.asarray(apart < _BAND_HALF, dtype=np.float64), inked.astype(np.float64))[..., None]
    return bytes_from_linear(inked * printed + (1.0 - inked) * base)
