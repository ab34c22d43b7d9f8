"""From options to the scene they mean."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.toml_file import nearest
from harness.bench.scene import SceneFile, Section, load_scene, scene_from_json, scene_from_options


def resolve(
    scene: Path | None,
    object_: str | None,
    material: str | None = None,
    units: str | None = None,
    wall: str | None = None,
    sense: str | None = None,
    objectfile: str | None = None,
    section: type[Section] | None = None,
    keys: Mapping[str, Any] | None = None,
    assignments: Sequence[str] = (),
) -> SceneFile:
    """The scene of a file or of ``--object``, with what the command line changes of it.

    Raises:
        WrongUse: neither or both are given, or something that the scene does not allow.
    """
    if (scene is None) == (object_ is None):
        raise WrongUse("say what is on the table: either --scene FILE or --object FILE --material M")
    if scene is not None:
        if any(option is not None for option in (material, units, wall, objectfile)):
            raise WrongUse(
                "--material, --units, --wall and --objectfile belong to --object; a scene file says its own"
            )
        found = load_scene(scene)
    else:
        assert object_ is not None
        found = scene_from_options(object_, material, units, wall, objectfile)
    sensors = None if sense is None else {"touch": True, "sound": sense == "both"}
    return _changed(found, section, _asked(section, keys or {}, assignments), sensors)


def _asked(
    section: type[Section] | None, keys: Mapping[str, Any], assignments: Sequence[str]
) -> dict[str, Any]:
    """Keys of an experiment's table and what they are to be, as JSON has it."""
    asked = {key: str_or_int(value) for key, value in keys.items() if value is not None}
    for text in assignments:
        key, equals, value = text.partition("=")
        if not equals:
            raise WrongUse(f"--set {text}: write KEY=VALUE, as contacts=4")
        asked[key.strip()] = _plain(value.strip())
    known = set() if section is None else set(section.model_fields)
    for key in asked:
        if key not in known:
            raise WrongUse(f"--{key}: the experiment's table has no {key!r}; {nearest(key, known)}")
    return asked


def _plain(text: str) -> Any:
    """A value as TOML has it; words without quotes are text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def str_or_int(value: Any) -> Any:
    """An option's value as JSON would have it."""
    return value if isinstance(value, int) else str(value)


def _changed(
    scene: SceneFile,
    section: type[Section] | None,
    asked: dict[str, Any],
    sensors: dict[str, Any] | None,
) -> SceneFile:
    if not asked and sensors is None:
        return scene
    tree = scene.model_dump(mode="json", by_alias=True)
    if section is not None:
        tree.setdefault(section.table, {}).update(asked)
    tree["sensors"].update(sensors or {})
    return scene_from_json(tree, "the options")
