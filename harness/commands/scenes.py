"""From options to the scene they mean."""

from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile, load_scene, scene_from_json, scene_from_options


def resolve(
    scene: Path | None,
    object_: str | None,
    material: str | None = None,
    units: str | None = None,
    wall: str | None = None,
    contacts: int | None = None,
    spacing: str | None = None,
    yaw: str | None = None,
    sense: str | None = None,
    objectfile: str | None = None,
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
    changes = {"contacts": contacts, "spacing": spacing, "yaw": yaw}
    asked = {key: str_or_int(value) for key, value in changes.items() if value is not None}
    return _changed(found, asked, None if sense is None else {"touch": True, "sound": sense == "both"})


def str_or_int(value: Any) -> Any:
    """An option's value as JSON would have it."""
    return value if isinstance(value, int) else str(value)


def _changed(scene: SceneFile, localization: dict[str, Any], sensors: dict[str, Any] | None) -> SceneFile:
    if not localization and sensors is None:
        return scene
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["localization"].update(localization)
    tree["sensors"].update(sensors or {})
    return scene_from_json(tree, "the options")
