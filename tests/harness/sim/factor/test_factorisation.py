"""Laws of the sparse factors: residuals, other solvers, the signs of eigenvalues, and what is refused."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import splu

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.sim.factor.elimination import Elimination, elimination
from harness.sim.factor.factorisation import Pivots, SparseColumns, factorised, inertia
from harness.sim.modal.solve import Elasticity
from harness.sim.modal.system import ModalSystem, modal_system
from harness.sim.solid.tetrahedra import QuadraticMesh, Tetrahedra, quadratic_mesh


def scattered(size: int, per_row: float, seed: int) -> SparseColumns:
    """Symmetric, of random pattern, both signs on the diagonal, which dominates."""
    random = np.random.default_rng(seed)
    half = sp.random_array((size, size), density=min(1.0, per_row / size), rng=random)
    both = (half + half.T).tocsc()
    heavy = np.asarray(abs(both).sum(axis=0)) + random.uniform(0.1, 1.0, size)
    return sp.csc_array(both + sp.diags_array(heavy * random.choice([-1.0, 1.0], size)))


def grid(side: int) -> SparseColumns:
    """The seven-point Laplacian of a cube, held outside: a case that fills."""
    line = sp.csc_array(2.0 * np.eye(side) - np.eye(side, k=1) - np.eye(side, k=-1))
    one = sp.eye_array(side)
    terms = [sp.kron(sp.kron(a, b), c) for a, b, c in ((line, one, one), (one, line, one), (one, one, line))]
    return sp.csc_array(terms[0] + terms[1] + terms[2])


def grid_values(side: int) -> FloatArray:
    """Its eigenvalues, in closed form."""
    line = 2.0 - 2.0 * np.cos(np.pi * np.arange(1, side + 1) / (side + 1))
    return np.sort((line[:, None, None] + line[None, :, None] + line[None, None, :]).ravel())


def signs(matrix: SparseColumns) -> Pivots:
    """Of its pivots, none of which is lost."""
    pivots = inertia(matrix, elimination(matrix))
    assert pivots is not None
    return pivots


def bar() -> QuadraticMesh:
    """Four cubes in a row, six tetrahedra each."""
    corners = np.array([[x, y, z] for x in range(5) for y in range(2) for z in range(2)], dtype=float) * 0.01
    ways = ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))
    cells = [[4 * x, 4 * x + a, 4 * x + b, 4 * x + 7] for x in range(4) for a, b in ways]
    filled = Tetrahedra(corners, _outward(corners, np.array(cells)))
    return quadratic_mesh(filled.nodes, filled.cells)


def _outward(nodes: FloatArray, cells: IntArray) -> IntArray:
    a, b, c, d = (nodes[cells[:, k]] for k in range(4))
    wrong = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    cells[wrong] = cells[wrong][:, [0, 2, 1, 3]]
    return cells


def steel(held: bool = False) -> ModalSystem:
    """The bar of steel, free or held at one end along two axes."""
    mesh = bar()
    uniform = Elasticity.uniform(MATERIALS["steel"], len(mesh.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    which = np.zeros(mesh.nodes.shape, dtype=np.bool_)
    which[mesh.nodes[:, 0] == 0.0, :2] = True
    return system.held(which) if held else system


@settings(max_examples=40, deadline=None)
@given(size=st.integers(1, 300), per_row=st.floats(0.0, 6.0), seed=st.integers(0, 2**16))
def test_what_is_solved_gives_the_right_side_back(size: int, per_row: float, seed: int) -> None:
    matrix = scattered(size, per_row, seed)
    block = np.random.default_rng(seed).standard_normal((size, 3))
    found = factorised(matrix, elimination(matrix)).solve(block)
    scale = np.abs(matrix.toarray()) @ np.abs(found) + np.abs(block)
    assert np.abs(matrix @ found - block).max() <= 1e-13 * scale.max()


@settings(max_examples=40, deadline=None)
@given(size=st.integers(1, 120), per_row=st.floats(0.0, 6.0), seed=st.integers(0, 2**16))
def test_negative_pivots_are_the_negative_eigenvalues(size: int, per_row: float, seed: int) -> None:
    matrix = scattered(size, per_row, seed)
    expected = int((np.linalg.eigvalsh(matrix.toarray()) < 0.0).sum())
    plan = elimination(matrix)
    assert signs(matrix).negative == expected
    assert factorised(matrix, plan).pivots.negative == expected


@pytest.mark.parametrize("side", [2, 9, 14])
def test_eigenvalues_below_a_shift_are_counted(side: int) -> None:
    """The grid's are known in closed form; a thousand columns and more fill the large fronts too."""
    matrix, values = grid(side), grid_values(side)
    gaps = np.flatnonzero(np.diff(values) > 1e-3)
    for at in gaps[:: max(1, len(gaps) // 6)]:
        shift = 0.37 * values[at] + 0.63 * values[at + 1]
        pivots = signs(sp.csc_array(matrix - shift * sp.eye_array(side**3)))
        assert pivots.negative == at + 1
        assert pivots.growth < 1e6


@pytest.mark.parametrize("columns", [1, 2, 8, 13])
def test_blocks_agree_with_superlu(columns: int) -> None:
    matrix = grid(11)
    block = np.random.default_rng(columns).standard_normal((matrix.shape[0], columns))
    ours = factorised(matrix, elimination(matrix)).solve(block)
    np.testing.assert_allclose(ours, splu(matrix).solve(block), rtol=0, atol=1e-12 * np.abs(ours).max())


def test_columns_of_a_block_do_not_mix() -> None:
    matrix = grid(6)
    block = np.random.default_rng(0).standard_normal((216, 5))
    factor = factorised(matrix, elimination(matrix))
    alone = np.hstack([factor.solve(block[:, [k]]) for k in range(5)])
    np.testing.assert_allclose(factor.solve(block), alone, rtol=1e-13, atol=1e-14)


def test_nothing_to_solve_for_is_nothing() -> None:
    matrix = grid(2)
    assert factorised(matrix, elimination(matrix)).solve(np.empty((8, 0))).shape == (8, 0)


def test_blocks_in_either_order_of_memory_are_left_alone() -> None:
    matrix = grid(5)
    factor = factorised(matrix, elimination(matrix))
    block = np.random.default_rng(0).standard_normal((125, 4))
    before = block.copy()
    np.testing.assert_array_equal(factor.solve(block), factor.solve(np.asfortranarray(block)))
    np.testing.assert_array_equal(block, before)


def test_a_positive_definite_matrix_grows_by_nothing() -> None:
    """Then ``sum_j L_ij^2 d_j`` is the diagonal itself."""
    assert signs(grid(9)).growth == pytest.approx(1.0, abs=1e-13)


def test_a_zero_on_the_diagonal_is_no_zero_pivot() -> None:
    """Eliminated after its neighbour it has one; what it grew from is nothing."""
    matrix = sp.csc_array(np.array([[0.0, 1.0, 0.0], [1.0, 5.0, 1.0], [0.0, 1.0, 3.0]]))
    swapped = np.array([1, 0, 2])
    plan: Elimination = elimination(matrix)._replace(order=swapped, rank=swapped)
    pivots = inertia(matrix, plan)
    assert pivots is not None
    assert (pivots.negative, pivots.growth) == (1, np.inf)


def test_growth_tells_of_a_small_pivot() -> None:
    matrix = sp.csc_array(np.array([[1e-9, 1.0], [1.0, 1.0]]))
    assert signs(matrix).growth > 1e8


@pytest.mark.parametrize("held", [False, True])
def test_the_unknowns_of_a_node_are_planned_together(held: bool) -> None:
    """The same solution as without, of the same matrix."""
    system = steel(held)
    matrix = system.shifted(system.shift)
    block = np.random.default_rng(2).standard_normal((matrix.shape[0], 8))
    ours = factorised(matrix, system.plan).solve(block)
    plain = factorised(matrix, elimination(matrix)).solve(block)
    np.testing.assert_allclose(ours, plain, rtol=0, atol=1e-6 * np.abs(plain).max())


@pytest.mark.parametrize("held", [False, True])
def test_the_shifted_matrix_is_stiffness_and_mass(held: bool) -> None:
    system = steel(held)
    expected = (system.stiffness - 3.0e8 * system.inertia()).toarray()
    np.testing.assert_allclose(
        system.shifted(-3.0e8).toarray(), expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )


def test_a_mesh_has_one_order() -> None:
    np.testing.assert_array_equal(steel().plan.order, steel().plan.order)


def test_bodies_apart_are_solved_at_once() -> None:
    matrix = sp.csc_array(sp.block_diag([grid(4), 3.0 * grid(3), np.eye(1)]))
    block = np.random.default_rng(1).standard_normal((92, 2))
    found = factorised(matrix, elimination(matrix)).solve(block)
    np.testing.assert_allclose(matrix @ found, block, rtol=0, atol=1e-12)


def test_a_singular_matrix_is_refused() -> None:
    """A node without an element; a Laplacian that nothing holds."""
    lone = sp.csc_array(sp.block_diag([grid(3), np.zeros((1, 1))]))
    circle = 2.0 * np.eye(50) - np.roll(np.eye(50), 1, axis=0) - np.roll(np.eye(50), -1, axis=0)
    for matrix in (lone, sp.csc_array(circle)):
        plan = elimination(matrix)
        with pytest.raises(MeshRefused, match=r"unknown \d+ .*pivot"):
            factorised(matrix, plan)
        assert inertia(matrix, plan) is None


def test_signs_are_not_told_where_a_pivot_is_lost() -> None:
    """Regular, but its first pivot is zero in any order."""
    matrix = sp.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    assert inertia(matrix, elimination(matrix)) is None


def test_what_is_not_a_number_is_refused() -> None:
    matrix = grid(3)
    matrix.data[5] = np.nan
    with pytest.raises(MeshRefused):
        factorised(matrix, elimination(matrix))


def test_entries_outside_the_plan_are_refused() -> None:
    with pytest.raises(WrongUse, match="pattern"):
        factorised(sp.csc_array(np.ones((4, 4)) + 9.0 * np.eye(4)), elimination(sp.csc_array(np.eye(4))))


def test_other_than_doubles_are_refused() -> None:
    matrix = grid(3)
    plan = elimination(matrix)
    with pytest.raises(WrongUse, match="float32"):
        factorised(matrix.astype(np.float32), plan)
    with pytest.raises(WrongUse, match="float32"):
        factorised(matrix, plan).solve(np.ones((27, 1), dtype=np.float32))


@pytest.mark.parametrize("shape", [(27,), (26, 2), (27, 2, 1)])
def test_blocks_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    matrix = grid(3)
    with pytest.raises(WrongUse, match="columns"):
        factorised(matrix, elimination(matrix)).solve(np.ones(shape))


def test_the_matrix_must_be_of_the_plans_size() -> None:
    with pytest.raises(WrongUse, match="float64"):
        factorised(grid(3), elimination(grid(2)))
