"""The nominal bench that the world departs from, out of a scene and a station.

The lab is told of it in a file of JSON, ``{"schema": 1, "scene": ..., "station": ...,
"mesh": PATH or null, "base_from_object": 4 x 4}``: scene and station as their models write them,
and for an object that is not built in, the ``.npz`` (``vertices`` in metres, ``faces``) of its
repaired mesh.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.gap import Gap
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station, station_from_json
from harness.objects.builtin import build
from mocks.world.gap_draw import GapDraw
from mocks.world.world import Camera, Furniture, NominalBench, World

if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts

SCHEMA = 1

EDGE = 2.2e-3
"""Metres between the vertices of built-in objects: no other part of the program uses this one."""


@dataclass(frozen=True, eq=False)
class LabScene:
    """What a lab is told."""

    bench: NominalBench  #: nominal.
    scene: SceneFile  #: what is on the table.
    station: Station  #: whose instruments are mocked.


_KEYS = {"schema", "scene", "station", "mesh", "base_from_object"}


def read_lab_scene(path: Path, draw: GapDraw) -> LabScene:
    """The bench of a file, its object as large as the run's draws say where nobody is told.

    Raises:
        WrongUse: it cannot be read, or is not what a lab is told.
    """
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise WrongUse(f"the lab cannot read its scene {path}: {error}") from error
    if not isinstance(told, dict) or set(told) != _KEYS or told["schema"] != SCHEMA:
        raise WrongUse(
            f"{path} is not what a lab is told: the keys {', '.join(sorted(_KEYS))}, schema {SCHEMA}"
        )
    scene = scene_from_json(told["scene"], str(path))
    station = station_from_json(told["station"], str(path))
    mesh = None
    if told["mesh"] is not None:
        try:
            with np.load(Path(told["mesh"]), allow_pickle=False) as archive:
                mesh = Mesh(archive["vertices"], archive["faces"])
        except (OSError, ValueError, KeyError) as error:
            raise WrongUse(f"the lab cannot read the object's mesh {told['mesh']}: {error}") from error
    bench = nominal_bench(scene, station, mesh, np.array(told["base_from_object"]), draw)
    return LabScene(bench, scene, station)


def nominal_bench(
    scene: SceneFile, station: Station, mesh: Mesh | None, base_from_object: FloatArray, draw: GapDraw
) -> NominalBench:
    """The bench as scene and station state it.

    Args:
        scene: what is on the table.
        station: the instruments.
        mesh: of the object in metres, scaled; None for a built-in object, which the world
            tessellates anew.
        base_from_object: ``(4, 4)``, nominal, of the object as it is drawn.
        draw: of the run: how large the object is where the scene hides it.

    Raises:
        WrongUse: no mesh for an object that is not built in.
    """
    if mesh is not None:
        drawn = mesh
    elif scene.object.builtin is not None:
        fine = build(scene.object.builtin, edge=EDGE)
        drawn = Mesh(fine.vertices * scene.object.drawn_scale, fine.faces)
    else:
        raise WrongUse(f"the world needs the mesh of {scene.object.name}: it is not built in")
    made: float | None = None
    if scene.object.is_hidden:
        nominal = float(np.ptp(drawn.bounds, axis=0).max())
        made = draw.hidden_size(*scene.object.sizes_of(nominal)) / nominal
    placed, factor = base_from_object.copy(), 1.0 if made is None else made
    # Grown about its anchor, it stands where it stood.
    anchor = np.array(scene.object.pose.position)
    placed[:3, 3] = anchor + factor * (placed[:3, 3] - anchor)
    camera = None
    seen = station.camera
    if seen is not None and scene.sensors.camera:
        camera = Camera(seen.base_from_camera.matrix, seen.rows, seen.columns, seen.focal_length)
    return NominalBench(
        mesh=drawn if made is None else Mesh(made * drawn.vertices, drawn.faces),
        base_from_object=base_from_object if made is None else placed,
        flange_from_gel=station.flange_from_gel,
        sensor=station.gel.sensor,
        calibration=station.gel.calibration,
        other_calibration=station.gel.described.world_calibration,
        camera=camera,
        furniture=Furniture(scene.table.height, scene.table.size, scene.support.width),
        made_scale=made,
        drawing=None if made is None else drawn,
    )


def strikes_of(
    world: World, scene: SceneFile, station: Station, gap: Gap, seed: int
) -> "StrikeCounts | None":
    """What the hammer's box reads in this run; None where the scene asks for no sound.

    Args:
        world: of the run.
        scene: what is on the table.
        station: with a hammer, where the scene asks for sound.
        gap: of the world.
        seed: of the run.

    Raises:
        WrongUse: the scene asks for sound and the station has no hammer.
        CalibrationRefused: of the hammer's box.
        MeshRefused: the object cannot be filled with elements, so that a mocked one makes no sound.
    """
    if not scene.sensors.sound:
        return None
    hammer, flange_from_hammer = station.require_hammer()
    # Modes, room and microphone are imported by runs that are to be heard, and by no others.
    from mocks.daq.strike_counts import StrikeCounts
    from mocks.world.instrument import instrument_of
    from mocks.world.sound import WorldSound

    try:
        instrument = instrument_of(world, scene, GapDraw(gap, seed))
    except MeshRefused as refusal:
        raise MeshRefused(
            f"a mocked bench cannot make this object's sound: {refusal}; or press it only (--sense touch)"
        ) from refusal
    sound = WorldSound(world, instrument, gap, seed, flange_from_hammer, hammer.rate)
    return StrikeCounts(sound, hammer.acquisition, hears=station.own_microphone is None)
