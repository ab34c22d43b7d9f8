"""The surface that a user names: a file's, or one of our own objects'."""

from dataclasses import dataclass
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objects.builtin import BUILTIN
from harness.objects.household import build
from harness.sim.solid.intake import take_in
from harness.sim.solid.walls import walled


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
