"""The model of a scene's object: with its modes where the scene is to be heard."""

from functools import partial

from experiments.contact_localization.model import Model
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.object_modes import ReadFile, object_modes
from harness.objectfile.file import ObjectFile
from harness.recording.run_folder import RunFiles
from harness.sim.optics.tactile_calibration import TactileCalibration


def model_of_run(run: RunFiles, accuracy: Accuracy | None = None) -> Model:
    """The object and the sensor as a recording carries them.

    Args:
        run: the folder.
        accuracy: levels of the modes' dials; None for the default ones.
    """
    carried = partial(_carried, run)
    return model_of_scene(run.scene, run.station, run.mesh, run.calibration, accuracy, carried)


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
        accuracy: levels of the modes' dials; None for the default ones.
        objectfile: reads the object's; None for the one that the scene names.

    Raises:
        MeshRefused: the scene calls for sound, and the object's surface cannot be filled.
        WrongUse: modes are to come from an ObjectFile, and there is none or another object's.
    """
    if not scene.sensors.sound:
        return Model(mesh, station.gel.sensor, calibration)
    modes = object_modes(scene, station, mesh, accuracy, objectfile)
    return Model(mesh, station.gel.sensor, calibration, modes, MATERIALS[scene.object.material])


def _carried(run: RunFiles) -> ObjectFile:
    return run.objectfile
