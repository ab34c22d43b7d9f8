"""An ObjectFile is the object of a scene: its folder brings surface, name and material."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, WrongUse
from harness.bench.scene import SceneFile, load_scene, scene_from_json, scene_from_options
from harness.effects.catalogue import scene_levels
from harness.effects.scene_object import known_file, known_object
from harness.objectfile.file import ObjectFile
from tests.samples.object_bench import egg_file, rewrite
from tests.samples.touch_bench import peg_file


@pytest.fixture(scope="module")
def egg(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only; it has a sound."""
    return egg_file(tmp_path_factory.mktemp("objects") / "an egg")


def written(folder: Path, lines: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(f"schema = 1\n[object]\n{lines}\n")
    return path


def by_file(of: ObjectFile, tmp_path: Path) -> SceneFile:
    shutil.copytree(of.folder, tmp_path / "egg")
    return load_scene(written(tmp_path, 'objectfile = "egg"'))


def test_file_and_option_mean_the_same_object(egg: ObjectFile, tmp_path: Path) -> None:
    named, asked = by_file(egg, tmp_path).object, scene_from_options(str(tmp_path / "egg")).object
    assert named == asked
    assert (named.name, named.material, named.builtin, named.is_objectfile) == ("egg", "ceramic", None, True)
    assert named.objectfile == str(tmp_path / "egg")


def test_its_surface_is_the_objects_to_the_bit(egg: ObjectFile) -> None:
    scene = scene_from_options(str(egg.folder))
    known = known_object(scene)
    np.testing.assert_array_equal(known.mesh.vertices, egg.mesh.vertices)
    np.testing.assert_array_equal(known.mesh.faces, egg.mesh.faces)
    of = known_file(scene, known.mesh)
    assert of is not None
    assert of.content_key == egg.content_key


def test_a_hidden_size_has_the_files_drawing(egg: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(egg.folder, tmp_path / "egg")
    scene = load_scene(written(tmp_path, 'objectfile = "egg"\nscale = "hidden"'))
    np.testing.assert_array_equal(known_object(scene).mesh.vertices, egg.mesh.vertices)


def test_a_scene_survives_a_recording(egg: ObjectFile) -> None:
    scene = scene_from_options(str(egg.folder))
    again = scene_from_json(json.loads(scene.model_dump_json(by_alias=True)), "run.json")
    assert again.object == scene.object


@pytest.mark.parametrize("line", ['material = "steel"', 'units = "mm"', 'wall = "2 mm"'])
def test_what_only_a_mesh_has_is_refused_beside_it(egg: ObjectFile, tmp_path: Path, line: str) -> None:
    shutil.copytree(egg.folder, tmp_path / "egg")
    with pytest.raises(WrongUse, match=r"'object\.\w+'.*ObjectFile .*egg"):
        load_scene(written(tmp_path, f'objectfile = "egg"\n{line}'))


def test_two_objectfiles_are_refused(egg: ObjectFile) -> None:
    with pytest.raises(WrongUse, match=r"--object .*--objectfile"):
        scene_from_options(str(egg.folder), objectfile=str(egg.folder))


def test_an_objectfile_of_another_size_than_the_scenes_is_refused(egg: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(egg.folder, tmp_path / "egg")
    scene = load_scene(written(tmp_path, 'objectfile = "egg"\nscale = 1.1'))
    with pytest.raises(WrongUse, match=r"x .*y .*z .* mm"):
        known_file(scene, known_object(scene).mesh)


def test_a_material_of_other_constants_is_refused(egg: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(egg.folder, tmp_path / "egg")

    def soften(tree: dict[str, Any]) -> None:
        tree["material"]["young_pa"] *= 0.5

    of = rewrite(tmp_path / "egg", soften)
    scene = scene_from_options(str(of.folder))
    with pytest.raises(WrongUse, match=r"young .*3\.6e\+10 Pa.*ceramic"):
        known_file(scene, known_object(scene).mesh)


@pytest.mark.parametrize(
    ("text", "said"),
    [("{", "name and material"), ('{"schema": 1}', "name and material")],
)
def test_a_damaged_description_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "object.json").write_text(text)
    with pytest.raises(DataRefused, match=said):
        scene_from_options(str(tmp_path))


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    with pytest.raises(WrongUse, match=r"none .*object\.json"):
        load_scene(written(tmp_path, 'objectfile = "none"'))


@pytest.mark.parametrize(
    ("make", "levels"),
    [(egg_file, {"sound.shapes": "network"}), (peg_file, {"touch.shapes": "network"})],
)
def test_its_networks_stand_for_the_simulation_that_the_scene_calls_for(
    make: Any, levels: dict[str, str], tmp_path: Path
) -> None:
    scene = scene_from_options(str(make(tmp_path / "object").folder))
    both = scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"sound": True})})
    neither = scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"touch": False})})
    assert scene_levels(both) == levels
    assert scene_levels(neither) == {}
    assert scene_levels(scene_from_options("builtin:mug")) == {}


def test_one_in_objects_is_found_by_its_name(
    egg: ObjectFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is at a path of that name comes first, and a mesh is still a mesh."""
    shutil.copytree(egg.folder, tmp_path / "objects" / "ovum")
    monkeypatch.chdir(tmp_path)
    assert scene_from_options("ovum").object.objectfile == str(tmp_path / "objects" / "ovum")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    named = load_scene(written(elsewhere, 'objectfile = "ovum"')).object
    assert named == scene_from_options("ovum").object
    shutil.copytree(egg.folder, elsewhere / "ovum")
    nearer = load_scene(written(elsewhere, 'objectfile = "ovum"')).object
    assert nearer.objectfile == str(elsewhere / "ovum")
    (tmp_path / "ovum").write_text("a mesh")
    with pytest.raises(WrongUse, match=r"ovum.*--material"):
        scene_from_options("ovum")


def test_a_name_that_is_none_is_answered_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"mugg.*'mug'"):
        load_scene(written(tmp_path, 'objectfile = "mugg"'))
