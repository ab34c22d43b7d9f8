"""What a run gives the simulation of its scene camera's picture: the camera, the lamps, the object's look."""

from collections.abc import Sequence
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.scene_camera import Lamp, scene_lamps, scene_pinhole
from harness.bench.station_file import Station
from harness.picture.pinhole import DirectionalLight

_GREY = 1e-6
"""Relative, by which the parts of a lamp's colour may differ and still be one number."""


def camera_gives(scene: SceneFile, station: Station) -> tuple[str, ...]:
    """Sources of a picture that a run of this scene has; none without a scene camera.

    Rays need the object's colours, which a run knows of a built-in object alone.
    """
    if station.camera is None or not scene.sensors.camera:
        return ()
    colours = () if scene.object.builtin is None else ("object.appearance",)
    return ("camera", "camera.lights", *colours)


def require_white_lamps(scene: SceneFile) -> None:
    """Refuse a scene whose picture is to be simulated under a coloured lamp.

    Raises:
        WrongUse: naming the lamp and its colour.
    """
    for number, lamp in enumerate(scene.lights, start=1):
        if max(lamp.colour) - min(lamp.colour) > _GREY * max(lamp.colour):
            raise WrongUse(
                f"lamp {number} of the scene has the colour {list(lamp.colour)}, and a run's picture is "
                "simulated under white lamps; give its red, green and blue one number, or leave camera.image "
                "out of observe"
            )


def camera_sources(scene: SceneFile, station: Station, mesh: Mesh, wanted: Sequence[str]) -> dict[str, Any]:
    """Those of ``camera_gives`` that are wanted, in the object's frame at its nominal pose.

    Args:
        scene: with a camera and white lamps.
        station: whose camera it is.
        mesh: of the object, in metres.
        wanted: names of sources; others than a camera's are left to others.

    Raises:
        WrongUse: the station has no camera.
    """
    sources: dict[str, Any] = {}
    if "camera" in wanted:
        sources["camera"] = scene_pinhole(station, scene, mesh)
    if "camera.lights" in wanted:
        sources["camera.lights"] = tuple(_as_strong(lamp) for lamp in scene_lamps(scene, mesh))
    if "object.appearance" in wanted and scene.object.builtin is not None:
        # Loaded by those alone who follow rays on the mesh.
        from harness.sim.light.appearance_source import builtin_appearance

        sources["object.appearance"] = builtin_appearance(scene.object.builtin, scene.object.drawn_scale)
    return sources


def _as_strong(lamp: Lamp) -> DirectionalLight:
    """The light of a white lamp, as strong as its colour says."""
    return DirectionalLight(lamp.light.direction, lamp.light.irradiance * float(lamp.colour[0]))
