"""The scene camera as the object sees it: where it is, what lamps there are, and a frame of its stream."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh
from harness.bench.device import CAMERA
from harness.bench.scene import SceneFile
from harness.bench.station import RunContext, open_station
from harness.bench.station_file import Station
from harness.picture.pinhole import DirectionalLight, Pinhole

_PATIENCE = 3.0
"""s for a frame to come."""


@dataclass(frozen=True, eq=False)
class Lamp:
    """A lamp of the scene."""

    light: DirectionalLight  #: of white, as far away as makes no difference.
    colour: FloatArray  #: ``(3,)`` of it, relative red, green and blue.


def scene_pinhole(station: Station, scene: SceneFile, mesh: Mesh) -> Pinhole:
    """The scene camera in the object's frame, at the object's nominal pose.

    Args:
        station: whose camera it is.
        scene: says where the object stands.
        mesh: of the object, metres.

    Raises:
        WrongUse: the station has no camera.
    """
    section = station.camera
    if section is None:
        raise WrongUse(f"the station {station.title!r} has no [camera]; add one to its file")
    object_from_camera = inverse(scene.base_from_object(mesh)) @ section.base_from_camera.matrix
    middle = (0.5 * section.columns, 0.5 * section.rows)
    return Pinhole(section.columns, section.rows, section.focal_length, middle, object_from_camera)


def scene_lamps(scene: SceneFile, mesh: Mesh) -> tuple[Lamp, ...]:
    """The scene's lamps in the object's frame, each as seen from the middle of the object.

    Args:
        scene: says where they are, in base.
        mesh: of the object, metres.

    Raises:
        OutOfDomain: a lamp in the middle of the object.
    """
    object_from_base = inverse(scene.base_from_object(mesh))
    middle = mesh.bounds.mean(axis=0)
    return tuple(
        Lamp(
            DirectionalLight(apply(object_from_base, np.array(each.position)[None])[0] - middle),
            np.array(each.colour),
        )
        for each in scene.lights
    )


def scene_frame(station: Station, scene: SceneFile, mesh: Mesh, seed: int = 0) -> ByteArray:
    """What the scene camera sees now; a mocked bench is started for it, and ended.

    Args:
        station: whose camera it is.
        scene: that a mocked world shows.
        mesh: of the object, metres.
        seed: of a mocked world.

    Returns:
        ``(rows, columns, 3)`` RGB.

    Raises:
        WrongUse: the station has no camera.
        BenchFault: it did not open, or sends nothing for 3 s.
    """
    seen = scene.model_copy(
        update={"sensors": scene.sensors.model_copy(update={"camera": True, "sound": False})}
    )
    with tempfile.TemporaryDirectory(prefix="touchstone-truth-") as folder:
        context = RunContext(Path(folder) / "truth.json", mesh, seed)
        with open_station(station, seen, context, only=[CAMERA]) as bench:
            frame: ByteArray = bench.get(CAMERA).read(1, timeout=_PATIENCE).values[0]
            return frame
