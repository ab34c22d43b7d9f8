"""Modes of solids: against closed forms and another program, and the laws they must obey."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import subspace_angles
from skfem.models.elasticity import linear_elasticity

from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.geometry import rotation_about
from harness.basics.materials import MATERIALS, Material
from harness.basics.mesh import Mesh
from harness.sim.modal.modal import from_arrays, solve_modes, to_arrays
from harness.sim.modal.modes import Modes, dampings
from harness.sim.modal.solve import Elasticity
from harness.sim.modal.system import modal_system
from harness.sim.solid.tetrahedra import Tetrahedra, quadratic_mesh, tetrahedra
from tests.oracles.volume_meshes import ball, box

STEEL = MATERIALS["steel"]
BEAM = (0.2, 0.02, 0.01)


@pytest.fixture(scope="module")
def beam() -> Tetrahedra:
    return box(BEAM, (30, 3, 2))


@pytest.fixture(scope="module")
def beam_modes(beam: Tetrahedra) -> Modes:
    return solve_modes(beam, STEEL, 12e3)


def timoshenko(length: float, height: float, width: float, material: Material, count: int) -> list[float]:
    """Hz, of a free beam bending across ``height`` (Timoshenko's equation, symmetric and odd modes).

    Shear coefficient of a rectangle after Cowper, J. Applied Mechanics 33, 1966. Found as the
    zeros of the determinant of the four free-end conditions.
    """
    shear = material.young / (2.0 * (1.0 + material.poisson))
    kappa = 10.0 * (1.0 + material.poisson) / (12.0 + 11.0 * material.poisson)
    area, inertia = width * height, width * height**3 / 12.0

    def determinant(frequency: float) -> float:
        w2 = (2.0 * np.pi * frequency) ** 2
        a = material.young * inertia
        b = material.density * inertia * w2 + a * material.density * w2 / (kappa * shear)
        c = material.density * area * w2 - (material.density * w2) ** 2 * inertia / (kappa * shear)
        squares = np.roots([a, b, -c])
        roots = np.concatenate([np.sqrt(squares.astype(complex)), -np.sqrt(squares.astype(complex))])
        rows = []
        for end in (0.0, length):
            turn = roots + material.density * w2 / (kappa * shear * roots)
            waves = np.exp(roots * (end - np.where(roots.real > 0.0, length, 0.0)))
            rows += [turn * roots * waves, (turn - roots) * waves]
        matrix = np.array(rows)
        return float(np.imag(np.linalg.det(matrix)) + np.real(np.linalg.det(matrix)))

    grid = np.linspace(100.0, 12e3, 4000)
    values = np.array([determinant(f) for f in grid])
    found = []
    for k in np.flatnonzero(np.diff(np.sign(values)) != 0):
        low, high = grid[k], grid[k + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if determinant(middle) * determinant(low) > 0 else (low, middle)
        found.append(0.5 * (low + high))
    return found[:count]


def test_a_free_steel_beam_rings_as_timoshenko_says(beam_modes: Modes) -> None:
    flat, upright = timoshenko(*(BEAM[0], BEAM[2], BEAM[1]), STEEL, 3), timoshenko(*BEAM, STEEL, 2)
    middle = np.argmin(np.linalg.norm(beam_modes.points - [0.0, 0.01, 0.005], axis=1))
    end = beam_modes.shapes[middle]
    across = np.abs(end).argmax(axis=1)
    found = [beam_modes.frequencies[across == axis] for axis in (2, 1)]
    assert found[0][:3] == pytest.approx(flat, rel=5e-3)
    assert found[1][:2] == pytest.approx(upright, rel=5e-3)


@pytest.mark.parametrize(("eta", "group"), [(2.501133, 5), (2.639869, 5), (3.424530, 3)])
def test_a_sphere_rings_as_lamb_says(eta: float, group: int, sphere: Modes) -> None:
    """Roots of Lamb's frequency equations at Poisson's ratio 0.25: w R / c_s (H. Lamb, 1881)."""
    shear_speed = np.sqrt(STEEL.young / (2.5 * STEEL.density))
    expected = eta * shear_speed / (2.0 * np.pi * 0.03)
    near = sphere.frequencies[np.abs(sphere.frequencies / expected - 1.0) < 0.02]
    assert len(near) == group
    assert near == pytest.approx(expected, rel=5e-3)


@pytest.fixture(scope="module")
def sphere() -> Modes:
    material = replace(STEEL, poisson=0.25)
    made = ball(0.03, 6)
    fine = ball(0.03, 18).surface
    assert np.linalg.norm(fine.vertices[fine.faces], axis=2) == pytest.approx(0.03)
    return solve_modes(made, material, 60e3, fine)


def test_six_rigid_motions_are_left_out_of_every_body(beam: Tetrahedra, beam_modes: Modes) -> None:
    assert beam_modes.rigid == 6
    assert beam_modes.frequencies[0] > 1000.0
    apart = Tetrahedra(
        np.concatenate([beam.nodes, beam.nodes + np.array([0.0, 0.0, 0.05])]),
        np.concatenate([beam.cells, beam.cells + len(beam.nodes)]),
    )
    two = solve_modes(apart, STEEL, 12e3)
    assert apart.bodies == 2
    assert two.rigid == 12
    assert two.frequencies == pytest.approx(np.repeat(beam_modes.frequencies, 2), rel=1e-9)


@settings(max_examples=4, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.2, 5.0))
def test_frequency_falls_as_size_grows_and_with_the_root_of_density(decades: float, heavier: float) -> None:
    scale = 10.0**decades
    small = solve_modes(box((0.05, 0.03, 0.02), (2, 2, 1)), STEEL, 150e3)
    other = box((0.05 * scale, 0.03 * scale, 0.02 * scale), (2, 2, 1))
    heavy = replace(STEEL, density=STEEL.density * heavier)
    factor = 1.0 / (scale * np.sqrt(heavier))
    large = solve_modes(other, heavy, 150e3 * factor)
    assert large.frequencies == pytest.approx(small.frequencies * factor, rel=1e-10)
    assert large.mass == pytest.approx(small.mass * scale**3 * heavier, rel=1e-12)


def test_numbering_orientation_and_pose_change_nothing(beam: Tetrahedra, beam_modes: Modes) -> None:
    random = np.random.default_rng(4)
    order = random.permutation(len(beam.nodes))
    rotation = rotation_about(np.array([0.6, 0.0, 0.8]), 1.1)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    shuffled = place[beam.cells][random.permutation(len(beam.cells))]
    flipped = shuffled[:, random.permutation(4)]
    moved = tetrahedra(beam.nodes[order] @ rotation.T + [0.3, -0.2, 1.0], flipped)
    modes = solve_modes(moved, STEEL, 12e3)
    assert modes.frequencies == pytest.approx(beam_modes.frequencies, rel=1e-9)
    point, direction = np.array([[0.0, 0.01, 0.005]]), np.array([[0.0, 0.0, 1.0]])
    before = beam_modes.gains(point, direction)
    after = modes.gains(point @ rotation.T + [0.3, -0.2, 1.0], direction @ rotation.T)
    assert np.abs(after) == pytest.approx(np.abs(before), rel=1e-6, abs=1e-8)


def test_equal_modes_are_compared_as_what_they_span() -> None:
    """Every mode of a square bar's bending comes twice, in a basis that nothing decides."""
    one = solve_modes(box((0.1, 0.01, 0.01), (10, 2, 2)), STEEL, 6e3)
    turned = box((0.01, 0.01, 0.1), (2, 2, 10))
    other = solve_modes(turned, STEEL, 6e3)
    assert len(one.frequencies) == len(other.frequencies) == 2
    assert other.frequencies == pytest.approx(one.frequencies, rel=2e-3)
    points = one.points
    swapped = np.roll(points, 2, axis=1) @ np.eye(3)
    there = np.roll(other.at(np.roll(points, -1, axis=1)), 1, axis=2)
    assert np.ptp(swapped) == np.ptp(points)
    angles = subspace_angles(
        one.at(points).transpose(0, 2, 1).reshape(-1, 2), there.transpose(0, 2, 1).reshape(-1, 2)
    )
    assert angles.max() < 0.02


def test_modes_are_mass_normalised(beam: Tetrahedra) -> None:
    """A rigid body's worth of kinetic energy: sum of m |phi|^2 over the volume is 1."""
    from harness.sim.modal.solve import modes_below

    mesh = quadratic_mesh(beam.nodes, beam.cells)
    uniform = Elasticity.uniform(STEEL, len(beam.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    pairs, reached = modes_below(system, 12e3)
    gram = pairs.vectors.T @ system.weighted(pairs.vectors)
    assert np.abs(gram - np.eye(len(gram))).max() < 1e-10
    assert np.abs(system.rigid.T @ system.weighted(pairs.vectors)).max() < 1e-9
    assert reached == pytest.approx(12e3)
    assert pairs.certified
    assert pairs.residual < 1e-6
    assert system.total == pytest.approx(STEEL.density * np.prod(BEAM), rel=1e-12)


def test_stiffness_and_mass_are_those_of_another_program() -> None:
    """scikit-fem (Gustafsson and McBain, 2020) on the same cells, matched node by node."""
    beam = box((0.05, 0.03, 0.02), (3, 2, 1))
    mesh = quadratic_mesh(beam.nodes, beam.cells)
    uniform = Elasticity.uniform(STEEL, len(beam.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(skfem.MeshTet(beam.nodes.T.copy(), beam.cells.T.copy()), element, intorder=4)
    lame, mu = uniform.lame[0]
    stiffness = skfem.asm(linear_elasticity(lame, mu), basis)
    mass = skfem.asm(skfem.BilinearForm(lambda u, v, w: STEEL.density * skfem.helpers.dot(u, v)), basis)
    ours = _unknowns(mesh.nodes, basis)
    assert _relative(system.stiffness.toarray()[np.ix_(ours, ours)], stiffness.toarray()) < 1e-12
    assert _relative(np.kron(system.mass.toarray(), np.eye(3))[np.ix_(ours, ours)], mass.toarray()) < 1e-12


def _unknowns(nodes: Any, basis: Any) -> Any:
    """Our number of each unknown of scikit-fem's."""
    from scipy.spatial import cKDTree

    _, node = cKDTree(nodes).query(basis.doflocs.T)
    axis = np.empty(basis.N, dtype=np.int64)
    for table in (basis.nodal_dofs, basis.edge_dofs):
        for component in range(3):
            axis[table[component]] = component
    return 3 * node + axis


def _relative(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def test_a_cube_rings_as_published_and_its_error_falls_towards_the_fourth_power() -> None:
    """Demarest, J. Acoust. Soc. Am. 49(3), 1971: f L / sqrt(E / rho) at Poisson's ratio 0.3."""
    published = np.repeat([0.28190221, 0.37961161, 0.3860549], [2, 3, 3])
    material = replace(STEEL, poisson=0.3)
    bar_speed = np.sqrt(material.young / material.density)
    errors = []
    for count in (2, 4, 6):
        modes = solve_modes(box((0.05, 0.05, 0.05), (count, count, count)), material, 60e3, most=8)
        errors.append(modes.frequencies * 0.05 / bar_speed / published - 1.0)
    assert errors[-1].max() < 1.5e-3
    assert all((error > 0.0).all() for error in errors)
    rates = [np.log(errors[k] / errors[k + 1]).min() / np.log(step) for k, step in ((0, 2.0), (1, 1.5))]
    assert 2.5 < rates[0] < rates[1] < 4.2


def test_a_mode_is_read_between_its_nodes(beam_modes: Modes) -> None:
    nodes = beam_modes.points[:5]
    assert beam_modes.at(nodes) == pytest.approx(beam_modes.shapes[:5], abs=1e-9)
    face = beam_modes.faces[7]
    middle = beam_modes.points[face].mean(axis=0)
    lifted = middle + 1e-4 * beam_modes.normals[face[0]]
    assert beam_modes.at(np.array([middle]))[0] == pytest.approx(beam_modes.shapes[face].mean(axis=0))
    shares = beam_modes.place(np.array([lifted]))[1]
    assert shares.sum() == pytest.approx(1.0)
    with pytest.raises(WrongUse, match="finite"):
        beam_modes.at(np.array([[np.nan, 0.0, 0.0]]))
    with pytest.raises(WrongUse, match="length 2"):
        beam_modes.gains(np.array([middle]), np.array([[0.0, 0.0, 2.0]]))


def test_the_lowest_modes_can_be_asked_for_by_number(beam: Tetrahedra, beam_modes: Modes) -> None:
    few = solve_modes(beam, STEEL, 12e3, most=3)
    assert few.frequencies == pytest.approx(beam_modes.frequencies[:3], rel=1e-9)
    assert few.frequencies[-1] < few.limit < beam_modes.frequencies[3]


def test_modes_survive_the_store(beam_modes: Modes) -> None:
    again = from_arrays(to_arrays(beam_modes))
    assert again.limit == beam_modes.limit
    assert again.seconds == beam_modes.seconds
    assert (again.shapes == beam_modes.shapes).all()
    assert (again.rigid, again.nodes, again.elements) == (6, beam_modes.nodes, beam_modes.elements)


def test_damping_is_half_of_rayleighs_sum() -> None:
    rates = dampings(np.array([100.0, 10e3]), STEEL)
    omega = 2.0 * np.pi * np.array([100.0, 10e3])
    assert rates == pytest.approx(0.5 * (STEEL.alpha + STEEL.beta * omega**2))


def test_what_cannot_vibrate_is_named(beam: Tetrahedra) -> None:
    with pytest.raises(MeshRefused, match="flat"):
        tetrahedra(beam.nodes, np.concatenate([beam.cells, [[0, 1, 2, 2]]]))
    sliver = np.concatenate([beam.nodes, [beam.nodes[:3].mean(axis=0) + np.array([0.0, 0.0, 1e-14])]])
    with pytest.raises(MeshRefused, match="flat"):
        tetrahedra(sliver, np.concatenate([beam.cells, [[0, 1, 2, len(beam.nodes)]]]))
    with pytest.raises(MeshRefused, match="finite"):
        tetrahedra(np.full_like(beam.nodes, np.nan), beam.cells)
    with pytest.raises(MeshRefused, match="faces"):
        tetrahedra(beam.nodes, np.concatenate([beam.cells, beam.cells[:1]]))
    with pytest.raises(WrongUse, match="above 0"):
        solve_modes(beam, STEEL, 0.0)
    with pytest.raises(WrongUse, match=r"0.5"):
        solve_modes(beam, replace(STEEL, poisson=0.5), 1e3)


def test_an_inverted_element_is_refused(beam: Tetrahedra) -> None:
    inside_out = Tetrahedra(beam.nodes, beam.cells[:, [0, 2, 1, 3]])
    with pytest.raises(MeshRefused, match="inverted"):
        solve_modes(inside_out, STEEL, 12e3)


def test_an_unused_node_is_left_out(beam: Tetrahedra, beam_modes: Modes) -> None:
    with_orphan = tetrahedra(np.concatenate([[[9.0, 9.0, 9.0]], beam.nodes]), beam.cells + 1)
    assert len(with_orphan.nodes) == len(beam.nodes)
    assert solve_modes(with_orphan, STEEL, 12e3).frequencies == pytest.approx(beam_modes.frequencies)


def test_an_unused_node_that_slipped_through_is_named(beam: Tetrahedra) -> None:
    with pytest.raises(MeshRefused, match="node"):
        solve_modes(Tetrahedra(np.concatenate([beam.nodes, [[9.0] * 3]]), beam.cells), STEEL, 12e3)


def test_rubber_that_hardly_compresses_does_not_lock() -> None:
    soft = [
        solve_modes(box((0.05, 0.04, 0.03), (4, 4, 3)), replace(STEEL, poisson=ratio), 60e3).frequencies[0]
        for ratio in (0.49, 0.4999)
    ]
    assert soft[1] == pytest.approx(soft[0], rel=0.01)


def test_cell_by_cell_elasticity_stiffens_what_it_should(beam: Tetrahedra, beam_modes: Modes) -> None:
    uniform = Elasticity.uniform(STEEL, len(beam.cells))
    stiff = solve_modes(beam, replace(uniform, young=1.21 * uniform.young), 13.2e3)
    assert stiff.frequencies == pytest.approx(1.1 * beam_modes.frequencies, rel=1e-9)
    middle = np.abs(beam.nodes[beam.cells].mean(axis=1)[:, 0] - 0.1) < 0.03
    local = solve_modes(beam, replace(uniform, young=np.where(middle, 1.21, 1.0) * uniform.young), 12e3)
    assert 1.0 < local.frequencies[0] / beam_modes.frequencies[0] < 1.1


def test_surface_nodes_look_outward(beam_modes: Modes) -> None:
    surface = Mesh(beam_modes.points, beam_modes.faces)
    assert surface.face_areas.sum() == pytest.approx(2 * (0.2 * 0.02 + 0.2 * 0.01 + 0.02 * 0.01))
    assert np.linalg.norm(beam_modes.normals, axis=1) == pytest.approx(1.0)
    away = beam_modes.points - np.array(BEAM) / 2
    assert np.einsum("ij,ij->i", away, beam_modes.normals).min() > 0.0
