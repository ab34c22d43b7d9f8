"""The true object's vibration: its wall and its material differ as they are told, and no more."""

import numpy as np
import pytest

from harness.basics.errors import MeshRefused
from harness.basics.materials import MATERIALS
from harness.sim.modal.modal import solve_modes
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra
from mocks.world.instrument import perturbed, smooth_field, uneven
from tests.oracles.volume_meshes import box

CERAMIC = MATERIALS["ceramic"]


@pytest.fixture(scope="module")
def plate() -> Tetrahedra:
    """100 x 80 x 4 mm, two elements through: nodes within, which must follow the surface."""
    return box((0.1, 0.08, 0.004), (12, 10, 2))


@pytest.mark.parametrize("change", [-0.05, 0.06])
def test_the_wall_changes_by_what_it_is_told(plate: Tetrahedra, change: float) -> None:
    made = perturbed(plate, change)
    inside = (np.abs(plate.nodes[:, :2] - [0.05, 0.04]) < 0.02).all(axis=1)
    levels = np.round(plate.nodes[inside, 2] / 0.002).astype(int)
    heights = [float(np.mean(made.nodes[inside, 2][levels == level])) for level in (0, 1, 2)]
    assert heights[2] - heights[0] == pytest.approx(0.004 * (1.0 + change), rel=1e-3)
    assert heights[1] == pytest.approx(0.002, abs=1e-6)
    assert (made.volumes > 0.0).all()
    assert (made.cells == plate.cells).all()


def test_a_thicker_plate_rings_higher_in_proportion(plate: Tetrahedra) -> None:
    """Bending frequencies of a thin plate go with its thickness."""
    thin = solve_modes(plate, CERAMIC, 9e3).frequencies[:3]
    thick = solve_modes(perturbed(plate, 0.06), CERAMIC, 9.5e3).frequencies[:3]
    assert thick / thin == pytest.approx(1.06, rel=0.015)


def test_no_change_is_none(plate: Tetrahedra) -> None:
    assert perturbed(plate, 0.0).nodes == pytest.approx(plate.nodes, abs=1e-15)
    with pytest.raises(MeshRefused, match="-60%"):
        perturbed(plate, -0.6)


@pytest.mark.parametrize("cell", [0, 5, 600])
@pytest.mark.parametrize("change", [-0.08, 0.08])
def test_a_sliver_is_carried_along_and_neither_flattened_nor_turned_inside_out(
    plate: Tetrahedra, cell: int, change: float
) -> None:
    nodes, corners = plate.nodes.copy(), plate.cells[cell]
    a, b, c, top = nodes[corners]
    out = np.cross(b - a, c - a)
    out /= np.linalg.norm(out)
    nodes[corners[3]] -= (1.0 - 1e-4) * ((top - a) @ out) * out
    sliver = tetrahedra(nodes, plate.cells)
    made = perturbed(sliver, change)
    assert (made.cells == sliver.cells).all()
    assert (made.volumes > 0.1 * sliver.volumes).all()
    ways, elsewhere = made.nodes - sliver.nodes, perturbed(plate, change).nodes - plate.nodes
    assert np.count_nonzero(np.abs(ways - elsewhere).max(axis=1) > 0.02e-3) <= 8


def test_nodes_of_the_middles_follow_the_deformation(plate: Tetrahedra) -> None:
    """Deformed cells solved from their undeformed surface are the deformed cells themselves."""
    made = perturbed(plate, 0.04)
    direct = solve_modes(made, CERAMIC, 9e3)
    followed = solve_modes(made, CERAMIC, 9e3, surface=plate.surface, undeformed=plate)
    assert followed.frequencies == pytest.approx(direct.frequencies, rel=1e-9)


def test_fields_are_as_strong_and_as_smooth_as_told() -> None:
    random = np.random.default_rng(5)
    points = np.random.default_rng(1).uniform(0.0, 0.2, (400, 3))
    near = points + np.array([1e-3, 0.0, 0.0])
    far = points + np.array([0.1, 0.0, 0.0])
    draws = np.array(
        [smooth_field(np.concatenate([points, near, far]), 0.04, 0.03, random) for _ in range(200)]
    )
    here, close, away = draws[:, :400], draws[:, 400:800], draws[:, 800:]
    assert here.std() == pytest.approx(0.04, rel=0.05)
    assert abs(here.mean()) < 0.002
    assert np.corrcoef(here.ravel(), close.ravel())[0, 1] > 0.99
    assert abs(np.corrcoef(here.ravel(), away.ravel())[0, 1]) < 0.05


def test_an_uneven_material_keeps_its_mean_and_shifts_modes_a_little(plate: Tetrahedra) -> None:
    made = uneven(plate, CERAMIC, 0.04, 0.03, np.random.default_rng(2), poisson_change=0.02)
    assert made.young.mean() == pytest.approx(CERAMIC.young, rel=0.05)
    assert made.young.std() / CERAMIC.young == pytest.approx(0.04, rel=0.6)
    assert abs(np.corrcoef(made.young, made.density)[0, 1]) < 0.9
    assert (made.poisson == CERAMIC.poisson + 0.02).all()
    even = solve_modes(plate, CERAMIC, 9e3).frequencies[:4]
    other = solve_modes(plate, made, 9.5e3).frequencies[:4]
    assert 1e-4 < np.abs(other / even - 1.0).max() < 0.06
    again = uneven(plate, CERAMIC, 0.04, 0.03, np.random.default_rng(2), poisson_change=0.02)
    assert (again.young == made.young).all()
