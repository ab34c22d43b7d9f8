"""What is on the table: ``scene.toml``, or the options of the command line, as one model."""

import math
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import Field, create_model, field_validator, model_validator

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest, real_path
from harness.basics.geometry import UPRIGHT, rotation_about, transform, translation
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.quantities import (
    Angle,
    Length,
    Nonnegative,
    Ordered,
    Positive,
    Ratio,
    Time,
)
from harness.basics.toml_file import StrictModel, read_toml, validate
from harness.bench.experiments import EXPERIMENTS, loaded
from harness.bench.named_files import named_file
from harness.bench.scene_objectfile import (
    OBJECTFILE,
    holds_objectfile,
    objectfile_folder,
    require_object,
    require_objectfile,
    with_objectfile,
)
from harness.objects.builtin import BUILTIN
from harness.objects.builtin import MATERIALS as BUILTIN_MATERIALS

_REACHED = (0.05, 0.45)
"""M: objects that an arm at this bench can reach around."""

_SIZES = (1e-3, 10.0)
"""Longest sides that may be requested, in m; the squares and cubes of smaller and larger ones lose digits."""

_Z = np.array([0.0, 0.0, 1.0])


class Pose(StrictModel):
    """Where the object nominally stands, in the robot's base."""

    position: tuple[Length, Length, Length] = (-0.42, 0.0, 0.25)  #: m, of the anchor.
    yaw: Angle = 0.0  #: rad, about the vertical.
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """axis of the object's frame that points up. In that frame z is up already where the mesh file declares
    its up axis, or where ``up_axis`` of the object states it."""
    anchor: Literal["bottom", "origin"] = "bottom"
    """the point meant by ``position``: the middle of the upright object's bottom (of its bounding box), or
    the mesh file's origin."""


class SceneObject(StrictModel):
    """The object under test."""

    mesh: str = Field(min_length=1)
    """``"builtin:mug"`` and so on, or a mesh file; relative to the scene file in the file, absolute once it
    is read. Left out where the object is that of an ObjectFile, which has its own."""
    units: Literal["m", "cm", "mm", "um", "in", "ft"] | None = None
    """of the mesh file's numbers; None to go by the file and its size."""
    up_axis: Literal["x", "y", "z"] | None = None
    """axis of the mesh file that points up: the file is rotated about its origin until that is z, which gives
    the object's frame; None for the axis that the file declares (glTF, COLLADA), else z."""
    material: str  #: a key of ``harness.basics.materials.MATERIALS``; a built-in object has one of its own.
    scale: float | Literal["hidden"] = 1.0
    """applied to the mesh after its units; ``"hidden"`` where nobody is told how large the object was made:
    models keep the drawing's size, and a mocked world draws another from the run's seed."""
    sizes: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] | None = None
    """m, from and to: the longest side that a hidden size may have; None for half to twice the drawing's,
    within 5 to 45 cm, what this bench's arm can reach around."""
    wall: Annotated[Length, Positive] | None = None
    """m, of an object whose mesh is only its outside; None for what the mesh says."""
    objectfile: str | None = Field(default=None, min_length=1)
    """folder of its ObjectFile, found as ``mesh`` is, or the name of one that comes with the program; None
    where it has none. Without ``mesh`` it is the object: its surface, its material and its networks."""
    pose: Pose = Pose()  #: nominal.

    @property
    def builtin(self) -> str | None:
        """The name of the built-in object, None for a mesh file."""
        return self.mesh.removeprefix(BUILTIN) if self.mesh.startswith(BUILTIN) else None

    @property
    def is_objectfile(self) -> bool:
        """Whether its surface and material are those of its ObjectFile."""
        return self.mesh.startswith(OBJECTFILE)

    @property
    def is_hidden(self) -> bool:
        """Whether nobody is told how large the object was made."""
        return self.scale == "hidden"

    @property
    def drawn_scale(self) -> float:
        """That its models have."""
        return 1.0 if self.scale == "hidden" else self.scale

    def sizes_of(self, nominal: float) -> tuple[float, float]:
        """M, from and to: what the longest side may be, of an object whose drawing's is ``nominal`` m."""
        if self.sizes is not None:
            return self.sizes
        low, high = max(0.5 * nominal, _REACHED[0]), min(2.0 * nominal, _REACHED[1])
        return (low, high) if low < high else (0.5 * nominal, 2.0 * nominal)

    @property
    def name(self) -> str:
        """What to call the object."""
        return self.builtin or Path(self.mesh.removeprefix(OBJECTFILE)).stem

    @model_validator(mode="before")
    @classmethod
    def _builtins_have_a_material(cls, data: Any) -> Any:
        mesh = data.get("mesh") if isinstance(data, dict) else None
        if not (isinstance(mesh, str) and mesh.startswith(BUILTIN)):
            return data
        name = mesh.removeprefix(BUILTIN)
        if name not in BUILTIN_MATERIALS:
            raise ValueError(f"there is no built-in object {name!r}; {nearest(name, BUILTIN_MATERIALS)}")
        material = data.get("material")
        return data if material is not None else {**data, "material": BUILTIN_MATERIALS[name]}

    @field_validator("sizes", mode="after")
    @classmethod
    def _require_a_range(cls, sizes: tuple[float, float] | None) -> tuple[float, float] | None:
        """Refuse sizes that no robot can press: their squares and cubes leave the range of numbers."""
        low, high = _SIZES
        if sizes is not None and not low <= sizes[0] < sizes[1] <= high:
            raise ValueError(
                f"the longest side of an object lies between {low * 1e3:g} mm and {high:g} m; give a smaller "
                "and a larger size within that"
            )
        return sizes

    @model_validator(mode="after")
    def _only_files_have_an_up_axis(self) -> "SceneObject":
        if self.up_axis is not None and (self.builtin is not None or self.is_objectfile):
            raise ValueError("up_axis is of a mesh file, and this object has z up; leave it out")
        return self

    @model_validator(mode="after")
    def _sizes_are_of_a_hidden_one(self) -> "SceneObject":
        if self.sizes is not None and not self.is_hidden:
            raise ValueError(
                'sizes are those a hidden size may have; leave them out, or say scale = "hidden"'
            )
        return self

    @field_validator("scale", mode="before")
    @classmethod
    def _a_factor_or_hidden(cls, given: Any) -> Any:
        number = isinstance(given, (int, float)) and not isinstance(given, bool)
        if given != "hidden" and not (number and 0.0 < given < math.inf):
            raise ValueError('it should be a number above 0, or "hidden" where nobody is told the size')
        return given

    @field_validator("material")
    @classmethod
    def _known(cls, name: str) -> str:
        if name.lower() not in MATERIALS:
            raise ValueError(f"not known; {nearest(name, MATERIALS)}")
        return name.lower()


