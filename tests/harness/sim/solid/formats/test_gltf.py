"""glTF and GLB: what the file requires and declares is followed or refused by its name."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import MeshRefused
from harness.sim.solid.formats.gltf import read_gltf
from harness.sim.solid.intake import take_in
from tests.support.made_meshes import (
    CORNERS,
    FACES,
    SIDES,
    VOLUME,
    add_accessor,
    box_tree,
    write_box_glb,
    write_glb,
)

FILES = Path(__file__).parents[4] / "samples" / "mesh_files"


def spans(path: Path) -> list[float]:
    """Sides of the bounding box after intake."""
    return list(np.ptp(take_in(path, None).mesh.bounds, axis=0))


def test_a_bottle_with_y_up_stands() -> None:
    taken = take_in(FILES / "bottle_y_up.glb", None)
    assert np.ptp(taken.mesh.bounds, axis=0) == pytest.approx([0.04, 0.04, 0.12], abs=1e-6)
    # A rotation, and no mirror image: the volume stays positive and the bottom is at z = 0.
    assert taken.report.volume is not None
    assert taken.report.volume > 0.0
    assert taken.mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-9)
    assert "y is up (declared" in taken.report.summary


def test_the_operator_s_axis_replaces_the_format_s_and_is_named() -> None:
    taken = take_in(FILES / "bottle_y_up.glb", None, up_axis="z")
    assert np.ptp(taken.mesh.bounds, axis=0) == pytest.approx([0.04, 0.12, 0.04], abs=1e-6)
    assert "z is up (requested" in taken.report.summary


def test_y_becomes_z_and_z_becomes_minus_y(tmp_path: Path) -> None:
    low, high = take_in(write_box_glb(tmp_path / "box.glb"), None).mesh.bounds
    assert low == pytest.approx([0.0, -SIDES[2], 0.0], abs=1e-7)
    assert high == pytest.approx([SIDES[0], 0.0, SIDES[1]], abs=1e-7)


def test_three_instances_are_three_boxes() -> None:
    report = take_in(FILES / "instanced.glb", None).report
    assert report.bodies == 3
    assert report.volume == pytest.approx(7.2e-5, abs=1e-9)


def test_instances_are_turned_and_scaled(tmp_path: Path) -> None:
    tree, data = box_tree()
    half = np.sqrt(0.5)
    data = add_accessor(tree, data, np.array([[0, 0, 0], [1, 0, 0]], "<f4"), "VEC3", 5126)
    data = add_accessor(tree, data, np.array([[0, 0, 0, 1], [0, 0, half, half]], "<f4"), "VEC4", 5126)
    data = add_accessor(tree, data, np.array([[1, 1, 1], [2, 1, 1]], "<f4"), "VEC3", 5126)
    named = {"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}
    tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": named}}
    parts = read_gltf(write_glb(tmp_path / "box.glb", tree, data)).parts
    # Scaled along x, then turned from x to y, then moved.
    low, high = parts[1].vertices.min(axis=0), parts[1].vertices.max(axis=0)
    assert low == pytest.approx([1.0 - 0.03, 0.0, 0.0], abs=1e-6)
    assert high == pytest.approx([1.0, 0.08, 0.02], abs=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        *("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu"),
        *("KHR_materials_transmission", "ACME_unheard_of", "KHR_animation_pointer"),
    ],
)
def test_a_required_extension_that_is_not_read_is_refused_by_its_name(tmp_path: Path, name: str) -> None:
    path = write_box_glb(tmp_path / "box.glb", extensionsUsed=[name], extensionsRequired=[name])
    with pytest.raises(MeshRefused, match=f"'{name}'"):
        take_in(path, None)


def test_the_compressed_half_is_refused_by_the_extension_s_name() -> None:
    with pytest.raises(MeshRefused, match="KHR_draco_mesh_compression"):
        take_in(FILES / "draco_half.glb", None)


def test_compressed_triangles_are_refused_where_the_file_only_uses_the_extension(tmp_path: Path) -> None:
    tree = json.loads((FILES / "draco_half.glb").read_bytes()[20:].split(b"BIN")[0].rsplit(b"}", 1)[0] + b"}")
    del tree["extensionsRequired"]
    with pytest.raises(MeshRefused, match="KHR_draco_mesh_compression"):
        read_gltf(write_glb(tmp_path / "half.glb", tree, bytes(280)))


def test_an_unknown_extension_that_is_only_used_is_noted(tmp_path: Path) -> None:
    path = write_box_glb(tmp_path / "box.glb", extensionsUsed=["ACME_shape"])
    assert any("ACME_shape" in warning for warning in take_in(path, None).report.warnings)


@pytest.mark.parametrize(("dtype", "component"), [("<u2", 5123), ("<i2", 5122), ("u1", 5121), ("i1", 5120)])
def test_quantised_positions_are_scaled_by_their_node(tmp_path: Path, dtype: str, component: int) -> None:
    tree, data = box_tree()
    peak = np.iinfo(np.dtype(dtype)).max
    whole = np.zeros((8, 4), dtype)
    whole[:, :3] = np.rint(CORNERS / 0.04 * peak)
    data = add_accessor(tree, data, whole, "VEC3", component, normalized=True)
    tree["bufferViews"][-1]["byteStride"] = whole.itemsize * 4
    tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 2
    tree["nodes"][0]["scale"] = [0.04, 0.04, 0.04]
    tree["extensionsRequired"] = tree["extensionsUsed"] = ["KHR_mesh_quantization"]
    spread = spans(write_glb(tmp_path / "box.glb", tree, data))
    assert spread == pytest.approx([0.04, 0.02, 0.03], abs=0.04 / peak)


def test_a_sparse_accessor_replaces_what_it_names(tmp_path: Path) -> None:
    tree, data = box_tree()
    far = CORNERS[4:].copy()
    far[:, 0] = 0.08
    data = add_accessor(tree, data, np.arange(4, 8, dtype="<u2"), "SCALAR", 5123)
    data = add_accessor(tree, data, far.astype("<f4"), "VEC3", 5126)
    views = len(tree["bufferViews"])
    tree["accessors"][0]["sparse"] = {
        "count": 4,
        "indices": {"bufferView": views - 2, "componentType": 5123},
        "values": {"bufferView": views - 1},
    }
    assert spans(write_glb(tmp_path / "box.glb", tree, data)) == pytest.approx([0.08, 0.02, 0.03], abs=1e-7)


def test_a_sparse_accessor_without_a_view_begins_with_zeros(tmp_path: Path) -> None:
    tree, data = box_tree()
    data = add_accessor(tree, data, np.arange(1, 8, dtype="u1"), "SCALAR", 5121)
    data = add_accessor(tree, data, CORNERS[1:].astype("<f4"), "VEC3", 5126)
    del tree["accessors"][0]["bufferView"]
    views = len(tree["bufferViews"])
    tree["accessors"][0]["sparse"] = {
        "count": 7,
        "indices": {"bufferView": views - 2, "componentType": 5121},
        "values": {"bufferView": views - 1},
    }
    report = take_in(write_glb(tmp_path / "box.glb", tree, data), None).report
    assert report.volume == pytest.approx(VOLUME, rel=1e-6)


def test_nodes_place_their_meshes(tmp_path: Path) -> None:
    nodes: list[dict[str, Any]] = [
        {"mesh": 0},
        {"mesh": 0, "translation": [0.1, 0, 0], "children": [2]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.1, 0, 0, 1]},
    ]
    path = write_box_glb(tmp_path / "box.glb", nodes=nodes, scenes=[{"nodes": [0, 1]}])
    parts = read_gltf(path).parts
    assert [part.vertices[:, 0].min() for part in parts] == pytest.approx([0.0, 0.1, 0.16], abs=1e-7)
    # A mirror image has its faces turned round, so that they still point outwards.
    a, b, c = (parts[2].vertices[parts[2].faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(VOLUME, rel=1e-5)


def test_only_the_default_scene_is_the_object(tmp_path: Path) -> None:
    tree, data = box_tree()
    tree["nodes"] = [{"mesh": 0}, {"mesh": 1}]
    tree["meshes"] = [tree["meshes"][0], tree["meshes"][0]]
    tree["scenes"], tree["scene"] = [{"nodes": [1]}, {"nodes": [0]}], 1
    report = take_in(write_glb(tmp_path / "box.glb", tree, data), None).report
    assert report.volume == pytest.approx(VOLUME, rel=1e-6)
    assert any("1 meshes" in warning for warning in report.warnings)


@pytest.mark.parametrize(("mode", "order"), [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])])
def test_strips_and_fans_turn_as_their_first_triangle_does(
    tmp_path: Path, mode: int, order: list[int]
) -> None:
    tree, data = box_tree()
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "<f4")[order]
    data = add_accessor(tree, data, square, "VEC3", 5126)
    tree["meshes"] = [{"primitives": [{"attributes": {"POSITION": 2}, "mode": mode}]}]
    part = read_gltf(write_glb(tmp_path / "square.glb", tree, data)).parts[0]
    a, b, c = (part.vertices[part.faces[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2] == pytest.approx([1.0, 1.0])


def test_morph_weights_of_the_file_are_applied(tmp_path: Path) -> None:
    tree, data = box_tree()
    shift = np.zeros((8, 3), "<f4")
    shift[4:, 0] = 0.08
    data = add_accessor(tree, data, shift, "VEC3", 5126)
    tree["meshes"][0] |= {"weights": [0.5]}
    tree["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 2}]
    assert spans(write_glb(tmp_path / "box.glb", tree, data)) == pytest.approx([0.08, 0.02, 0.03], abs=1e-7)


def test_a_gltf_reads_its_buffer_from_its_folder_or_from_a_data_uri(tmp_path: Path) -> None:
    tree, data = box_tree()
    (tmp_path / "own data.bin").write_bytes(data)
    for uri in ("own%20data.bin", "data:application/octet-stream;base64," + base64.b64encode(data).decode()):
        tree["buffers"][0]["uri"] = uri
        (tmp_path / "box.gltf").write_text(json.dumps(tree))
        assert spans(tmp_path / "box.gltf") == pytest.approx([0.04, 0.02, 0.03], abs=1e-7)


def test_faces_without_indices_are_read_in_order(tmp_path: Path) -> None:
    tree, data = box_tree()
    data = add_accessor(tree, data, CORNERS[FACES].reshape(-1, 3).astype("<f4"), "VEC3", 5126)
    tree["meshes"] = [{"primitives": [{"attributes": {"POSITION": 2}}]}]
    report = take_in(write_glb(tmp_path / "box.glb", tree, data), None).report
    assert report.volume == pytest.approx(VOLUME, rel=1e-6)
