"""Modes of cubes: rigid motions cost nothing, energies are exact, finer cubes come nearer to elements."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.paper.hexahedra import cube_matrices, hexahedral_modes, voxel_cubes
from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import MATERIALS, Material
from harness.basics.mesh import Mesh

SIDE = 2e-3
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * SIDE


def steel() -> Material:
    return MATERIALS["steel"]


def box(extents: tuple[float, float, float]) -> Mesh:
    solid = trimesh.creation.box(extents)
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces))


def moved(gradient: FloatArray) -> FloatArray:
    """``(24,)``: the corners' motion of a displacement that is linear in the place."""
    return np.asarray(CORNERS @ gradient.T).ravel()


def test_moving_and_turning_a_cube_takes_no_force() -> None:
    stiffness, _ = cube_matrices(steel(), SIDE)
    scale = np.abs(stiffness).max()
    turn = np.array([[0.0, -1.0, 0.3], [1.0, 0.0, -0.5], [-0.3, 0.5, 0.0]])
    for motion in (np.tile([1.0, 2.0, 3.0], 8), moved(turn)):
        assert np.abs(stiffness @ motion).max() < 1e-12 * scale * np.abs(motion).max()


@pytest.mark.parametrize("axes", [(0, 0), (1, 1), (0, 1), (1, 2)])
def test_a_cube_that_is_strained_evenly_holds_its_exact_energy(axes: tuple[int, int]) -> None:
    made_of, strain = steel(), 1e-4
    gradient = np.zeros((3, 3))
    gradient[axes] = strain
    motion = moved(gradient)
    stiffness, _ = cube_matrices(made_of, SIDE)
    shear = 0.5 * made_of.young / (1.0 + made_of.poisson)
    stretch = made_of.young * (1.0 - made_of.poisson)
    stretch /= (1.0 + made_of.poisson) * (1.0 - 2.0 * made_of.poisson)
    modulus = stretch if axes[0] == axes[1] else shear
    assert motion @ stiffness @ motion == pytest.approx(modulus * strain**2 * SIDE**3, rel=1e-10)


def test_the_mass_of_a_cube_is_its_volume_times_its_density() -> None:
    _, mass = cube_matrices(steel(), SIDE)
    up = np.tile([0.0, 0.0, 1.0], 8)
    assert up @ mass @ up == pytest.approx(steel().density * SIDE**3, rel=1e-12)


def test_finer_cubes_bend_a_bar_ever_nearer_to_the_exact_frequency() -> None:
    length, thick = 0.12, 0.02
    bar, made_of = box((length, thick, thick)), replace(steel(), poisson=0.0)
    # The longitudinal mode of a bar without Poisson's effect is exactly sqrt(E / rho) / 2 L.
    exact = np.sqrt(made_of.young / made_of.density) / (2.0 * length)
    # A consistent mass is never too slow, and twice as many cubes are off by a quarter.
    wrong = [
        (hexahedral_modes(bar, made_of, 1.2 * exact, 12, cells).frequencies / exact - 1.0)
        for cells in (6, 12, 24)
    ]
    nearest = np.array([each[np.abs(each).argmin()] for each in wrong])
    assert (nearest > 0.0).all()
    assert nearest[:-1] / nearest[1:] == pytest.approx([4.0, 4.0], rel=0.05)


def test_shapes_are_mass_normalised_and_without_rigid_motion() -> None:
    found = hexahedral_modes(box((0.08, 0.02, 0.01)), steel(), 2e4, 4, 16)
    assert found.frequencies.min() > 100.0
    assert len(found.frequencies) <= 4
    assert (np.diff(found.frequencies) >= 0.0).all()
    cube = (0.08 / 16) ** 3
    # Of lumped masses, to what consistent ones differ by.
    squares = (found.shapes**2).sum(axis=(0, 2)) * steel().density * found.cubes * cube / len(found.nodes)
    assert (squares > 0.5).all()
    assert (squares < 4.0).all()


def test_a_grid_without_a_mode_in_reach_is_refused_with_its_size() -> None:
    with pytest.raises(MeshRefused, match=r"5 mm.*50 Hz"):
        hexahedral_modes(box((0.04, 0.02, 0.02)), steel(), 50.0, 4, 8)


def test_cubes_cover_the_object() -> None:
    cubes, origin, side = voxel_cubes(box((0.04, 0.02, 0.02)), 8)
    assert side == pytest.approx(0.005)
    low, high = origin + side * cubes.min(axis=0), origin + side * (cubes.max(axis=0) + 1)
    assert (low <= np.array([-0.02, -0.01, -0.01]) + 1e-9).all()
    assert (high >= np.array([0.02, 0.01, 0.01]) - 1e-9).all()
