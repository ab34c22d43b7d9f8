"""A run that is to be heard carries the sound of its object's ObjectFile, and no other's."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import RecordingDamaged, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.audio.part import with_audio
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, create_run, station_calibration
from tests.samples.object_bench import egg_part

STATION = load_station(station_path("mock"))
MUG = known_object(scene_from_options("builtin:mug")).mesh


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """A mug that sounds like no mug."""
    folder = tmp_path_factory.mktemp("objects") / "mug"
    made = create_object(folder, "mug", MUG, MATERIALS["ceramic"], Provenance(licence="CC0-1.0"))
    return with_audio(made, egg_part(MUG))


def scene_of(of: ObjectFile | None, sound: bool = True) -> SceneFile:
    scene = scene_from_options("builtin:mug", objectfile=None if of is None else str(of.folder))
    return scene.model_copy(update={"sensors": Sensors(sound=sound)})


def run_of(scene: SceneFile, folder: Path, mesh: Mesh = MUG) -> RunFiles:
    calibration = station_calibration(STATION)
    plan: dict[str, Any] = {"contacts": []}
    create_run(folder, "contact-localization", scene, STATION, mesh, calibration, plan, 0, None)
    return RunFiles(Recording(folder))


def test_it_is_read_from_the_run_alone(of: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(of.folder, tmp_path / "mug")
    run = run_of(scene_of(ObjectFile.open(tmp_path / "mug")), tmp_path / "run")
    shutil.rmtree(tmp_path / "mug")
    assert run.objectfile.content_key == of.content_key
    points = MUG.vertices[::50]
    for level in ("network", "table"):
        theirs, ours = open_audio(run.objectfile, level), open_audio(of, level)
        np.testing.assert_array_equal(theirs.at(points), ours.at(points))


def test_a_change_in_the_run_is_noticed(of: ObjectFile, tmp_path: Path) -> None:
    run = run_of(scene_of(of), tmp_path / "run")
    path = tmp_path / "run" / "objectfile" / "object.json"
    path.write_text(path.read_text().replace('"name": "mug"', '"name": "cup"'))
    with pytest.raises(RecordingDamaged, match=r"objectfile/object\.json"):
        _ = run.objectfile


def test_nothing_is_carried_that_is_not_called_for(of: ObjectFile, tmp_path: Path) -> None:
    run = run_of(scene_of(None), tmp_path / "unnamed")
    assert not (tmp_path / "unnamed" / "objectfile").exists()
    with pytest.raises(WrongUse, match=r"unnamed .*ObjectFile.*sound\.shapes = elements"):
        _ = run.objectfile
    touched = run_of(scene_of(of, sound=False), tmp_path / "touched")
    files = {path.name for path in touched.objectfile.folder.iterdir()}
    assert files == {"object.json", "mesh.ply"}
    assert touched.network_levels == {}
    assert run_of(scene_of(of), tmp_path / "heard").network_levels == {"sound.shapes": "network"}


def test_a_run_of_another_object_is_not_begun(of: ObjectFile, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"x .*y .*z .* mm"):
        run_of(scene_of(of), tmp_path / "run", Mesh(1.1 * MUG.vertices, MUG.faces))
    assert not (tmp_path / "run").exists()
