"""Files of an answer read back as what was written, by a reader that is not ours."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.result import PALE_AT, colours_of, write_estimate
from harness.basics.errors import DataRefused
from harness.objects.builtin import build


@pytest.fixture(scope="module")
def estimate() -> ShapeEstimate:
    mesh = build("mug", 8e-3)
    count = len(mesh.vertices)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.linspace(0.0, 2.0 * PALE_AT, count),
        known_by=np.arange(count) % 3,
        not_bounded=(),
        doubtful={},
        flags=(),
        seconds=0.0,
        estimator="test",
    )


@pytest.fixture(scope="module")
def paths(estimate: ShapeEstimate, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_estimate(estimate, tmp_path_factory.mktemp("files"))


def test_the_ply_holds_surface_deviation_source_and_colour(
    estimate: ShapeEstimate, paths: dict[str, Path]
) -> None:
    read: Any = trimesh.load_mesh(paths["ply"], process=False)
    assert read.vertices == pytest.approx(estimate.mesh.vertices)
    assert np.array_equal(read.faces, estimate.mesh.faces)
    assert read.is_watertight
    held = read.metadata["_ply_raw"]["vertex"]["data"]
    assert held["deviation"].ravel() == pytest.approx(estimate.deviation, abs=1e-8)
    assert np.array_equal(held["known_by"].ravel(), estimate.known_by)
    assert np.array_equal(read.visual.vertex_colors[:, :3], colours_of(estimate.deviation))


def test_the_obj_holds_the_surface_and_its_colours(estimate: ShapeEstimate, paths: dict[str, Path]) -> None:
    read: Any = trimesh.load_mesh(paths["obj"], process=False)
    assert read.vertices == pytest.approx(estimate.mesh.vertices, abs=1e-9)
    assert np.array_equal(read.faces, estimate.mesh.faces)
    assert read.visual.vertex_colors[:, :3] == pytest.approx(colours_of(estimate.deviation), abs=1)


def test_the_glb_stands_upright_where_y_is_up(estimate: ShapeEstimate, paths: dict[str, Path]) -> None:
    scene = trimesh.load_scene(paths["glb"])
    read: Any = scene.to_geometry()
    low, high = estimate.mesh.bounds
    assert read.bounds[:, 1] == pytest.approx([low[2], high[2]], abs=1e-6)
    assert read.bounds[:, 0] == pytest.approx([low[0], high[0]], abs=1e-6)
    assert read.volume == pytest.approx(
        trimesh.Trimesh(estimate.mesh.vertices, estimate.mesh.faces).volume, rel=1e-5
    )
    assert len(np.unique(read.visual.vertex_colors, axis=0)) > 10


def test_the_points_lie_on_the_surface_and_take_their_vertices_numbers(
    estimate: ShapeEstimate, paths: dict[str, Path]
) -> None:
    with np.load(paths["npz"], allow_pickle=False) as read:
        points, deviation = read["points"], read["deviation"]
        assert np.linalg.norm(read["normals"], axis=1) == pytest.approx(1.0)
        assert set(np.unique(read["known_by"])) <= {0, 1, 2}
    low, high = estimate.mesh.bounds
    assert (points >= low - 1e-12).all()
    assert (points <= high + 1e-12).all()
    assert np.isin(deviation, estimate.deviation).all()


def test_the_same_answer_gives_the_same_bytes(
    estimate: ShapeEstimate, paths: dict[str, Path], tmp_path: Path
) -> None:
    again = write_estimate(estimate, tmp_path)
    for kind in ("ply", "obj", "glb"):
        assert again[kind].read_bytes() == paths[kind].read_bytes()
    assert not list(tmp_path.glob(".*"))


def test_colours_go_from_known_to_unknown_and_stop_there() -> None:
    colours = colours_of(np.array([0.0, 0.5 * PALE_AT, PALE_AT, 100.0])).astype(int)
    assert colours[0, 2] > colours[0, 0]
    assert np.array_equal(colours[2], colours[3])
    assert colours[3, 0] > colours[3, 2]


def test_what_is_not_whole_is_not_written(estimate: ShapeEstimate, tmp_path: Path) -> None:
    lost = estimate.deviation.copy()
    lost[3] = np.nan
    for bad in (replace(estimate, deviation=lost), replace(estimate, known_by=estimate.known_by[:5])):
        with pytest.raises(DataRefused, match=r"3546 faces .*1773 vertices.*1773 deviations"):
            write_estimate(bad, tmp_path)
    assert list(tmp_path.iterdir()) == []
