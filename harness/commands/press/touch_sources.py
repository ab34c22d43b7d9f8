"""What ``sim touch`` is given: a gel, and a height map or a mesh to press onto it."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from harness.commands import options, places
from harness.commands.press.touch_answer import Touched

if TYPE_CHECKING:
    from harness.bench.scene import SceneFile
    from harness.sim.gel.height_file import Heights
    from harness.sim.optics.pressed_gel import Gel


def refuse(sentence: str) -> NoReturn:
    """Raise ``WrongUse``."""
    from harness.basics.errors import WrongUse

    raise WrongUse(sentence)


def gel(
    sensor: str | None,
    calibration: str | None,
    pitch: str | None,
    thickness: str | None,
    background: Path | None,
    shadow: bool | None,
    noise: float,
    seed: int,
    markers: Path | None = None,
) -> "Gel":
    """The gel that the options describe; ``WrongUse`` and ``CalibrationRefused`` as ``known_gel``."""
    from dataclasses import replace

    from harness.basics.quantities import LENGTH
    from harness.picture.image_file import read_image
    from harness.sim.gel.marker_file import read_markers
    from harness.sim.optics.known_gel import known_gel

    gel = known_gel(
        sensor,
        calibration,
        pitch=options.positive("--pitch", pitch, LENGTH),
        thickness=options.positive("--thickness", thickness, LENGTH),
        background=None if background is None else read_image(background),
        shadow=shadow,
    )
    if not math.isfinite(noise):
        refuse(f"--noise of {noise} grey levels cannot be drawn; give a finite number")
    gel = replace(gel, noise=noise, seed=seed)
    return gel if markers is None else gel.with_dots(read_markers(markers))


def of_heights(
    path: Path, of: str, under: Path | None, gel: "Gel", levels: list[str], force: bool = False
) -> Touched:
    """The press of a height map; ``under`` is how deep the object reaches below a gel's surface."""
    from harness.effects.touch_press import press_heights
    from harness.sim.gel.height_file import read_heights

    kind = _heights_of(of)
    begun = time.perf_counter()
    given = read_heights(path, gel.sensor, kind)
    if under is not None and kind == "object":
        refuse("--reached stands beside the surface of a gel; an object's --height says it already")
    reached = None if under is None else read_heights(under, gel.sensor)
    read = time.perf_counter() - begun
    missing = given.missing if reached is None else given.missing | reached.missing
    touched = None if reached is None else reached.heights
    scene = _scene(str(path), (None, None), gel)
    press = press_heights(given.heights, kind, gel, scene, levels, touched, missing, force)
    return Touched(press, str(path), seconds={"read": read})


def _heights_of(text: str) -> "Heights":
    from harness.basics.errors import WrongUse

    if text == "object":
        return "object"
    if text == "gel":
        return "gel"
    raise WrongUse(f"--heights-of {text} is no kind of height map; there are object and gel")


def of_mesh(
    mesh: str,
    file: tuple[str | None, str | None],
    contact: places.Coordinates | None,
    vertex: int | None,
    pose: tuple[str | None, str | None, str | None, str | None],
    gel: "Gel",
    levels: list[str],
    objectfile: Path | None = None,
    force: bool = False,
) -> Touched:
    """Press a mesh onto a gel.

    Args:
        mesh: a file, a built-in object or an ObjectFile.
        file: unit of the file's numbers and axis that points up; None where left out.
        contact: where it is pressed, or None.
        vertex: number of the vertex where it is pressed, or None.
        pose: depth, tilt, azimuth and yaw with their units; None where left out.
        gel: onto which it is pressed.
        levels: of knobs.
        objectfile: folder of the object's networks.
        force: whether the force is computed.
    """
    from harness.basics.quantities import ANGLE, LENGTH
    from harness.effects.scene_object import known_object
    from harness.effects.touch_press import press_mesh
    from harness.sim.gel.press_pose import gel_from_object
    from harness.sim.gel.presses import Presses

    depth = options.quantity("--depth", pose[0] or "1mm", LENGTH)
    tilt, azimuth, yaw = (
        options.quantity(option, text or "0deg", ANGLE)
        for option, text in zip(("--tilt", "--azimuth", "--yaw"), pose[1:], strict=True)
    )
    begun = time.perf_counter()
    scene = _scene(mesh, file, gel, objectfile)
    known = known_object(scene)
    place = places.pressed_place(known.mesh, contact, vertex)
    at = gel_from_object(place, depth, tilt, azimuth, yaw, gel.sensor.gel_thickness)
    read = time.perf_counter() - begun
    sources = {
        "object.mesh": known.mesh,
        "contact.gel_from_object": at[None],
        "contact.presses": Presses.one(place.point, place.normal, depth, tilt, azimuth, yaw),
    }
    press = press_mesh(sources, gel, scene, levels, force)
    asked = {"depth_m": depth, "tilt_rad": tilt, "azimuth_rad": azimuth, "yaw_rad": yaw}
    return Touched(press, mesh, place, at, asked, (*known.read, *known.warnings), seconds={"mesh": read})


def _scene(
    what: str, file: tuple[str | None, str | None], gel: "Gel", objectfile: Path | None = None
) -> "SceneFile":
    """A table with nothing on it but what is touched; touch does not depend on its material."""
    from harness.basics.toml_file import validate
    from harness.bench.scene import SceneFile, scene_from_options
    from harness.bench.scene_objectfile import holds_objectfile, objectfile_folder
    from harness.objects.builtin import BUILTIN

    if what.endswith(".npy"):
        tree = {"schema": 1, "object": {"mesh": what, "material": "steel"}}
        scene = validate(tree, SceneFile, "the options")
    else:
        says_its_own = what.startswith(BUILTIN) or holds_objectfile(objectfile_folder(what, Path.cwd()))
        material = None if says_its_own else "steel"
        named = None if objectfile is None else str(objectfile)
        scene = scene_from_options(what, material, file[0], objectfile=named, up_axis=file[1])
    return scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"noise": gel.noise > 0.0})})