class Support(StrictModel):
    """What holds the object up."""

    kind: Literal["foam", "clamped"] = "foam"
    """``"foam"``, a slender pedestal that leaves the object free; ``"clamped"``, a rigid one."""
    width: Annotated[Length, Positive] = 0.06
    """m, side of the pedestal's square section; its height is from the table to the object."""


class Table(StrictModel):
    """The table's plane, horizontal."""

    height: Length = 0.0  #: m, in base.
    size: tuple[Annotated[Length, Positive], Annotated[Length, Positive]] = (1.6, 1.6)
    """m, along base x and y."""


class Sensors(StrictModel):
    """Which senses the scene calls for."""

    touch: bool = True  #: the gel.
    sound: bool = False  #: hammer and microphones.
    camera: bool = False  #: the scene camera.
    noise: bool = False  #: whether simulated readings carry the instruments' own noise.


class Room(StrictModel):
    """A room around the bench; without one, the bench stands in the open."""

    size: tuple[Annotated[Length, Positive], Annotated[Length, Positive], Annotated[Length, Positive]]
    """m, along base x, y and z."""
    reverberation_time: Annotated[Time, Nonnegative] = 0.4  #: s for sound to fall by 60 dB.
    absorption: Annotated[Ratio, Nonnegative] | None = None  #: share of sound energy lost at a wall.


class Light(StrictModel):
    """A lamp over the bench, for the scene camera."""

    position: tuple[Length, Length, Length]  #: m, in base.
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)  #: relative red, green and blue.


class Section(StrictModel):
    """An experiment's own table in a scene file."""

    table: ClassVar[str]  #: its name there.
    seed: int = Field(default=0, ge=0)  #: of everything that the experiment draws; a run may say another.


S = TypeVar("S", bound=Section)


class SceneFile(StrictModel):
    """A scene. Every table but ``[object]`` may be left out.

    A file may hold the tables of experiments too, each checked by its own model; ``section`` gives one.
    """

    schema_number: Literal[1] = Field(alias="schema")  #: ``schema`` in the file.
    title: str = ""  #: one line for reports.
    object: SceneObject  #: under test.
    support: Support = Support()  #: under the object.
    table: Table = Table()  #: under the support.
    sensors: Sensors = Sensors()  #: that the scene calls for.
    room: Room | None = None  #: None in the open.
    lights: tuple[Light, ...] = ()  #: for the scene camera; none means that no light is simulated.
    observe: tuple[str, ...] = ("touch.image",)  #: the quantities that a comparison asks the simulation for.

    def section(self, model: type[S]) -> S:
        """An experiment's table; its defaults where the file has none."""
        found = vars(self).get(model.table)
        return found if isinstance(found, model) else model()

    def without_sections(self) -> "SceneFile":
        """What is on the table alone, for whoever knows no experiment."""
        own = {name: vars(self)[name] for name in SceneFile.model_fields}
        return SceneFile.model_construct(**own)

    def with_section(self, section: Section) -> "SceneFile":
        """The scene with another table of an experiment."""
        tree = self.model_dump(mode="json", by_alias=True)
        tree[section.table] = section.model_dump(mode="json", by_alias=True)
        return scene_from_json(tree, "the scene")

    def base_from_object(self, mesh: Mesh) -> FloatArray:
        """``(4, 4)``, nominal, of the object whose mesh in metres is given."""
        pose = self.object.pose
        upright = UPRIGHT[pose.up]
        anchor = np.zeros(3)
        if pose.anchor == "bottom":
            corners = mesh.vertices[np.unique(mesh.faces)] @ upright.T
            low, high = corners.min(axis=0), corners.max(axis=0)
            anchor = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
        turned = transform(rotation_about(_Z, pose.yaw), np.array(pose.position))
        return read_only(turned @ translation(-anchor) @ transform(upright, np.zeros(3)))


