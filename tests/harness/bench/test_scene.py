"""Scenes: files and options mean the same, meshes stand where the pose says."""

import json
from pathlib import Path

import numpy as np
import pytest

from experiments.contact_localization.section import Localization
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, rotation_about
from harness.basics.mesh import Mesh
from harness.bench.named_files import SHIPPED
from harness.bench.scene import load_scene, scene_from_json, scene_from_options
from harness.objects.builtin import MATERIALS

SCENES = sorted((SHIPPED / "scenes").glob("*.toml"))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    corners = np.array(
        [
            [(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]]
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        ]
    )
    return Mesh(corners, np.arange(8)[np.array([[0, 1, 2], [3, 4, 5], [5, 6, 7]])])


def scene_file(folder: Path, pose: str = "", mesh: str = "builtin:mug", more: str = "") -> Path:
    path = folder / "scene.toml"
    path.write_text(
        f'schema = 1\n{more}\n[object]\nmesh = "{mesh}"\nmaterial = "glass"\n{pose}', encoding="utf-8"
    )
    return path


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_an_example_scene_reads_and_survives_json(path: Path) -> None:
    scene = load_scene(path)
    assert scene_from_json(json.loads(scene.model_dump_json()), "recording") == scene
    assert scene.object.builtin in MATERIALS


def test_there_is_an_example_for_every_built_in_object() -> None:
    assert {load_scene(path).object.builtin for path in SCENES} == set(MATERIALS)


def test_a_scene_needs_only_an_object(tmp_path: Path) -> None:
    scene = load_scene(scene_file(tmp_path))
    assert scene == scene_from_options("builtin:mug", "glass")
    assert scene.sensors.touch
    assert not scene.sensors.sound
    assert scene.room is None
    assert scene.section(Localization).depth == (0.5e-3, 2e-3)


def test_a_built_in_object_brings_its_material() -> None:
    assert scene_from_options("builtin:wrench").object.material == "steel"


def test_a_mesh_path_is_relative_to_the_scene_and_absolute_once_read(tmp_path: Path) -> None:
    (tmp_path / "cup.stl").write_bytes(b"solid")
    scene = load_scene(scene_file(tmp_path, mesh="cup.stl"))
    assert scene.object.mesh == str((tmp_path / "cup.stl").resolve())
    assert scene.object.name == "cup"


def test_an_objectfile_is_found_beside_the_scene_and_must_be_one(tmp_path: Path) -> None:
    named = scene_file(tmp_path, pose='objectfile = "own/mug"')
    (tmp_path / "own" / "mug").mkdir(parents=True)
    with pytest.raises(WrongUse, match=r"'object\.objectfile': .*own/mug"):
        load_scene(named)
    (tmp_path / "own" / "mug" / "object.json").write_text("{}")
    scene = load_scene(named)
    assert scene.object.objectfile == str((tmp_path / "own" / "mug").resolve())
    assert scene_from_json(json.loads(scene.model_dump_json()), "recording") == scene
    with pytest.raises(WrongUse, match=r"'object\.object_file'.*'objectfile'"):
        load_scene(scene_file(tmp_path, pose='object_file = "own/mug"'))


def test_options_carry_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cup.stl").write_bytes(b"solid")
    scene = scene_from_options("cup.stl", "steel", "mm", "2mm")
    assert scene.object.wall == 2e-3
    assert scene.object.units == "mm"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("no_such.stl", "steel"), "no_such.stl"),
        (("no_such.stl",), "--material"),
        (("builtin:mag",), "'mag'.*'mug'"),
        (("builtin:mug", "steal"), "'steal'.*'steel'"),
        (("builtin:mug", "steel", "feet"), "'object.units' = 'feet'"),
        (("builtin:mug", "steel", "mm", "2"), "'2'"),
        (("builtin:mug", "steel", "mm", "2 kg"), "'2 kg'"),
    ],
)
def test_an_option_that_cannot_be_is_refused(arguments: tuple[str, ...], said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        scene_from_options(*arguments)


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_the_object_stands_upright_with_its_bottom_where_the_pose_says(tmp_path: Path, up: str) -> None:
    pose = f'[object.pose]\nposition = ["-0.4 m", "0.1 m", "0.3 m"]\nyaw = "35 deg"\nup = "{up}"\n'
    scene = load_scene(scene_file(tmp_path, pose))
    mesh = box((-0.01, 0.02, 0.05), (0.05, 0.04, 0.2))
    base_from_object = scene.base_from_object(mesh)
    corners = apply(base_from_object, mesh.vertices)
    assert corners[:, 2].min() == pytest.approx(0.3)
    unturned = (corners - [-0.4, 0.1, 0.3]) @ rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(35))
    middle = (unturned.min(axis=0) + unturned.max(axis=0)) / 2
    assert middle[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    axis = {"x": 0, "y": 1, "z": 2}[up[-1]]
    sign = -1.0 if up.startswith("-") else 1.0
    assert base_from_object[:3, :3] @ (sign * np.eye(3)[axis]) == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.linalg.det(base_from_object[:3, :3]) == pytest.approx(1.0)


def test_with_the_origin_as_anchor_the_pose_is_of_the_mesh_s_own_frame(tmp_path: Path) -> None:
    pose = '[object.pose]\nposition = ["-0.4 m", "0.1 m", "0.3 m"]\nanchor = "origin"\n'
    scene = load_scene(scene_file(tmp_path, pose))
    placed = scene.base_from_object(box((-0.01, 0.02, 0.05), (0.05, 0.04, 0.2)))
    assert placed[:3, 3] == pytest.approx([-0.4, 0.1, 0.3])
