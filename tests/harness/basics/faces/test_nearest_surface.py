"""The nearest place of a mesh to any point is the one that asking every face gives."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.faces.nearest_surface import NearestSurface, nearest_point
from harness.basics.mesh import Mesh
from harness.objects.builtin import build


@pytest.mark.parametrize("name", ["mug", "wrench"])
@pytest.mark.parametrize("spread", [0.3e-3, 0.05, 2.0])
def test_near_and_far_points_find_what_every_face_says(name: str, spread: float) -> None:
    mesh = build(name, 6e-3)
    random = np.random.default_rng(1)
    points = mesh.vertices[random.integers(len(mesh.vertices), size=40)] + spread * random.normal(
        size=(40, 3)
    )
    found = NearestSurface(mesh).distances(points)
    wanted = [float(np.linalg.norm(nearest_point(mesh, point) - point)) for point in points]
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_corner_is_on_the_surface_and_the_face_named_holds_the_place() -> None:
    mesh = build("bowl", 6e-3)
    search = NearestSurface(mesh)
    assert search.distances(mesh.vertices) == pytest.approx(0.0, abs=1e-15)
    points = mesh.vertices * 1.3
    places, faces = search.places(points)
    corners = mesh.corners[faces]
    normal_off = np.einsum("ni,ni->n", places - corners[:, 0], mesh.face_normals[faces])
    assert normal_off == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("corner", [np.nan, np.inf])
def test_a_mesh_that_is_no_surface_is_refused(corner: float) -> None:
    broken: FloatArray = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, corner, 0.0]])
    with pytest.raises(MeshRefused):
        NearestSurface(Mesh(broken, np.array([[0, 1, 2]]))).places(np.zeros((1, 3)))
