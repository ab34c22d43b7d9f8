"""Any mesh file, made into an object one can touch, or refused with a reason."""

import hashlib
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh, signed_volume
from harness.objects.builtin import BUILTIN
from harness.objects.household import build
from harness.sim.solid.mesh_read import METRES, RawMesh, read_mesh
from harness.sim.solid.mesh_repair import (
    RepairedSurface,
    boundary_edges,
    drop_duplicates,
    drop_faces,
    drop_specks,
    fill_holes,
    is_watertight,
    join_bodies,
    orient,
    take_apart,
    weld,
)
from harness.sim.solid.walls import walled

_ASKED_ABOUT = ("m", "cm", "mm")
_SMALLEST, _LARGEST = 5e-3, 2.0
_SOLID_FILL, _SOLID_VOLUME = 0.6, 1e-4
_FLAT = 1e-12


@dataclass(frozen=True)
class IntakeReport:
    """What was in the file and what was done to it."""

    file: str  #: its name.
    sha256: str  #: hash of its bytes.
    units: str  #: the unit its numbers were taken in.
    units_from: str
    """"asked", also against what the file declares, "declared by the file" or "the only reading of its
    size"."""
    scale: float  #: factor applied after the unit.
    vertices_before: int  #: in the file.
    faces_before: int  #: in the file.
    vertices: int  #: handed on.
    faces: int  #: handed on.
    bodies: int  #: separate pieces handed on.
    watertight: bool  #: whether every edge joins two faces.
    longest_side: float  #: metres.
    area: float  #: square metres of surface.
    volume: float | None  #: cubic metres enclosed; None where the surface is not closed.
    wall: float | None  #: metres of wall the operator stated, or None.
    repairs: tuple[str, ...]  #: what was done, in order.
    warnings: tuple[str, ...]  #: what the operator should look at.
    seconds: float  #: how long it took.
    up_axis: str = ""  #: how the file was rotated, for people; empty where its z was up.

    def mass(self, density: float) -> float | None:
        """Kilograms at ``density`` kg/m^3; None where neither a wall nor a closed surface says.

        With a wall, a closed surface is the outside of a shell and an open one its middle.
        """
        if self.wall is not None:
            return density * self.wall * self.area
        return None if self.volume is None else density * self.volume

    @property
    def summary(self) -> str:
        """What was read, in one line: every command that takes a mesh file says it."""
        return read_line(
            *(self.file, self.bodies, self.faces, self.volume, self.longest_side),
            *(self.units, self.units_from, self.up_axis),
        )


def read_line(
    file: str,
    pieces: int,
    triangles: int,
    volume: float | None,
    longest: float,
    units: str,
    source: str,
    up_axis: str = "",
) -> str:
    """What was read of a mesh file.

    Args:
        file: its name.
        pieces: separate ones.
        triangles: of its surface.
        volume: m^3; None where the surface is open.
        longest: m, its longest side.
        units: that its numbers were taken in.
        source: where the unit came from.
        up_axis: how it was rotated, for people; empty where its z was up.
    """
    held = "open, no volume" if volume is None else f"{1e6 * volume:.4g} cm^3"
    return (
        f"{file}: {pieces} piece{'s' if pieces > 1 else ''}, {triangles} triangles, {held}, longest side "
        f"{1e3 * longest:.4g} mm; unit {units} ({source}){up_axis and '; '}{up_axis}"
    )


@dataclass(frozen=True, eq=False)
class Intake:
    """An object's surface in metres, and how it came about."""

    mesh: Mesh
    report: IntakeReport


