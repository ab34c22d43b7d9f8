"""What intake finds of one object: units, its label against its size, openings, thin walls, implied mass."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.authoring.catalogue.rows import CatalogueRow
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.result import JSON_ONLY
from harness.objects.builtin import BUILTIN
from harness.sim.solid.intake import surface_of, take_in
from harness.sim.solid.mesh_read import METRES, read_mesh
from harness.sim.solid.tetrahedra import check_closed
from harness.sim.solid.walls import enclosed_volume, thin_wall, walled

LABEL = 0.05
"""Relative: a label further than this from the longest side is of something else."""

THIN = 1.0 / 150.0
"""Of the longest side: walls below it need so many elements that filling may take hours."""

HEAVIEST = 100.0
"""kg/m^2: implied mass over the longest side squared; the YCB objects have up to 39 (a can of meat)."""

_OFF_MASS = 1.5
"""Factor between implied and weighed mass above which one of mesh, wall and material is wrong."""

_UNIT_OF_LABEL = 3.0
"""Factor that a size may be from its label for the label to decide the unit."""


@dataclass(frozen=True)
class IntakeFinding:
    """One object's intake."""

    name: str  #: name of the object.
    material: str  #: material of the object.
    mesh: str = field(metadata=JSON_ONLY)  #: file or ``builtin:`` name of the mesh.
    verdict: str = "ready"  #: ``"ready"``, ``"look"`` if there are remarks, or ``"excluded"``.
    reason: str | None = field(default=None, metadata=JSON_ONLY)  #: reason of the exclusion.
    remarks: tuple[str, ...] = field(default=(), metadata=JSON_ONLY)  #: findings to check, one sentence each.
    units: str | None = None  #: unit of the coordinates in the file.
    longest_side_m: float | None = None
    label_m: float | None = None  #: size in the catalogue; None if it has none.
    watertight: bool | None = None  #: whether the file's surface is closed.
    faces: int | None = field(default=None, metadata=JSON_ONLY)  #: number of faces of the surface.
    wall_m: float | None = None  #: wall thickness, exceeded on 98 % of the surface; None if open.
    mass_kg: float | None = None
    """mass from volume and density; None if neither volume nor wall is known."""


def units_of(row: CatalogueRow, mesh: str) -> str | None:
    """The unit of a file's numbers: the row's, or the one in which the file is nearest to its label.

    None where there is no label, or none of m, cm and mm comes within a factor of three of it.

    Raises:
        WrongUse: no such file.
        MeshRefused: it does not read.
    """
    if row.units is not None or row.scale is None or mesh.startswith(BUILTIN):
        return row.units
    raw = read_mesh(Path(mesh))
    if raw.unit is not None:
        return None
    used = raw.vertices[np.unique(raw.faces)]
    size = float(np.ptp(used, axis=0).max())
    if not (np.isfinite(size) and size > 0.0):
        return None
    factors = {unit: abs(np.log(size * METRES[unit] / row.scale)) for unit in ("m", "cm", "mm")}
    nearest = min(factors, key=lambda unit: float(factors[unit]))
    return nearest if factors[nearest] < np.log(_UNIT_OF_LABEL) else None


def intake_finding(row: CatalogueRow, mesh: str, sound: bool = True) -> IntakeFinding:
    """Take one object in and report what is to be known before it is built.

    Args:
        row: of the catalogue.
        mesh: its file, or ``builtin:`` and a name.
        sound: whether it is to have a sound, which needs a closed surface.
    """
    found = _take_in(row, mesh, sound)
    verdict = "excluded" if found.reason is not None else "look" if found.remarks else "ready"
    return replace(found, verdict=verdict)


def _take_in(row: CatalogueRow, mesh: str, sound: bool) -> IntakeFinding:
    found = IntakeFinding(row.name, row.material, mesh, label_m=row.scale)
    try:
        surface, units, watertight, warnings = _taken(row, mesh)
        sides = surface.bounds[1] - surface.bounds[0]
        longest = float(sides.max())
        found = replace(
            found,
            units=units,
            longest_side_m=longest,
            watertight=watertight,
            faces=len(surface.faces),
            remarks=(*_of_label(row, sides), *warnings),
        )
        check_closed(surface)
    except (DataRefused, WrongUse) as refused:
        # Touch and look do without an inside.
        open_only = isinstance(refused, MeshRefused) and found.units is not None and not sound
        return found if open_only else replace(found, reason=str(refused))
    wall = thin_wall(surface)
    mass = enclosed_volume(surface) * MATERIALS[row.material].density
    thin = []
    if wall < THIN * longest:
        thin.append(
            f"a wall of {wall * 1e3:.3g} mm is 1/{longest / wall:.0f} of the longest side, "
            f"thinner than 1/{1.0 / THIN:.0f}: filling may take hours"
        )
    remarks = (*found.remarks, *thin, *_of_mass(row, mass, longest))
    return replace(found, wall_m=wall, mass_kg=mass, remarks=remarks)


def _taken(row: CatalogueRow, mesh: str) -> tuple[Mesh, str, bool, tuple[str, ...]]:
    """Surface of the material, units, whether the file's surface was closed, and intake's own warnings."""
    units = units_of(row, mesh)
    if mesh.startswith(BUILTIN):
        return surface_of(mesh, units, row.wall, row.up_axis).mesh, "m", True, ()
    intake = take_in(Path(mesh), units, wall=row.wall, up_axis=row.up_axis)
    report = intake.report
    return walled(intake.mesh, row.wall), report.units, report.watertight, report.warnings


def _of_label(row: CatalogueRow, sides: FloatArray) -> list[str]:
    label, longest = row.scale, float(sides.max())
    if label is None or abs(longest / label - 1.0) <= LABEL:
        return []
    difference = f"{label:.4g} m is not the longest side, {longest:.4g} m ({label / longest - 1.0:+.0%})"
    alike = np.flatnonzero(np.abs(sides / label - 1.0) <= LABEL)
    which = f"; it is the side along {'xyz'[alike[0]]}" if len(alike) else ""
    return [f"the scale label {difference}{which}: the mesh's own size is used"]


def _of_mass(row: CatalogueRow, mass: float, longest: float) -> list[str]:
    if row.mass is not None:
        factor = mass / row.mass
        if 1.0 / _OFF_MASS <= factor <= _OFF_MASS:
            return []
        return [
            f"the surface holds {mass:.3g} kg of {row.material} where the object weighs {row.mass:.3g} kg "
            f"({factor:.2g} times): check the material, or state the wall"
        ]
    most = HEAVIEST * longest**2
    if mass <= most:
        return []
    return [
        f"the surface holds {mass:.3g} kg of {row.material}, more than a household thing of {longest:.3g} m "
        f"weighs (limit {most:.3g} kg): check material and units, or state the wall"
    ]
