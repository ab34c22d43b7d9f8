"""A scene that hides how large its object is: the world draws it, and nothing else tells it."""

import json
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply
from harness.bench.device import CAMERA
from harness.bench.gap import load_gap
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import BARE, LOOK, RunContext
from harness.bench.station_file import Station
from harness.effects.scene_object import known_object
from mocks.in_process.bench import in_process_bench
from mocks.lab_scene import nominal_bench
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World

EXACT = load_gap("none")


def hidden(scene: SceneFile, **more: object) -> SceneFile:
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["object"] = {**tree["object"], "scale": "hidden", **more}
    tree["sensors"] = {**tree["sensors"], "camera": True}
    return scene_from_json(tree, "the scene")


def world_of(scene: SceneFile, station: Station, seed: int, gap: str = "none") -> World:
    draw = GapDraw(load_gap(gap), seed)
    stands = scene.base_from_object(known_object(scene).mesh)
    return World(nominal_bench(scene, station, None, stands, draw), load_gap(gap), seed)


def longest(mesh_bounds: FloatArray) -> float:
    return float(np.ptp(mesh_bounds, axis=0).max())


def test_it_is_as_large_as_the_truth_says_and_stands_where_the_scene_does(
    scene: SceneFile, station: Station
) -> None:
    asked = hidden(scene, sizes=["0.1 m", "0.3 m"])
    for seed in range(4):
        world = world_of(asked, station, seed)
        size = world.differences()["longest_side_m"]
        assert 0.1 <= size <= 0.3
        assert longest(world.mesh.bounds) == pytest.approx(size, rel=1e-9)
        bottom = apply(world.base_from_object, world.mesh.vertices)[:, 2].min()
        assert bottom == pytest.approx(asked.object.pose.position[2], abs=1e-6)


def test_sizes_are_even_in_their_logarithm(scene: SceneFile) -> None:
    drawn = np.log([GapDraw(EXACT, seed).hidden_size(0.1, 0.4) for seed in range(400)])
    shares = np.histogram(drawn, 4, (np.log(0.1), np.log(0.4)))[0]
    assert shares.sum() == 400
    assert shares.min() > 70


def test_the_drawing_stays_what_everybody_else_knows(scene: SceneFile) -> None:
    assert np.array_equal(known_object(hidden(scene)).mesh.vertices, known_object(scene).mesh.vertices)


def test_a_stated_size_is_not_drawn(scene: SceneFile, station: Station) -> None:
    assert "longest_side_m" not in world_of(scene, station, 0).differences()


def test_nothing_but_the_truth_tells_the_size(scene: SceneFile, station: Station, tmp_path: Path) -> None:
    asked = hidden(scene, sizes=["0.1 m", "0.3 m"])
    assert "longest_side_m" not in json.dumps(asked.model_dump(mode="json"))
    truth = tmp_path / "truth.json"
    bench = in_process_bench(asked, station, RunContext(truth, known_object(asked).mesh, 3, "none"))
    bench.mark(0, LOOK)
    assert json.loads(truth.read_text())["contacts"] == []  # a look is no contact


def test_sizes_without_a_hidden_one_are_refused(scene: SceneFile) -> None:
    tree = scene.model_dump(mode="json", by_alias=True)
    for change in ({"sizes": ["0.1 m", "0.3 m"]}, {"scale": "hiden"}, {"scale": -1.0}):
        with pytest.raises(WrongUse, match=r"scale|sizes"):
            scene_from_json({**tree, "object": {**tree["object"], **change}}, "the scene")
    with pytest.raises(WrongUse, match="sizes"):
        hidden(scene, sizes=["0.3 m", "0.1 m"])


def test_the_camera_sees_the_bench_with_and_without_the_object(
    scene: SceneFile, station: Station, tmp_path: Path
) -> None:
    asked = hidden(scene, sizes=["0.1 m", "0.3 m"])
    bench = in_process_bench(
        asked, station, RunContext(tmp_path / "t.json", known_object(asked).mesh, 3, "none")
    )
    pictures = []
    for sample in (BARE, LOOK):
        bench.mark(0, sample)
        pictures.append(bench.get(CAMERA).read(1, 1.0).values[0].astype(int))
    apart = np.abs(pictures[0] - pictures[1]).max(axis=2) > 20
    assert 500 < apart.sum() < 0.3 * apart.size


def test_a_camera_s_errors_are_of_the_run_and_its_noise_of_the_picture(
    scene: SceneFile, station: Station
) -> None:
    asked = hidden(scene)
    pose = np.eye(4)
    gapped, exact = world_of(asked, station, 1, "default"), world_of(asked, station, 1)
    assert np.array_equal(exact.scene_image(pose, 0, LOOK), exact.scene_image(pose, 1, LOOK))
    one, two = (gapped.scene_image(pose, step, LOOK).astype(float) for step in (0, 1))
    assert np.array_equal(one, gapped.scene_image(pose, 0, LOOK))
    assert 0.5 < (one - two).std() < 2.0 * np.sqrt(2.0) * 1.2
    drawn = GapDraw(load_gap("default"), 1).camera(np.eye(4), 600.0)
    again = GapDraw(load_gap("default"), 1).camera(np.eye(4), 600.0)
    assert np.array_equal(drawn[0], again[0])
    assert drawn[1] != 600.0
