"""The model of a scene's object: with its modes where the scene is to be heard."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from experiments.contact_localization.model import Model
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS, scene_levels
from harness.effects.effect import knobs_of
from harness.effects.explain import without_sound
from harness.effects.scene_object import known_file
from harness.effects.touch import SHAPES
from harness.experiment.object_modes import ReadFile, carried_by, object_modes
from harness.recording.run_folder import RunFiles
from harness.sim.optics.tactile_calibration import TactileCalibration
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.touch.tool_depth import CodedDepth


def model_of_run(run: RunFiles, accuracy: Accuracy | None = None) -> Model:
    """The object and the sensor as a recording carries them.

    An object whose modes cannot be found is touched all the same; ``Model.sound_refusal`` is the reason.

    Args:
        run: the folder.
        accuracy: levels of the simulation's dials; None for the ObjectFile's networks, or the default ones.
    """
    rest = run.station, run.mesh, run.calibration, accuracy, carried_by(run)
    try:
        return model_of_scene(run.scene, *rest)
    except MeshRefused as refusal:
        return replace(model_of_scene(without_sound(run.scene), *rest), sound_refusal=str(refusal))


def model_of_scene(
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    calibration: TactileCalibration,
    accuracy: Accuracy | None = None,
    objectfile: ReadFile | None = None,
) -> Model:
    """The object and the sensor of a scene; modes only where it calls for sound.

    Args:
        scene: resolved.
        station: gives the sensor.
        mesh: of the object, in metres.
        calibration: of the gel, as the estimator is to know it.
        accuracy: levels of the simulation's dials; None for the ObjectFile's networks, or the default ones.
        objectfile: reads the object's; None for the one that the scene names.

    Raises:
        MeshRefused: the scene calls for sound, and the object's surface cannot be filled, or parts of it
            hang together without stiffness.
        WrongUse: modes or touch are to come from an ObjectFile, and there is none or another object's.
    """
    chosen = accuracy or Accuracy.default(knobs_of(EFFECTS)).with_(scene_levels(scene))
    sensor = station.gel.sensor
    seen = object_touch(scene, station, mesh, calibration, chosen, objectfile)
    rms = 0.0 if seen is None else seen.rms
    if not scene.sensors.sound:
        return Model(mesh, sensor, calibration, seen=seen, seen_rms=rms, errors=station.errors)
    modes = object_modes(scene, station, mesh, chosen, objectfile)
    loose = int(np.count_nonzero(~(modes.frequencies > 0.0)))
    if loose:
        raise MeshRefused(
            f"{loose} of the object's {len(modes.frequencies)} modes have no stiffness: parts of it hang "
            "together by an edge or a point only; join them by faces"
        )
    material = MATERIALS[scene.object.material]
    return Model(mesh, sensor, calibration, modes, material, seen=seen, seen_rms=rms, errors=station.errors)


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
        WrongUse: no ObjectFile, or one of another object or gel.
        DataRefused: an ObjectFile without that touch, or a damaged one.
    """
    level = accuracy.of(SHAPES)
    if level == SHAPES.default:
        return None
    of = (objectfile or partial(known_file, scene, mesh))()
    if of is None:
        raise WrongUse(
            f"{SHAPES.name} = {level}: the scene names no ObjectFile; name one with --object FOLDER, or take "
            f"{SHAPES.name} = {SHAPES.default}"
        )
    # Graphs are loaded by those alone who take touch from an ObjectFile.
    from harness.objectfile.touch.level import require_own_touch
    from harness.objectfile.touch.tool_depth import open_tool_depth

    solid = walled(mesh, scene.object.wall)
    require_own_touch(of, solid, station.gel.sensor, calibration.header.skirt)
    return open_tool_depth(of)
