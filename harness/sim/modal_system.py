"""Stiffness, mass and rigid motions of a finite-element mesh, and the factor that solves with them."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from harness.arrays import FloatArray
from harness.errors import MeshRefused
from harness.sim.modal_kernels import (
    MASS_POINTS,
    MASS_WEIGHTS,
    STIFFNESS_POINTS,
    assemble,
    pattern,
    shape_slopes,
    shape_values,
)
from harness.sim.modal_mesh import QuadraticMesh

SparseColumns: TypeAlias = "sp.csc_array[Any]"
SparseRows: TypeAlias = "sp.csr_array[Any]"

_SHIFT = 1e-9
"""The shift as a share of ``tr K / tr M``: above the rounding of the rigid modes (1e-16 of the
largest eigenvalue) and, for any object that is not thinner than a thousandth of its size,
below the first elastic mode."""


@dataclass(frozen=True, eq=False)
class ModalSystem:
    """``K x = w^2 M x`` of one free object.

    Unknown ``3 i + d`` is the displacement of node ``i`` along axis ``d``.

    Attributes:
        stiffness: ``(3 n, 3 n)`` N/m.
        mass: ``(n, n)`` kg, the same for each axis.
        rigid: ``(3 n, 6 bodies)`` 1/sqrt(kg), mass-orthonormal motions without deformation.
        shift: ``(rad/s)^2``, added to the eigenvalues so that the matrix can be factorised.
        total: kg.
    """

    stiffness: SparseColumns
    mass: SparseRows
    rigid: FloatArray
    shift: float
    total: float

    def weighted(self, block: FloatArray) -> FloatArray:
        """The mass matrix times ``(3 n, b)`` vectors."""
        count = self.mass.shape[0]
        return np.asarray(self.mass @ block.reshape(count, -1)).reshape(block.shape)

    def shifted(self, shift: float) -> SparseColumns:
        """``K + shift M``, ``(3 n, 3 n)``; the shift in ``(rad/s)^2`` may be negative."""
        return sp.csc_array(self.stiffness + shift * sp.kron(self.mass, sp.eye_array(3), format="csc"))


def modal_system(mesh: QuadraticMesh, lame: FloatArray, density: FloatArray) -> ModalSystem:
    """Assemble a mesh of ``(c, 2)`` Pa Lame constants and ``(c,)`` kg/m^3 density."""
    count = len(mesh.nodes)
    rows, columns = pattern(mesh.cells, count)
    stiffness, mass = assemble(
        mesh.nodes,
        mesh.cells,
        lame,
        density,
        rows,
        columns,
        shape_slopes(STIFFNESS_POINTS),
        shape_slopes(MASS_POINTS),
        shape_values(MASS_POINTS),
        MASS_WEIGHTS,
    )
    whole = sp.bsr_array((stiffness, columns, rows), shape=(3 * count, 3 * count)).tocsc()
    weights = sp.csr_array((mass, columns, rows), shape=(count, count))
    shift = _SHIFT * float(whole.trace()) / (3.0 * float(weights.trace()))
    return ModalSystem(whole, weights, _rigid_motions(mesh, weights), shift, float(weights.sum()))


def factorised(matrix: SparseColumns) -> SuperLU:
    """The triangular factors of a symmetric matrix, rows and columns in one order.

    Raises:
        MeshRefused: a pivot is zero, as at a node that no element holds.
    """
    try:
        return splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise MeshRefused(
            f"the stiffness of the object cannot be factorised ({error}); its volume mesh has a node that no "
            "element holds, or an element without volume: mesh the object again"
        ) from error


def negative_pivots(factor: SuperLU) -> int | None:
    """How many eigenvalues of a symmetric matrix are below zero (Sylvester's law of inertia).

    Returns:
        The number of negative pivots; None where a pivot was taken off the diagonal, so that
        the factors say nothing.
    """
    if not np.array_equal(factor.perm_r, factor.perm_c):
        return None
    return int(np.count_nonzero(factor.U.diagonal() < 0.0))


def _rigid_motions(mesh: QuadraticMesh, mass: SparseRows) -> FloatArray:
    """Three translations and three rotations of every separate body, mass-orthonormal."""
    count = len(mesh.nodes)
    bodies, body = connected_components(mass, directed=False)
    motions = np.zeros((3 * count, 6 * bodies))
    for number in range(bodies):
        inside = np.flatnonzero(body == number)
        part = mass[inside][:, inside]
        offset = mesh.nodes[inside] - part.sum(axis=0) @ mesh.nodes[inside] / part.sum()
        moved = _six_motions(offset / np.abs(offset).max())
        weighted = np.asarray(part @ moved.reshape(len(inside), 18)).reshape(moved.shape)
        lower = np.linalg.cholesky(np.einsum("nai,naj->ij", moved, weighted))
        unit = np.linalg.solve(lower, moved.reshape(-1, 6).T).T.reshape(len(inside), 3, 6)
        for axis in range(3):
            motions[3 * inside + axis, 6 * number : 6 * number + 6] = unit[:, axis]
    return motions


def _six_motions(offset: FloatArray) -> FloatArray:
    """``(n, 3, 6)``: unit displacements, and unit turns about the axes at ``(n, 3)`` offsets."""
    moved = np.zeros((len(offset), 3, 6))
    for axis in range(3):
        moved[:, axis, axis] = 1.0
        turn = np.zeros(3)
        turn[axis] = 1.0
        moved[:, :, 3 + axis] = np.cross(turn, offset)
    return moved
