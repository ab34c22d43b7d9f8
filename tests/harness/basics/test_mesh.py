"""A mesh owns its arrays, and its measures are those of the solid."""

import numpy as np
import pytest

from harness.basics.mesh import Mesh

CUBE = Mesh(
    np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]),
    np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ]
    ),
)  # fmt: skip


def test_area_normals_and_bounds_of_a_box() -> None:
    assert CUBE.face_areas.sum() == pytest.approx(10.0)
    assert np.abs(np.linalg.norm(CUBE.face_normals, axis=1) - 1.0).max() < 1e-15
    outward = np.einsum("ij,ij->i", CUBE.face_normals, CUBE.corners.mean(axis=1) - CUBE.bounds.mean(axis=0))
    assert (outward > 0).all()
    assert CUBE.diagonal == pytest.approx(6.0**0.5)


def test_bounds_ignore_vertices_no_face_uses() -> None:
    stray = Mesh(np.vstack([CUBE.vertices, [[99.0, 0.0, 0.0]]]), CUBE.faces)
    assert stray.bounds[1, 0] == 2.0


def test_a_face_without_area_has_no_normal_and_no_nan() -> None:
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert (flat.face_normals == 0).all()
    assert (flat.vertex_normals == 0).all()


def test_nobody_writes_to_a_mesh() -> None:
    source = CUBE.vertices.copy()
    mesh = Mesh(source, CUBE.faces)
    source[0] = 7.0
    assert mesh.vertices[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1.0