def load_scene(path: Path) -> SceneFile:
    """A scene file, its mesh's and its ObjectFile's paths made absolute.

    Args:
        path: or the name of a scene in ``scenes/``, as ``mug_touch``.

    Raises:
        WrongUse: naming each mistake; or the mesh file or the ObjectFile does not exist.
    """
    path = named_file(str(path), "scene")
    tree = with_objectfile(read_toml(path), path.parent, str(path))
    return _with_files_found(scene_from_json(tree, str(path)), path.parent, str(path))


def scene_from_options(
    mesh: str,
    material: str | None = None,
    units: str | None = None,
    wall: str | None = None,
    objectfile: str | None = None,
    up_axis: str | None = None,
) -> SceneFile:
    """The scene that ``run --object FILE --material M --units mm --wall 2mm`` means.

    Args:
        mesh: file, relative to the working directory, ``"builtin:mug"``, or an ObjectFile: its folder, or the
            name of one that comes with the program.
        material: None only for a built-in object and for an ObjectFile.
        units: of the file's numbers.
        wall: a length with its unit.
        objectfile: folder, relative to the working directory, or such a name.
        up_axis: axis of the file that points up: "x", "y" or "z".

    Raises:
        WrongUse: an option that cannot be, or no such file.
    """
    given = {
        "mesh": mesh,
        "material": material,
        "units": units,
        "wall": wall,
        "objectfile": objectfile,
        "up_axis": up_axis,
    }
    if holds_objectfile(objectfile_folder(mesh, Path.cwd())):
        if objectfile is not None:
            raise WrongUse(f"--object {mesh} is an ObjectFile already; leave --objectfile {objectfile} out")
        given |= {"mesh": None, "objectfile": mesh}
    elif material is None and not mesh.startswith(BUILTIN):
        raise WrongUse(
            f"--object {mesh} needs --material: it is one of {', '.join(MATERIALS)} (sound and mass "
            "depend on it, touch does not)"
        )
    said = {"schema": 1, "object": {key: value for key, value in given.items() if value is not None}}
    tree = with_objectfile(said, Path.cwd(), "the options")
    return _with_files_found(validate(tree, SceneFile, "the options"), Path.cwd(), "the options")


def scene_from_json(tree: Any, where: str) -> SceneFile:
    """The scene that ``model_dump(mode="json")`` wrote, for example into a recording."""
    known = {row.section: row.model for row in EXPERIMENTS.values() if row.section and row.model}
    keys = set(tree) if isinstance(tree, dict) else set()
    strange = keys - set(known) - {field.alias or name for name, field in SceneFile.model_fields.items()}
    # The tables of experiments that the scene has are each checked by their model. If a key is unknown, all
    # tables are named, so that the message lists every known key.
    named = tuple(name for name in known if strange or name in keys)
    return validate(tree, _with_tables(tuple((name, known[name]) for name in named)), where)


@cache
def _with_tables(named: tuple[tuple[str, str], ...]) -> type[SceneFile]:
    if not named:
        return SceneFile
    models = {name: loaded(reference) for name, reference in named}
    fields: dict[str, Any] = {name: (model, model()) for name, model in models.items()}
    return create_model("SceneFile", __base__=SceneFile, **fields)


def _with_files_found(scene: SceneFile, folder: Path, where: str) -> SceneFile:
    named, found = scene.object, {}
    if named.builtin is None and not named.is_objectfile:
        require_object(named.mesh, folder, f"{where}: 'object.mesh'", objectfiles=False)
        found["mesh"] = str(real_path(folder / named.mesh))
    if named.objectfile is not None:
        path = objectfile_folder(named.objectfile, folder)
        require_objectfile(path, f"{where}: 'object.objectfile'")
        found["objectfile"] = str(path)
    return scene.model_copy(update={"object": named.model_copy(update=found)}) if found else scene
