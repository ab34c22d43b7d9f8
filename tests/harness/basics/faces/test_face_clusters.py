"""Clusters of faces: none is lost, and what a z-buffer draws does not depend on them."""

import dataclasses

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics import geometry
from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.faces.face_clusters import CLUSTER, cluster_faces, clusters_in_box
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, depth_image, height_maps


def _rough(seed: int, subdivisions: int = 3) -> Mesh:
    """A closed surface that folds over itself."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=12e-3)
    return Mesh(np.asarray(ball.vertices) + rng.normal(0, 1e-3, ball.vertices.shape), np.asarray(ball.faces))


def _pose(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return geometry.transform(
        geometry.rotation_from_quaternion(rng.normal(size=4)), np.array([*rng.normal(0, 3e-3, 2), 10e-3])
    )


def _turned_inside_out(mesh: Mesh) -> Mesh:
    # The first corner stays the first, so that not even rounding differs.
    return Mesh(mesh.vertices, mesh.faces[:, [0, 2, 1]])


@pytest.mark.parametrize("faces", [1, CLUSTER - 1, CLUSTER, CLUSTER**2, CLUSTER**2 + 1])
def test_every_face_is_in_one_cluster_with_its_corners(faces: int) -> None:
    whole = _rough(0)
    mesh = Mesh(whole.vertices, whole.faces[:faces])
    clusters = cluster_faces(mesh)
    there = clusters.faces >= 0
    assert np.array_equal(np.sort(clusters.faces[there]), np.arange(faces))
    kept = clusters.corners.swapaxes(1, 2)[there].reshape(-1, 3, 3)
    assert np.array_equal(kept, mesh.corners[clusters.faces[there]])
    assert np.isnan(clusters.corners.swapaxes(1, 2)[~there]).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_window_is_told_every_face_that_may_be_in_it(seed: int) -> None:
    mesh, pose = _rough(seed), _pose(seed)
    clusters = cluster_faces(mesh)
    rng = np.random.default_rng(seed)
    low = rng.normal(0, 4e-3, 3) - [0.0, 0.0, rng.choice([0.0, np.inf])]
    high = np.maximum(low, rng.normal(0, 4e-3, 3))
    found = np.empty(len(clusters.boxes), np.int64)
    count = clusters_in_box(pose, low, high, clusters.boxes, clusters.groups, found)
    told = clusters.faces[found[:count]]
    seen = geometry.apply(pose, mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)
    may_be = ((seen.max(axis=1) >= low) & (seen.min(axis=1) <= high)).all(axis=1)
    assert set(np.flatnonzero(may_be)) <= set(told.ravel())
    assert len(set(found[:count])) == count


def test_a_small_window_asks_few_of_a_large_mesh() -> None:
    clusters = cluster_faces(_rough(0, 6))
    found = np.empty(len(clusters.boxes), np.int64)
    middle = np.array([0.0, 0.0, 0.012])
    count = clusters_in_box(np.eye(4), middle - 1e-3, middle + 1e-3, clusters.boxes, clusters.groups, found)
    assert 0 < count < 0.05 * len(clusters.boxes)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_mesh_turned_inside_out_is_drawn_alike(seed: int) -> None:
    # What looks away is drawn last and only where it may be seen: of such a mesh that is all that is seen.
    mesh = _rough(seed)
    poses = np.stack([_pose(seed), geometry.translation(np.array([0.0, 0.0, 1e-3]))])
    assert np.array_equal(
        height_maps(RasterMesh(mesh), poses, GELSIGHT_R15),
        height_maps(RasterMesh(_turned_inside_out(mesh)), poses, GELSIGHT_R15),
    )


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_order_of_faces_changes_nothing(seed: int) -> None:
    mesh, pose = _rough(seed), _pose(seed)
    order = np.random.default_rng(seed).permutation(len(mesh.faces))
    shuffled = Mesh(mesh.vertices, mesh.faces[order])
    ours, theirs = (depth_image(RasterMesh(one), pose, 0.3e-3, 50, 70) for one in (mesh, shuffled))
    assert np.array_equal(ours.depth, theirs.depth)
    met = theirs.face >= 0
    assert np.array_equal(met, ours.face >= 0)
    # On an edge that two faces share, the one that comes first is named.
    same = order[theirs.face[met]] == ours.face[met]
    assert same.mean() > 0.99


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (3, 2), (1, 8), (2, 9), (7, 81)])
def test_a_small_picture_is_the_middle_of_a_large_one(rows: int, columns: int) -> None:
    raster, pose = RasterMesh(_rough(3)), _pose(3)[None]
    # The same parity, so that pixels fall on pixels.
    large = dataclasses.replace(GELSIGHT_R15, rows=90 + rows % 2, columns=120 + columns % 2)
    small = dataclasses.replace(GELSIGHT_R15, rows=rows, columns=columns)
    i, j = (large.rows - rows) // 2, (large.columns - columns) // 2
    cut = height_maps(raster, pose, large)[:, i : i + rows, j : j + columns]
    # Columns are counted from the picture's corner, which is another: rounding, of millimetres.
    assert height_maps(raster, pose, small) == pytest.approx(cut, abs=1e-12)


def test_what_nothing_is_in_front_of_is_drawn_from_behind() -> None:
    # An open bowl seen from below and from above: inside and outside are the same faces.
    whole = _rough(5)
    half = Mesh(whole.vertices, whole.faces[whole.corners[:, :, 2].min(axis=1) < 0.0])
    up, down = np.eye(4), np.diag([1.0, -1.0, -1.0, 1.0])
    seen = [np.isfinite(height_maps(RasterMesh(half), pose[None], GELSIGHT_R15)[0]) for pose in (up, down)]
    assert np.array_equal(seen[0], seen[1][::-1])
    assert seen[0].any()


def test_no_face_and_a_corner_that_is_no_number_are_refused() -> None:
    with pytest.raises(MeshRefused, match="0 faces"):
        cluster_faces(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)))
    with pytest.raises(MeshRefused, match="finite"):
        cluster_faces(Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]])))