def take_in(
    path: Path,
    units: str | None,
    scale: float = 1.0,
    wall: float | None = None,
    up_axis: str | None = None,
) -> Intake:
    """Read, weld, clean, orient and measure a mesh.

    Args:
        path: any file trimesh or meshio reads.
        units: "m", "cm", "mm" or "in"; None to take the unit the file declares, or the only
            one that gives a size between 5 mm and 2 m.
        scale: factor on top of the unit, greater than zero.
        wall: metres, the wall thickness of a hollow thing of which the file has the outside.
        up_axis: axis of the file that points up, "x", "y" or "z"; None for the one that it declares, else z.

    Returns:
        The mesh in metres in the object's frame, outward, and a report. The object's frame is the file's,
        rotated about its origin until the up axis is z.

    Raises:
        WrongUse: an unknown unit, a bad scale or wall, or two readings of the size.
        MeshRefused: nothing in the file can stand for an object.
    """
    begun = time.perf_counter()
    _check_arguments(units, scale, wall)
    raw = read_mesh(path, up_axis)
    surface = _cleaned(raw, path.name)
    unit, source, metres = _unit(units, raw, surface.size, path.name)
    surface.vertices = surface.vertices * (metres * scale)
    if not _SMALLEST <= surface.size <= _LARGEST:
        raise MeshRefused(
            f"{path.name}: read in {unit} at scale {scale:g} the longest side is {surface.size:.4g} m, "
            f"outside {_SMALLEST * 1e3:g} mm to {_LARGEST:g} m; say other units or another scale"
        )
    orient(surface)
    fill_holes(surface)
    pieces = join_bodies(surface)
    watertight = is_watertight(surface.faces)
    # Corners on one line: the slit that such a face leaves has no width.
    drop_faces(surface, surface.areas() > _FLAT * surface.size**2, "faces without area")
    mesh = Mesh(surface.vertices, surface.faces)
    sides = mesh.bounds[1] - mesh.bounds[0]
    thinnest = float(sides.min())
    if wall is not None and thinnest > 0.0 and wall > 0.5 * thinnest:
        raise WrongUse(
            f"a wall of {wall * 1e3:g} mm is more than half of the object's thinnest side, "
            f"{thinnest * 1e3:.3g} mm; say a thinner wall, or leave it out for a solid"
        )
    report = IntakeReport(
        file=path.name,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        units=unit,
        units_from=source,
        scale=scale,
        vertices_before=len(raw.vertices),
        faces_before=len(raw.faces),
        vertices=len(mesh.vertices),
        faces=len(mesh.faces),
        bodies=pieces,
        watertight=watertight,
        longest_side=float(sides.max()),
        area=float(mesh.face_areas.sum()),
        volume=signed_volume(mesh) if watertight else None,
        wall=wall,
        repairs=tuple(surface.repairs),
        warnings=(*raw.notes, *_warnings(mesh, watertight, pieces, wall)),
        seconds=time.perf_counter() - begun,
        up_axis=raw.up_axis,
    )
    return Intake(mesh, report)


def _check_arguments(units: str | None, scale: float, wall: float | None) -> None:
    if units is not None and units not in METRES:
        raise WrongUse(f"unknown unit {units!r} for a mesh; say one of {', '.join(METRES)}")
    if not (np.isfinite(scale) and scale > 0.0):
        raise WrongUse(f"a scale of {scale:g} makes no object; say a number greater than 0")
    if wall is not None and not (np.isfinite(wall) and wall > 0.0):
        raise WrongUse(
            f"a wall of {wall * 1e3:g} mm is none; say a thickness greater than 0, or leave it out"
        )


def _cleaned(raw: RawMesh, name: str) -> RepairedSurface:
    """Welded, without collapsed or repeated faces and specks; still in the file's unit."""
    surface = RepairedSurface(raw.vertices, raw.faces)
    surface.keep(np.ones(len(raw.faces), dtype=np.bool_))
    bad = int(np.count_nonzero(~np.isfinite(surface.vertices).all(axis=1)))
    if bad:
        raise MeshRefused(
            f"{name}: {bad} of {len(surface.vertices)} vertices are not finite numbers; export it again"
        )
    if surface.size == 0.0:
        raise MeshRefused(f"{name}: all {len(surface.faces)} faces lie in one point; export it again")
    weld(surface)
    a, b, c = surface.faces.T
    drop_faces(surface, (a != b) & (b != c) & (c != a), "collapsed faces")
    drop_duplicates(surface)
    area = float(surface.areas().sum())
    if len(surface.faces) < 4 or not area > 1e-13 * surface.size**2:
        raise MeshRefused(
            f"{name}: {len(surface.faces)} faces with a total area of {area:.1e} (size {surface.size:.3g}) "
            "remain after welding; at least 4 faces with an area make an object"
        )
    drop_specks(surface)
    take_apart(surface)
    return surface


