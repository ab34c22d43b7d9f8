"""From a file with its colours to an ObjectFile with a look: intake, training, measurement, writing."""

import hashlib
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.authoring.object_source import PartRequest, created_object, provenance_of, source_of
from harness.authoring.training import Report
from harness.authoring.vision.profiles import vision_profile
from harness.authoring.vision.vision import CHECKPOINT, AuthoredVision, author_vision
from harness.basics.mesh import Mesh
from harness.objectfile.entries import Source
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import is_same_surface
from harness.objectfile.vision.part import VisionPart, with_vision
from harness.objects.builtin import BUILTIN
from harness.sim.light.appearance import Appearance
from harness.sim.light.appearance_source import appearance_of
from harness.sim.solid.intake import surface_of


@dataclass(frozen=True, eq=False)
class BuiltVision:
    """An ObjectFile and how it came about."""

    object: ObjectFile  #: on disk.
    vision: AuthoredVision  #: its networks and errors.
    said: tuple[str, ...]  #: what was done to the mesh and its colours, and what to look at.
    seconds: Mapping[str, float]  #: s on the clock of each stage.


def build_vision(
    wanted: PartRequest,
    out: Path,
    report: Report,
    threads: int | None = None,
) -> BuiltVision:
    """Build an object's vision, or continue a stopped training; all cores are used if ``threads`` is None.

    The folder ``out`` keeps its other modalities and its mesh.

    Raises:
        WrongUse: options that conflict or are out of range.
        MeshRefused: a mesh that is no solid object.
        DataRefused: the folder has a checkpoint or an ObjectFile of another object.
    """
    chosen = vision_profile(wanted.profile)
    begun = time.perf_counter()
    report("reading the mesh and its colours", 0.0)
    source = source_of(wanted.mesh, wanted.licence)
    taken = surface_of(wanted.mesh, wanted.units, wanted.wall, wanted.up_axis)
    look = appearance_of(wanted.mesh, taken.units, edge=chosen.edge, up_axis=wanted.up_axis)
    created = created_object(wanted.mesh, wanted.licence, wanted.material, taken.mesh, out, source)
    read = time.perf_counter() - begun
    vision = author_vision(look, chosen, wanted.seed, out, report, threads)
    begun = time.perf_counter()
    report("writing", 1.0)
    part = VisionPart(
        model=vision.model,
        provenance=provenance_of(wanted, "vision", vision.settings, (source, *_textures(wanted, look))),
        # JSON holds no infinity, which is what equal pictures have for decibels.
        measured={name: value for name, value in vision.errors.items() if math.isfinite(value)},
        surface=choose_surface(taken.mesh, look.mesh),
    )
    made = with_vision(created, part)
    (out / CHECKPOINT).unlink(missing_ok=True)
    seconds = {"mesh": read, **vision.seconds, "write": time.perf_counter() - begun}
    return BuiltVision(made, vision, (*taken.said, *look.remarks), seconds)


def choose_surface(mesh: Mesh, looked_at: Mesh) -> Mesh | None:
    """Return the surface that pictures are rendered on; None if it is the object's mesh.

    The surface has seams if its texture has them. They are closed, since the pixels that a
    closed surface covers are found faster, and a camera inside it is detected.
    """
    return None if is_same_surface(mesh, looked_at) else without_seams(looked_at)


def without_seams(mesh: Mesh) -> Mesh:
    """The same faces with one vertex a place; those that have then no area are left out."""
    vertices, place_of = np.unique(mesh.vertices[np.unique(mesh.faces)], axis=0, return_inverse=True)
    at = np.zeros(len(mesh.vertices), np.int64)
    at[np.unique(mesh.faces)] = place_of.reshape(-1)
    faces = at[mesh.faces]
    return Mesh(vertices, faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])


def _textures(wanted: PartRequest, look: Appearance) -> tuple[Source, ...]:
    """Of a file's textures, which lie beside it or within it, their pixels' hashes."""
    if wanted.mesh.startswith(BUILTIN):
        return ()
    return tuple(
        Source(
            what=f"texture {number}, {texture.shape[1]} x {texture.shape[0]} texels",
            origin=Path(wanted.mesh).name,
            licence=wanted.licence,
            sha256=hashlib.sha256(np.ascontiguousarray(texture).tobytes()).hexdigest(),
        )
        for number, texture in enumerate(look.textures)
    )
