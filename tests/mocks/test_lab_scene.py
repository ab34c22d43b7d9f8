"""What a lab is told: strictly read, and turned into a bench with a tessellation of its own."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.gap import load_gap
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.objects.household import build
from mocks.lab_scene import nominal_bench, read_lab_scene
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World

DRAW = GapDraw(load_gap("none"), 0)


def told(scene: SceneFile, station: Station, mesh: Path | None) -> dict[str, Any]:
    return {
        "schema": 1,
        "scene": scene.model_dump(mode="json"),
        "station": station.model_dump(mode="json"),
        "mesh": None if mesh is None else str(mesh),
        "base_from_object": np.eye(4).tolist(),
    }


def of_file(scene: SceneFile, path: Path) -> SceneFile:
    named = scene.object.model_copy(update={"mesh": str(path)})
    return scene.model_copy(update={"object": named})


def test_a_built_in_object_shares_no_vertex_with_anyone(scene: SceneFile, station: Station) -> None:
    bench = nominal_bench(scene, station, None, np.eye(4), DRAW)
    theirs = build("mug").vertices
    gaps = np.linalg.norm(bench.mesh.vertices[::50, None] - theirs[None], axis=2).min(axis=1)
    assert np.median(gaps) > 1e-5
    assert bench.camera is None  # the scene asks for none, though the station has one


def test_a_file_is_cut_up_and_keeps_its_surface(tmp_path: Path, scene: SceneFile, station: Station) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    np.savez(tmp_path / "mesh.npz", vertices=ball.vertices, faces=ball.faces)
    file = tmp_path / "scene.json"
    ball_scene = of_file(scene, tmp_path / "ball.stl")
    file.write_text(json.dumps(told(ball_scene, station, tmp_path / "mesh.npz")))
    read = read_lab_scene(file, DRAW)
    bench, model = read.bench, read.station.arm.model
    assert model == "ur5e"
    assert np.array_equal(bench.mesh.vertices, ball.vertices)
    world = World(bench, load_gap("none"), 0)
    assert len(world.mesh.faces) > len(ball.faces)
    assert world.mesh.face_areas.sum() == pytest.approx(bench.mesh.face_areas.sum(), rel=1e-9)


@pytest.mark.parametrize("change", [{"schema": 2}, {"extra": 1}, {"mesh": "/nowhere/mesh.npz"}], ids=str)
def test_anything_else_is_refused(
    tmp_path: Path, scene: SceneFile, station: Station, change: dict[str, Any]
) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps({**told(scene, station, None), **change}))
    with pytest.raises(WrongUse):
        read_lab_scene(file, DRAW)
    with pytest.raises(WrongUse, match=r"absent\.json"):
        read_lab_scene(tmp_path / "absent.json", DRAW)


def test_a_file_without_its_mesh_is_refused(scene: SceneFile, station: Station) -> None:
    with pytest.raises(WrongUse, match="teapot"):
        nominal_bench(of_file(scene, Path("/x/teapot.stl")), station, None, np.eye(4), DRAW)


def test_a_scaled_built_in_object_is_scaled(scene: SceneFile, station: Station) -> None:
    larger = scene.model_copy(update={"object": scene.object.model_copy(update={"scale": 1.25})})
    sizes = [nominal_bench(s, station, None, np.eye(4), DRAW).mesh.diagonal for s in (scene, larger)]
    assert sizes[1] == pytest.approx(1.25 * sizes[0])


def test_what_is_not_drawn_is_not_pretended(scene: SceneFile, station: Station) -> None:
    gel = station.gel.model_copy(update={"casts_shadow": True})
    bench = nominal_bench(scene, station.model_copy(update={"gel": gel}), None, np.eye(4), DRAW)
    with pytest.raises(NotImplementedError, match="shadows"):
        World(bench, load_gap("none"), 0)


def test_a_mesh_that_is_given_is_used(scene: SceneFile, station: Station) -> None:
    corner = Mesh(np.eye(4, 3) * 0.02, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    assert nominal_bench(scene, station, corner, np.eye(4), DRAW).mesh is corner
