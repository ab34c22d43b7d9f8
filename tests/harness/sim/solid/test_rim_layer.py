"""Cells cut along the rims of thin walls: the same body, softer, and nearer to Ritz for what it costs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS
from harness.sim.modal.element_edge import rim_faces, with_rim_layer
from harness.sim.modal.solve import solve_mesh
from harness.sim.solid.tetrahedra import Tetrahedra, quadratic_mesh, tetrahedra
from tests.oracles.exact_solids import exact_box
from tests.oracles.mapped_cup import cup
from tests.oracles.ritz_box import ritz_frequencies
from tests.oracles.volume_meshes import box

STEEL = MATERIALS["steel"]
SIDES = (0.05, 0.04, 0.003)
WALL = SIDES[2]
COARSE = (16, 13, 2)


def frequencies(of: Tetrahedra, count: int) -> tuple[FloatArray, int]:
    solved = solve_mesh(quadratic_mesh(of.nodes, of.cells), STEEL, np.inf, least=count)
    return solved.modes.frequencies[:count], solved.unknowns


def test_cells_stay_one_closed_body_of_the_same_volume_and_surface() -> None:
    plate = box(SIDES, COARSE)
    cut = with_rim_layer(plate, WALL)
    assert len(cut.cells) > len(plate.cells)
    assert cut.volumes.min() > 0.0
    assert cut.volumes.sum() == pytest.approx(float(np.prod(SIDES)), rel=1e-12)
    assert cut.surface.face_areas.sum() == pytest.approx(plate.surface.face_areas.sum(), rel=1e-12)
    assert cut.bodies == 1
    assert (cut.nodes[: len(plate.nodes)] == plate.nodes).all(), "corners that were there stay"


def test_what_is_added_lies_a_quarter_of_the_wall_inside_of_a_narrow_side() -> None:
    plate = box(SIDES, COARSE)
    added = with_rim_layer(plate, WALL).nodes[len(plate.nodes) :]
    away = np.minimum(added, np.array(SIDES) - added)[:, :2].min(axis=1)
    assert np.median(away) == pytest.approx(0.25 * WALL, rel=1e-9)
    # In a corner the nearer side changes along an edge.
    assert away.min() > 0.2499 * WALL
    assert away.max() < 0.26 * WALL


@pytest.mark.slow  # a comparison of two meshes, not a limit
def test_every_mode_falls_and_further_than_with_even_cells_of_as_many_unknowns() -> None:
    plate = box(SIDES, COARSE)
    exact = ritz_frequencies(SIDES, STEEL, 18)[:5]
    before, _ = frequencies(plate, 5)
    cut, unknowns = frequencies(with_rim_layer(plate, WALL), 5)
    even, as_many = frequencies(box(SIDES, (22, 18, 2)), 5)
    assert as_many > unknowns
    assert (cut < before).all()
    assert (cut > exact * (1.0 - 1e-5)).all(), "Ritz is itself from above, by less"
    assert cut[0] / exact[0] - 1.0 < 0.7 * (even[0] / exact[0] - 1.0), "the first twists"
    assert np.abs(cut / exact - 1.0).max() < 0.5 * np.abs(before / exact - 1.0).max()


def test_rims_belong_to_the_plate_wherever_it_lies_and_whatever_its_unit() -> None:
    plate = box(SIDES, COARSE)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    moved = tetrahedra(1e3 * (plate.nodes @ turn.T + [0.3, -2.0, 0.1]), plate.cells)
    assert rim_faces(moved.surface, 1e3 * WALL).tolist() == rim_faces(plate.surface, WALL).tolist()
    assert len(with_rim_layer(moved, 1e3 * WALL).cells) == len(with_rim_layer(plate, WALL).cells)


def test_rims_of_a_plate_are_its_narrow_sides() -> None:
    surface = box(SIDES, COARSE).surface
    rims = np.zeros(len(surface.faces), dtype=np.bool_)
    rims[rim_faces(surface, WALL)] = True
    assert (rims == (np.abs(surface.face_normals[:, 2]) < 0.5)).all()


def test_the_mouth_of_a_cup_is_its_only_rim() -> None:
    mapped = cup(16)
    used, cells = np.unique(mapped.cells[:, :4], return_inverse=True)
    of = tetrahedra(mapped.nodes[used], cells.reshape(-1, 4))
    surface = of.surface
    rims = surface.corners[rim_faces(surface, 0.004)]
    assert len(rims)
    assert rims[..., 2] == pytest.approx(surface.vertices[:, 2].max(), rel=1e-6)


def test_a_compact_body_has_no_rims_and_stays_as_it_is() -> None:
    mesh = exact_box((0.06, 0.05, 0.04), (3, 3, 2))
    cube = tetrahedra(mesh.nodes[: mesh.cells[:, :4].max() + 1], mesh.cells[:, :4])
    assert with_rim_layer(cube, 0.04) is cube
