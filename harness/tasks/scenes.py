"""Descriptions of a scene: a file, or an object, with changed settings."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
from harness.bench.scene import SceneFile, Section, load_scene, scene_from_json, scene_from_options


@dataclass(frozen=True)
class SceneOptions:
    """Options of a scene: a file or an object, and changed settings; None for unchanged ones."""

    scene: Path | None = None  #: file or name of the object.
    object: str | None = None  #: a mesh, a built-in object or an ObjectFile instead.
    material: str | None = None  #: of that object.
    units: str | None = None  #: of that object.
    wall: str | None = None  #: of that object.
    objectfile: str | None = None  #: of that object.
    sense: str | None = None  #: ``"both"``, or senses with commas between.
    sizes: tuple[str, str] | None = None  #: between which the longest side of an object of unknown size is.
    keys: Mapping[str, Any] = field(default_factory=dict)  #: of the experiment's table.
    assignments: Sequence[str] = ()  #: the same, as ``KEY=VALUE``.
    up_axis: str | None = None  #: of that object.

    def with_key(self, key: str, value: str) -> "SceneOptions":
        """Return the same description with another key of the experiment's table."""
        return replace(self, keys={**self.keys, key: value})

    @property
    def of_object(self) -> tuple[str | None, ...]:
        """What belongs to ``object`` alone."""
        return self.material, self.units, self.wall, self.objectfile, self.up_axis


def resolve(
    options: SceneOptions,
    section: type[Section] | None = None,
    assumed: Mapping[str, Mapping[str, Any]] | None = None,
) -> SceneFile:
    """The scene that a command line means.

    Args:
        options: of the command line.
        section: model of the experiment's table; None where it has none.
        assumed: keys of tables that a scene of ``--object`` has where no option says otherwise.

    Raises:
        WrongUse: neither or both of scene and object are given, or something that the scene does not allow.
    """
    found = _chosen(options, assumed or {})
    tables: dict[str, Mapping[str, Any]] = {}
    if section is not None:
        tables[section.table] = _asked(section, options.keys, options.assignments)
    if options.sense is not None:
        tables["sensors"] = _sensors(options.sense)
    if options.sizes is not None:
        tables["object"] = {"scale": "hidden", "sizes": options.sizes}
    return _with(found, tables)


def _chosen(options: SceneOptions, assumed: Mapping[str, Mapping[str, Any]]) -> SceneFile:
    """The scene of the file, or that of the object."""
    if (options.scene is None) == (options.object is None):
        raise WrongUse(
            "name the object on the table: either --scene NAME or --object NAME, e.g. --object mug"
        )
    if options.object is not None:
        return _with(scene_from_options(options.object, *options.of_object), assumed)
    if any(option is not None for option in options.of_object):
        raise WrongUse(
            "--material, --units, --wall, --objectfile and --up-axis belong to --object; a scene file states "
            "its own"
        )
    assert options.scene is not None
    return load_scene(options.scene)


def with_assignments(
    scenes: Mapping[str, SceneFile], section: type[Section] | None, assignments: Sequence[str]
) -> dict[str, SceneFile]:
    """Scenes by name, with keys of an experiment's table changed in all of them.

    Args:
        scenes: by name.
        section: the model of the table; None where the experiment has none.
        assignments: ``KEY=VALUE`` each.

    Raises:
        WrongUse: a key that the table does not have, or a value that the scene does not allow.
    """
    if section is None and assignments:
        raise WrongUse(f"--set {assignments[0]}: this experiment has no table in a scene; leave it out")
    tables = {} if section is None else {section.table: _asked(section, {}, assignments)}
    return {name: _with(scene, tables) for name, scene in scenes.items()}


_SENSORS = {"vision": "camera", "audio": "sound", "touch": "touch"}
"""By the sense that reads them."""


def _sensors(sense: str) -> dict[str, bool]:
    """What ``--sense vision,touch`` switches on and off; ``both`` is touch and audio."""
    if sense in ("touch", "both"):
        return {"touch": True, "sound": sense == "both"}
    named = [name.strip() for name in sense.split(",")]
    for name in named:
        if name not in _SENSORS:
            raise WrongUse(
                f"--sense {sense}: {name!r} is no sense; {nearest(name, (*_SENSORS, 'both'))}, or several "
                "with commas between"
            )
    return {sensor: name in named for name, sensor in _SENSORS.items()}


def _asked(
    section: type[Section] | None, keys: Mapping[str, Any], assignments: Sequence[str]
) -> dict[str, Any]:
    """Keys of an experiment's table and what they are to be, as JSON has it."""
    given = {key: value for key, value in keys.items() if value is not None}
    asked: dict[str, Any] = {k: value if isinstance(value, int) else str(value) for k, value in given.items()}
    for text in assignments:
        key, equals, value = text.partition("=")
        if not equals:
            raise WrongUse(f"--set {text}: write KEY=VALUE, as contacts=4")
        try:
            asked[key.strip()] = tomllib.loads(f"value = {value.strip()}")["value"]
        except (ValueError, RecursionError):  # words without quotes are text
            asked[key.strip()] = value.strip()
    known = set() if section is None else set(section.model_fields)
    for key in asked:
        if key not in known:
            option = f"--{key}" if keys.get(key) is not None else f"--set {key}"
            raise WrongUse(f"{option}: this experiment has no setting {key!r}; {nearest(key, known)}")
    return asked


def _with(scene: SceneFile, tables: Mapping[str, Mapping[str, Any]]) -> SceneFile:
    """The scene with keys of its tables changed."""
    if not any(tables.values()):
        return scene
    tree = scene.model_dump(mode="json", by_alias=True)
    for name, changed in tables.items():
        if changed:
            tree.setdefault(name, {}).update(changed)
    return scene_from_json(tree, "the options")
