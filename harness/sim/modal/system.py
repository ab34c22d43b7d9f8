"""Stiffness, mass and rigid motions of a finite-element mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.factor.elimination import Elimination, elimination
from harness.sim.factor.factorisation import SparseColumns
from harness.sim.solid.modal_kernels import (
    EDGES,
    MASS_POINTS,
    MASS_WEIGHTS,
    STIFFNESS_POINTS,
    assemble,
    pattern,
    shape_slopes,
)
from harness.sim.solid.tetrahedra import QuadraticMesh

SparseRows: TypeAlias = "sp.csr_array[Any]"
MassRule: TypeAlias = Literal["consistent", "four points"]
"""How mass is integrated: as it is, or at four points as CalculiX does for this element, which is
up to a percent off and here to compare with it."""

_SHIFT = 1e-9
"""The shift as a share of ``tr K / tr M``: above the rounding of the rigid modes (1e-16 of the
largest eigenvalue) and, for any object that is not thinner than a thousandth of its size,
below the first elastic mode."""

_LOOSE = 1e-8
"""Of the greatest motion of a held place, what counts as none."""


@dataclass(frozen=True, eq=False)
class ModalSystem:
    """``K x = w^2 M x`` of one object, free or held.

    Unknown ``3 i + d`` of a free object is the displacement of node ``i`` along axis ``d``; of one
    that is held, the unknowns are those of ``free``.
    """

    stiffness: SparseColumns  #: ``(u, u)`` N/m, of the unknowns.
    mass: SparseRows  #: ``(n, n)`` kg, the same for each axis.
    rigid: FloatArray
    """``(u, r)`` 1/sqrt(kg), mass-orthonormal motions without deformation: six for each body that nothing
    holds."""
    shift: float  #: ``(rad/s)^2``, added to the eigenvalues so that the matrix can be factorised.
    total: float  #: kg.
    free: IntArray | None = None  #: ``(u,)`` which of the ``3 n`` displacements are unknown; None for all.

    def weighted(self, block: FloatArray) -> FloatArray:
        """The mass matrix times ``(u, b)`` vectors."""
        whole = self.whole(block)
        heavy = np.asarray(self.mass @ whole.reshape(self.mass.shape[0], -1)).reshape(whole.shape)
        return heavy if self.free is None else heavy[self.free]

    def whole(self, block: FloatArray) -> FloatArray:
        """``(3 n, b)``: vectors of the unknowns ``(u, b)`` with zero where the object is held."""
        if self.free is None:
            return block
        whole = np.zeros((3 * self.mass.shape[0], block.shape[1]))
        whole[self.free] = block
        return whole

    def shifted(self, shift: float) -> SparseColumns:
        """``K + shift M``, ``(u, u)``; the shift in ``(rad/s)^2`` may be negative."""
        data = self.stiffness.data + shift * self._masses
        return sp.csc_array((data, self.stiffness.indices, self.stiffness.indptr), shape=self.stiffness.shape)

    @cached_property
    def _masses(self) -> FloatArray:
        """The mass that belongs to each entry of the stiffness."""
        free = np.arange(3 * self.mass.shape[0]) if self.free is None else self.free
        return _masses_of_entries(
            self.stiffness.indptr,
            self.stiffness.indices,
            free,
            self.mass.indptr,
            self.mass.indices,
            self.mass.data,
        )

    def inertia(self) -> SparseColumns:
        """``(u, u)`` kg: the mass matrix of the unknowns."""
        mass = sp.csc_array(sp.kron(self.mass, sp.eye_array(3), format="csc"))
        return mass if self.free is None else sp.csc_array(mass[self.free][:, self.free])

    @cached_property
    def plan(self) -> Elimination:
        """Of every ``K + shift M``: the unknowns of a node are eliminated together."""
        unknowns = np.arange(3 * self.mass.shape[0]) if self.free is None else self.free
        nodes, together = np.unique(unknowns // 3, return_inverse=True)
        return elimination(self.mass[nodes][:, nodes], together)

    def held(self, held: BoolArray) -> "ModalSystem":
        """This free system with some displacements held at zero.

        Args:
            held: ``(n, 3)``, which displacement of which node.
        """
        free = np.flatnonzero(~held.ravel())
        _, extent, turned = np.linalg.svd(np.linalg.qr(self.rigid[held.ravel()], mode="r"))
        extent = np.pad(extent, (0, len(turned) - len(extent)))
        left = turned[extent <= _LOOSE * extent.max()].T
        stiffness = sp.csc_array(self.stiffness[free][:, free])
        return replace(self, stiffness=stiffness, rigid=self.rigid[free] @ left, free=free)


def modal_system(
    mesh: QuadraticMesh, lame: FloatArray, density: FloatArray, rule: MassRule = "consistent"
) -> ModalSystem:
    """Assemble a mesh of ``(c, 2)`` Pa Lame constants and ``(c,)`` kg/m^3 density, free."""
    count = len(mesh.nodes)
    points, weights_at = (MASS_POINTS, MASS_WEIGHTS)
    if rule == "four points":
        points, weights_at = (STIFFNESS_POINTS, np.full(4, 0.25))
    rows, columns = pattern(mesh.cells, count)
    corners = points * (2.0 * points - 1.0)
    middles = 4.0 * points[:, EDGES[:, 0]] * points[:, EDGES[:, 1]]
    stiffness, mass = assemble(
        mesh.nodes,
        mesh.cells,
        lame,
        density,
        rows,
        columns,
        shape_slopes(STIFFNESS_POINTS),
        shape_slopes(points),
        np.concatenate([corners, middles], axis=1),
        weights_at,
    )
    by_rows = sp.bsr_array((stiffness, columns, rows), shape=(3 * count, 3 * count)).tocsr()
    # Symmetric, so that its rows are its columns.
    whole = sp.csc_array((by_rows.data, by_rows.indices, by_rows.indptr), shape=by_rows.shape)
    weights = sp.csr_array((mass, columns, rows), shape=(count, count))
    shift = _SHIFT * float(whole.trace()) / (3.0 * float(weights.trace()))
    return ModalSystem(whole, weights, _rigid_motions(mesh, weights), shift, float(weights.sum()))


@compiled
def _masses_of_entries(
    starts: AnyArray,
    rows: AnyArray,
    free: IntArray,
    node_starts: AnyArray,
    others: AnyArray,
    mass: FloatArray,
) -> FloatArray:
    """Mass couples equal axes: that of two nodes where the unknowns' axes agree, else 0."""
    spread = np.zeros(len(rows))
    here = np.zeros(len(node_starts) - 1)
    for column in range(len(starts) - 1):
        node, axis = free[column] // 3, free[column] % 3
        for p in range(node_starts[node], node_starts[node + 1]):
            here[others[p]] = mass[p]
        for p in range(starts[column], starts[column + 1]):
            if free[rows[p]] % 3 == axis:
                spread[p] = here[free[rows[p]] // 3]
        for p in range(node_starts[node], node_starts[node + 1]):
            here[others[p]] = 0.0
    return spread


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
