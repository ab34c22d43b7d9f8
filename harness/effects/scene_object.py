"""The object of a scene as the estimator and the plan know it."""

from dataclasses import dataclass
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import require_same
from harness.objects.builtin import build
from harness.sim.solid.intake import IntakeReport, take_in
from harness.sim.solid.walls import walled


@dataclass(frozen=True, eq=False)
class KnownObject:
    """An object's surface, and how it came about."""

    mesh: Mesh  #: in metres, in the object's frame.
    report: IntakeReport | None
    """of the intake of a mesh file; None for a built-in object and for an ObjectFile."""

    @property
    def read(self) -> tuple[str, ...]:
        """What was read of a mesh file, in one line; nothing of other objects."""
        return () if self.report is None else (self.report.summary,)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should look at."""
        return self.report.warnings if self.report is not None else ()


def known_file(scene: SceneFile, mesh: Mesh) -> ObjectFile | None:
    """The scene's ObjectFile, seen to be of the scene's object; None where it names none.

    Args:
        scene: may name one.
        mesh: of the scene's object, as ``known_object`` gives it.

    Raises:
        WrongUse: it is of another object or material; what differs is said.
        DataRefused: it is missing or damaged.
    """
    if scene.object.objectfile is None:
        return None
    of = named_file(scene)
    require_same(of, walled(mesh, scene.object.wall), MATERIALS[scene.object.material])
    return of


def named_file(scene: SceneFile) -> ObjectFile:
    """The ObjectFile that a scene names.

    Raises:
        WrongUse: it names none.
        DataRefused: it is missing or damaged.
    """
    if scene.object.objectfile is None:
        raise WrongUse(
            "the scene names no ObjectFile; say its folder as objectfile in [object], or with --object FOLDER"
        )
    return ObjectFile.open(Path(scene.object.objectfile))


def known_object(scene: SceneFile) -> KnownObject:
    """Build or take in the scene's object.

    Raises:
        WrongUse: units that are wrong or ambiguous.
        MeshRefused: a file that cannot stand for an object.
        DataRefused: an ObjectFile that is missing or damaged.
    """
    wanted = scene.object
    if wanted.builtin is not None:
        mesh = build(wanted.builtin)
        return KnownObject(Mesh(mesh.vertices * wanted.drawn_scale, mesh.faces), None)
    if wanted.is_objectfile:
        mesh = named_file(scene).mesh
        return KnownObject(Mesh(mesh.vertices * wanted.drawn_scale, mesh.faces), None)
    path = Path(wanted.mesh)
    taken = take_in(path, wanted.units, wanted.drawn_scale, wanted.wall, wanted.up_axis)
    if taken.report.up_axis and wanted.up_axis != "z" and wanted.pose.up != "z":
        raise WrongUse(
            f"{path.name}: {taken.report.up_axis}, and the pose has up = {wanted.pose.up!r} on top of that; "
            'leave up out of [object.pose], or say up_axis = "z" in [object] to keep the file\'s axes'
        )
    return KnownObject(taken.mesh, taken.report)
