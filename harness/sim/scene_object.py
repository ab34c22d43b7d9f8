"""The object of a scene as the estimator and the plan know it."""

from dataclasses import dataclass
from pathlib import Path

from harness.mesh import Mesh
from harness.objects.household import build
from harness.scene import SceneFile
from harness.sim.intake import IntakeReport, take_in


@dataclass(frozen=True, eq=False)
class KnownObject:
    """An object's surface, and how it came about.

    Attributes:
        mesh: in metres, in the object's frame.
        report: of the intake of a mesh file; None for a built-in object.
    """

    mesh: Mesh
    report: IntakeReport | None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should look at."""
        return self.report.warnings if self.report is not None else ()


def known_object(scene: SceneFile) -> KnownObject:
    """Build or take in the scene's object.

    Raises:
        WrongUse: units that are wrong or ambiguous.
        MeshRefused: a file that cannot stand for an object.
    """
    wanted = scene.object
    if wanted.builtin is not None:
        mesh = build(wanted.builtin)
        return KnownObject(Mesh(mesh.vertices * wanted.scale, mesh.faces), None)
    taken = take_in(Path(wanted.mesh), wanted.units, wanted.scale, wanted.wall)
    return KnownObject(taken.mesh, taken.report)
