"""Cells of a surface: every point of it is in one, and what is no surface is refused."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network import PER_CELL
from harness.objects.household import build
from tests.oracles.seen_shapes import ball, cuboid, square


def bowl() -> Mesh:
    """Half a ball 0.3 m across, whose wall is 1 mm thick and open to both sides of it."""
    made = ball(0.15, 4)
    inner = Mesh(made.vertices * (0.149 / 0.15), made.faces[:, ::-1])
    both = Mesh(
        np.vstack([made.vertices, inner.vertices]), np.vstack([made.faces, inner.faces + len(made.vertices)])
    )
    keep = both.corners[:, :, 2].max(axis=1) <= 0.0
    return Mesh(both.vertices, both.faces[keep])


SHAPES: dict[str, Callable[[], Mesh]] = {
    "mug": lambda: build("mug", 8e-3),
    "wrench": lambda: build("wrench", 8e-3),
    "1 mm bowl": bowl,
    "sheet": lambda: square(0.2),
    "box": lambda: cuboid(0.1, 0.05, 0.2),
}


def drawn_on(mesh: Mesh, count: int, seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    faces = random.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    shares = random.dirichlet(np.ones(3), count)
    points: FloatArray = np.einsum("nc,ncx->nx", shares, mesh.corners[faces])
    return points


@pytest.mark.parametrize("name", SHAPES)
def test_every_place_of_a_surface_is_in_a_cell(name: str) -> None:
    mesh = SHAPES[name]()
    points = np.vstack([drawn_on(mesh, 20_000, 1), mesh.vertices[np.unique(mesh.faces)]])
    for cells in (1, 8, 16):
        assert (surface_cells(mesh, cells).networks(points) >= 0).all()


def test_cells_are_those_near_the_surface_and_no_others() -> None:
    """None farther from it than its own half diagonal, and so much farther behind it as it is deep."""
    mesh = ball(0.05, 4)
    grid = surface_cells(mesh, 16)
    height = np.linalg.norm(grid.low + grid.cell * (grid.cells + 0.5), axis=1) - 0.05
    half = 0.5 * np.sqrt(3.0) * grid.cell
    # Faces are chords: their middles lie a little inside.
    flat = 0.05 - float(np.linalg.norm(mesh.corners.mean(axis=1), axis=1).min())
    assert height.max() <= half + 1e-9
    assert height.min() >= -half - grid.cell / PER_CELL - flat - 1e-9


def test_a_mesh_of_another_object_is_refused() -> None:
    mug, wrench = SHAPES["mug"](), SHAPES["wrench"]()
    grid = surface_cells(mug)
    grid.require_surface(Mesh(mug.vertices.astype(np.float32).astype(np.float64), mug.faces))
    with pytest.raises(DataRefused, match=r"69%.*698.*55 mm"):
        grid.require_surface(wrench)


def test_surfaces_and_cells_that_are_none_are_refused() -> None:
    with pytest.raises(MeshRefused):
        surface_cells(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))
    with pytest.raises(MeshRefused):
        surface_cells(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])))
    with pytest.raises(MeshRefused):
        surface_cells(Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]])))
    for cells in (0, 129):
        with pytest.raises(WrongUse):
            surface_cells(SHAPES["box"](), cells)
