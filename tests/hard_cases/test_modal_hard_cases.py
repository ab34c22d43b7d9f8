"""Objects whose modes are easily got wrong: each right, or refused by name."""

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from manifold3d import Manifold
from scipy.linalg import subspace_angles

from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.geometry import rotation_about
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objects.solid import from_manifold
from harness.sim.modal.file import modes_of_file
from harness.sim.modal.solve import solve_mesh
from harness.sim.solid.tetrahedra import QuadraticMesh
from tests.oracles.exact_solids import exact_box
from tests.oracles.ritz_box import ritz_frequencies
from tests.oracles.volume_meshes import box

STEEL, GLASS = MATERIALS["steel"], MATERIALS["glass"]


@pytest.mark.parametrize(("thickness", "counts"), [(1e-3, (4, 8)), (0.5e-3, (8, 16))])
def test_a_thin_plate_falls_towards_its_frequency_with_one_layer(
    thickness: float, counts: tuple[int, int]
) -> None:
    """100 mm of glass, a quarter of it between two of its planes: edges of six thicknesses do for 1 %."""
    sides = (0.1, 0.1, thickness)
    expected = ritz_frequencies(sides, GLASS, 16, (-1, -1, -1))[0]
    errors = []
    for count in counts:
        quarter = exact_box((0.05, 0.05, thickness), (count, count, 1))
        planes = np.zeros(quarter.nodes.shape, dtype=np.bool_)
        planes[quarter.nodes[:, 0] == 0.0, 1:] = True
        planes[quarter.nodes[:, 1] == 0.0, 0] = True
        planes[quarter.nodes[:, 1] == 0.0, 2] = True
        found = solve_mesh(quarter, GLASS, 1.5 * expected, held=planes).modes
        errors.append(found.frequencies[0] / expected - 1.0)
    assert 0.0 < errors[1] < errors[0]
    assert errors[1] < 0.01


def test_frequency_follows_thickness_of_a_thin_plate() -> None:
    found = [
        solve_mesh(exact_box((0.1, 0.08, t), (8, 6, 1)), GLASS, np.inf, least=3).modes.frequencies[0]
        for t in (2e-3, 1e-3)
    ]
    assert found[0] / found[1] == pytest.approx(2.0, rel=0.02)


def test_rubber_of_ratio_049_is_right_and_a_half_is_refused() -> None:
    sides, soft = (0.05, 0.04, 0.03), replace(STEEL, young=1e7, poisson=0.49)
    found = solve_mesh(exact_box(sides, (5, 4, 3)), soft, np.inf, least=6).modes.frequencies[:6]
    excess = found / ritz_frequencies(sides, soft, 13)[:6] - 1.0
    assert excess.min() > -1e-6
    assert excess.max() < 0.012
    with pytest.raises(WrongUse, match="incompressible"):
        solve_mesh(exact_box(sides, (1, 1, 1)), replace(soft, poisson=0.5), 1e3)


def test_scale_and_stiffness_act_exactly_over_six_decades() -> None:
    """``f ~ sqrt(E / rho) / L``: no shift or threshold of the solver has a unit."""
    mesh = exact_box((0.05, 0.03, 0.02), (3, 2, 2))
    one = solve_mesh(mesh, STEEL, np.inf, least=8).modes.frequencies[:8]
    for scale in (1e-3, 1e3):
        grown = QuadraticMesh(mesh.nodes * scale, mesh.cells, mesh.faces)
        other = replace(STEEL, young=STEEL.young * 4e-4, density=STEEL.density * 4.0)
        found = solve_mesh(grown, other, np.inf, least=8).modes.frequencies[:8]
        assert found * scale * 100.0 == pytest.approx(one, rel=1e-9)


def test_pose_and_numbering_change_no_frequency_and_no_span_of_a_group() -> None:
    """A square bar's lowest bending comes twice: what the two span stays, whichever two they are."""
    mesh = exact_box((0.1, 0.02, 0.02), (6, 2, 2))
    turn = rotation_about(np.array([0.48, 0.6, 0.64]), 0.7)
    order = np.random.default_rng(5).permutation(len(mesh.nodes))
    place = np.argsort(order)
    shuffled = QuadraticMesh((mesh.nodes @ turn.T)[order], place[mesh.cells], place[mesh.faces])
    one, other = (solve_mesh(each, STEEL, 15e3).modes for each in (mesh, shuffled))
    assert other.frequencies == pytest.approx(one.frequencies, rel=1e-9)
    pair = np.flatnonzero(np.abs(one.frequencies / one.frequencies[0] - 1.0) < 0.02)
    assert len(pair) == 2
    there = other.at(one.points @ turn.T) @ turn
    spans = [shapes[:, pair].transpose(0, 2, 1).reshape(-1, 2) for shapes in (one.shapes, there)]
    assert subspace_angles(*spans).max() < 1e-5


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Mesh]:
    folder = tmp_path_factory.mktemp("block")
    solid = from_manifold(Manifold.cube([100.0, 20.0, 10.0], True))
    return folder, solid


def stored(folder: Path, name: str, vertices: object, faces: object) -> Path:
    meshio.write_points_cells(folder / name, np.asarray(vertices), [("triangle", np.asarray(faces))])
    return folder / name


def first_of(file: Path, units: str) -> float:
    found = modes_of_file(file, STEEL, units, count=5, edge=25e-3)
    assert found.solution.certified
    return float(found.solution.modes.frequencies[0])


def test_a_soup_in_millimetres_rings_as_the_whole_in_metres(block: tuple[Path, Mesh]) -> None:
    folder, solid = block
    whole = first_of(stored(folder, "m.vtu", solid.vertices * 1e-3, solid.faces), "m")
    soup = solid.vertices[solid.faces].reshape(-1, 3)
    loose = first_of(stored(folder, "soup.vtu", soup, np.arange(len(soup)).reshape(-1, 3)), "mm")
    assert loose == pytest.approx(whole, rel=0.01)


def test_a_surface_that_stays_open_asks_for_its_wall(block: tuple[Path, Mesh]) -> None:
    folder, solid = block
    lower = solid.faces[solid.vertices[solid.faces][:, :, 2].mean(axis=1) < 0.0]
    file = stored(folder, "bowl.vtu", solid.vertices, lower)
    with pytest.raises(MeshRefused, match="--wall"):
        modes_of_file(file, STEEL, "mm", count=3)


def test_two_blocks_in_a_file_are_two_bodies(block: tuple[Path, Mesh]) -> None:
    folder, solid = block
    both = np.concatenate([solid.vertices, solid.vertices + np.array([0.0, 0.0, 40.0])])
    faces = np.concatenate([solid.faces, solid.faces + len(solid.vertices)])
    found = modes_of_file(stored(folder, "two.vtu", both, faces), STEEL, "mm", count=4, edge=25e-3)
    assert found.bodies == 2
    assert found.solution.modes.rigid == 12
    assert any("pieces" in sentence for sentence in found.notes)


def test_a_layer_of_cubes_of_any_size_is_one_body() -> None:
    assert box((0.1, 0.1, 0.5e-3), (8, 8, 1)).bodies == 1
