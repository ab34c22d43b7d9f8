"""Whether an ObjectFile is of the object that stands in a scene."""

from dataclasses import astuple

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import Material
from harness.basics.mesh import Mesh, signed_volume
from harness.objectfile.file import ObjectFile, file_entry
from harness.objectfile.surface_file import ply_bytes
from harness.objectfile.surface_search import SurfaceSearch

_SHAPE = 1e-3
"""Of the diagonal, by which two surfaces of one object may differ, and of the volume: a frequency then
differs by a thousandth or so, as the elements' own do."""

_DRAWN = 1e-4
"""Of the diagonal and of the area: a twentieth of a pixel of a picture of 512."""

_CONSTANT = 1e-9
"""Relative, by which constants of one material may differ: more than JSON rounds them by."""

_CONSTANTS = (("density", " kg/m^3"), ("young", " Pa"), ("poisson", ""), ("alpha", " 1/s"), ("beta", " s"))


def require_same(of: ObjectFile, surface: Mesh, material: Material) -> None:
    """Refuse an ObjectFile of something else.

    Args:
        of: an ObjectFile.
        surface: of the material of the scene's object, in metres, in the object's frame.
        material: of the scene's object.

    Raises:
        WrongUse: another size, place, shape, volume or material; each difference is said.
        DataRefused: its mesh is damaged.
    """
    different = []
    # Alpha and beta count: the decays of a scene's sounds are those of its material.
    pairs = zip(_CONSTANTS, astuple(of.material)[1:], astuple(material)[1:], strict=True)
    for (name, unit), a, b in pairs:
        if abs(a - b) > _CONSTANT * max(abs(a), abs(b)):
            different.append(
                f"its {name} is {a:.6g}{unit} where the scene's {material.name} has {b:.6g}{unit}"
            )
    _refuse(of, [*different, *_surfaces(of, surface)], "sound.shapes = elements")


def require_same_shape(of: ObjectFile, surface: Mesh, instead: str) -> None:
    """As ``require_same``, of whatever material.

    Args:
        of: an ObjectFile.
        surface: of the scene's object.
        instead: the level that needs no ObjectFile, for a refusal.
    """
    _refuse(of, _surfaces(of, surface), instead)


def is_same_surface(there: Mesh, here: Mesh) -> bool:
    """Whether two surfaces are one to the eye, however they are cut into faces: no seam, no hole mended."""
    if not np.isclose(there.face_areas.sum(), here.face_areas.sum(), rtol=_DRAWN, atol=0.0):
        return False
    most = _DRAWN * here.diagonal
    if np.abs(there.bounds - here.bounds).max() > most:
        return False
    return max(_farthest(there, here, most), _farthest(here, there, most)) <= most


def _refuse(of: ObjectFile, different: list[str], instead: str) -> None:
    if different:
        raise WrongUse(
            f"{of.folder} is not of the scene's object: {'; '.join(different)}. Name its own ObjectFile, "
            f"build one with `touchstone object build`, or take {instead}"
        )


def _surfaces(of: ObjectFile, surface: Mesh) -> list[str]:
    if file_entry(of.description.mesh.file, ply_bytes(surface)).sha256 == of.description.mesh.sha256:
        return []
    most = _SHAPE * surface.diagonal
    low, high = np.array(of.description.mesh.low_m), np.array(of.description.mesh.high_m)
    if (np.abs(np.stack([low, high]) - surface.bounds) > most).any():
        return [f"it reaches {_box(np.stack([low, high]))}, the scene's object {_box(surface.bounds)}"]
    gap = max(_farthest(surface, of.mesh, most), _farthest(of.mesh, surface, most))
    if gap > most:
        return [f"the surfaces are {gap * 1e3:.3g} mm apart, where {most * 1e3:.3g} mm are one object's"]
    there, here = signed_volume(of.mesh), signed_volume(surface)
    if abs(there - here) > _SHAPE * here:
        return [f"it holds {there * 1e6:.5g} cm^3, the scene's object {here * 1e6:.5g}"]
    return []


def _farthest(points: Mesh, surface: Mesh, first: float) -> float:
    """m, of a vertex of one mesh from the surface of another; it may well be within ``first`` m."""
    used = points.vertices[np.unique(points.faces)]
    places, _ = SurfaceSearch(surface).nearest(used, first)
    return float(np.linalg.norm(places - used, axis=1).max())


def _box(bounds: FloatArray) -> str:
    sides = zip("xyz", *(1e3 * bounds), strict=True)
    return ", ".join(f"{axis} {low:.2f} to {high:.2f}" for axis, low, high in sides) + " mm"
