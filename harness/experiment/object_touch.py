"""A scene's object along the tool, by the networks of its ObjectFile."""

from functools import partial
from typing import TYPE_CHECKING

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.effects.file_levels import NETWORK
from harness.effects.scene_object import known_file
from harness.effects.touch_file_effects import SHAPES
from harness.experiment.object_modes import ReadFile
from harness.sim.optics.tactile_calibration import TactileCalibration
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.touch.tool_depth import CodedDepth


def object_touch(
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    calibration: TactileCalibration,
    accuracy: Accuracy,
    objectfile: ReadFile | None = None,
) -> "CodedDepth | None":
    """What candidates' tactile images are crops of; None where the mesh is drawn.

    Args:
        scene: says the wall, and may name an ObjectFile.
        station: gives the sensor.
        mesh: of the object, in metres.
        calibration: of the gel.
        accuracy: its level of ``touch.shapes``.
        objectfile: reads the object's; None for the one that the scene names.

    Raises:
        WrongUse: a level that answers no candidates; or no ObjectFile, or one of another object or gel.
        DataRefused: an ObjectFile without that touch, or a damaged one.
    """
    level = accuracy.of(SHAPES)
    if level == SHAPES.default:
        return None
    if level != NETWORK:
        raise WrongUse(
            f"{SHAPES.name} = {level}: it answers single presses, of no yaw, where an estimate compares "
            f"thousands; take {SHAPES.name} = {NETWORK} or {SHAPES.default}"
        )
    of = (objectfile or partial(known_file, scene, mesh))()
    if of is None:
        raise WrongUse(
            f"{SHAPES.name} = {level}: the scene names no ObjectFile; name one with --object FOLDER, or take "
            f"{SHAPES.name} = {SHAPES.default}"
        )
    # Graphs are loaded by those alone who take touch from an ObjectFile.
    from harness.objectfile.touch.level import tool_depth_from

    solid = walled(mesh, scene.object.wall)
    return tool_depth_from(of, solid, station.gel.sensor, calibration.header.skirt)