def _unit(asked: str | None, raw: RawMesh, size: float, name: str) -> tuple[str, str, float]:
    """The unit's name, where it came from, and its length in metres."""
    declared = raw.unit
    if asked is not None:
        against = f", against the {declared} that the file declares" if declared not in (None, asked) else ""
        return asked, f"asked{against}", METRES[asked]
    if declared is not None and raw.metres is not None:
        return declared, "declared by the file", raw.metres
    readings = [unit for unit in _ASKED_ABOUT if _SMALLEST <= size * METRES[unit] <= _LARGEST]
    if len(readings) == 1:
        return readings[0], "the only reading of its size", METRES[readings[0]]
    if not readings:
        raise MeshRefused(
            f"{name}: the longest side is {size:.4g}; read as m, cm or mm that is never between "
            f"{_SMALLEST * 1e3:g} mm and {_LARGEST:g} m; check the file"
        )
    said = " or ".join(f"{size:.4g} {unit} ({size * METRES[unit]:.3g} m)" for unit in readings)
    ways = " or ".join(f"--units {unit}" for unit in readings)
    raise WrongUse(f"{name}: the longest side is {size:.4g}: {said}? say {ways}")


def _warnings(mesh: Mesh, watertight: bool, pieces: int, wall: float | None) -> tuple[str, ...]:
    said = []
    if not watertight:
        rim = len(boundary_edges(mesh.faces))
        said.append(f"the surface is open ({rim} rim edges): touch is right, mass and sound need a wall")
    if pieces > 1:
        said.append(f"{pieces} separate pieces are taken as one rigid object")
    if wall is None and _looks_filled(mesh):
        said.append(
            "the surface encloses nearly its whole outline: if the thing is hollow (can, bottle, pitcher) "
            "this is a scan of its outside; its mass and sound will be those of a solid unless --wall says so"
        )
    return tuple(said)


def _looks_filled(mesh: Mesh) -> bool:
    """Large and filling most of its convex hull, as vessels scanned from outside do."""
    try:
        hull = float(ConvexHull(mesh.vertices - mesh.vertices[0]).volume)
    except QhullError:
        return False
    return hull > _SOLID_VOLUME and signed_volume(mesh) > _SOLID_FILL * hull


@dataclass(frozen=True, eq=False)
class TakenSurface:
    """A closed surface around an object's material."""

    mesh: Mesh  #: in metres, in the object's frame.
    units: str  #: name of the unit of the file's numbers; metres of a built-in object.
    said: tuple[str, ...]  #: what was read of a file, what was done to the mesh and what to look at.


def surface_of(mesh: str, units: str | None, wall: float | None, up_axis: str | None = None) -> TakenSurface:
    """The surface of an object's material.

    Args:
        mesh: a file of a surface, or ``builtin:`` and a name.
        units: of the file's numbers; None to take the only ones that make sense.
        wall: m, of a hollow thing of which the file has the outside.
        up_axis: axis of the file that points up, as at intake; not for a built-in object.

    Raises:
        MeshRefused: a mesh that cannot stand for an object.
        WrongUse: no such file or built-in object; units or a wall that cannot be.
    """
    if mesh.startswith(BUILTIN):
        if wall is not None:
            raise WrongUse(f"{mesh} has its walls; leave --wall out")
        if units not in (None, "m"):
            raise WrongUse(f"{mesh} is in metres and not in {units}; leave --units out")
        if up_axis is not None:
            raise WrongUse(f"{mesh} has z up; leave --up-axis out")
        return TakenSurface(build(mesh.removeprefix(BUILTIN)), "m", ())
    intake = take_in(Path(mesh), units, wall=wall, up_axis=up_axis)
    report = intake.report
    said = (report.summary, *report.repairs, *report.warnings)
    return TakenSurface(walled(intake.mesh, wall), report.units, said)
