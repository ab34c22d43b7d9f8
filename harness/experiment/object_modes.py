"""The modes of a scene's object: from the store where they were found before, or from its ObjectFile."""

from collections.abc import Callable
from functools import partial

from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS, scene_levels
from harness.effects.effect import Facts
from harness.effects.evaluate import evaluate
from harness.effects.plan import default_accuracy, plan
from harness.effects.quantities import Quantities
from harness.effects.scene_object import known_file
from harness.objectfile.file import ObjectFile
from harness.recording.run_folder import RunFiles
from harness.sim.modal.modes import Modes

ReadFile = Callable[[], ObjectFile | None]
"""Reads the object's ObjectFile, asked only where the modes come from it."""


def carried_by(run: RunFiles) -> ReadFile:
    """Reads the ObjectFile that a run carries, where its scene names one."""
    return lambda: run.objectfile


def object_modes(
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    accuracy: Accuracy | None = None,
    objectfile: ReadFile | None = None,
) -> Modes:
    """The object's modes: from the store where they were found before, or from its ObjectFile.

    Args:
        scene: says the material and the wall.
        station: gives the sensor.
        mesh: of the object, in metres.
        accuracy: levels of the modes' dials; None for the ObjectFile's network, or the default ones.
        objectfile: reads the object's; None for the one that the scene names.
    """
    levels = accuracy or default_accuracy(EFFECTS).with_(scene_levels(scene))
    chosen = plan(EFFECTS, Facts(scene, station.gel.sensor), ("object.modes",), levels)
    sources: Quantities = {
        "object_mesh": mesh,
        "object_wall": scene.object.wall,
        "object_material": MATERIALS[scene.object.material],
    }
    if "object.file" in chosen.sources:
        of = (objectfile or partial(known_file, scene, mesh))()
        if of is not None:
            sources["object_file"] = of
    modes = evaluate(chosen, sources, Store(default_folder())).sound.modes
    assert modes is not None  # they were wanted
    return modes
