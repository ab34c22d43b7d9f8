"""Four-node tetrahedra, for which the harness has no use: to show what their order costs."""

import numpy as np
import scipy.sparse as sp

from harness.basics.arrays import FloatArray
from harness.basics.materials import Material
from harness.sim.modal.system import ModalSystem
from harness.sim.solid.tetrahedra import Tetrahedra

_SHIFT = 1e-9


def four_node_system(filled: Tetrahedra, material: Material) -> ModalSystem:
    """Constant strain and consistent mass, for the solver that the ten-node cells have."""
    count = len(filled.nodes)
    slopes = _slopes(filled)
    young, poisson = material.young, material.poisson
    first = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    second = young / (2.0 * (1.0 + poisson))
    products = np.einsum("cai,cbj->caibj", slopes, slopes)
    along = np.einsum("cak,cbk->cab", slopes, slopes)
    blocks = first * products + second * products.transpose(0, 1, 4, 3, 2)
    blocks += second * np.einsum("cab,ij->caibj", along, np.eye(3))
    blocks *= filled.volumes[:, None, None, None, None]
    unknowns = (3 * filled.cells[:, :, None] + np.arange(3)).reshape(-1, 12)
    rows, columns = np.repeat(unknowns, 12, axis=1).ravel(), np.tile(unknowns, (1, 12)).ravel()
    stiffness = sp.csc_array(sp.coo_array((blocks.ravel(), (rows, columns)), shape=(3 * count, 3 * count)))
    shares = (np.ones((4, 4)) + np.eye(4)) / 20.0 * material.density
    rows, columns = np.repeat(filled.cells, 4, axis=1).ravel(), np.tile(filled.cells, (1, 4)).ravel()
    weights = (filled.volumes[:, None, None] * shares).ravel()
    mass = sp.csr_array(sp.coo_array((weights, (rows, columns)), shape=(count, count)))
    for matrix in (stiffness, mass):
        matrix.sum_duplicates()
        matrix.sort_indices()
    shift = _SHIFT * stiffness.diagonal().sum() / (3.0 * mass.diagonal().sum())
    return ModalSystem(stiffness, mass, _rigid(filled.nodes, mass), float(shift), float(mass.sum()))


def _slopes(filled: Tetrahedra) -> FloatArray:
    """``(c, 4, 3)`` 1/m: gradients of the four shape functions."""
    corners = filled.nodes[filled.cells]
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    rest = inverse.transpose(0, 2, 1)
    return np.concatenate([-rest.sum(axis=1, keepdims=True), rest], axis=1)


def _rigid(nodes: FloatArray, mass: "sp.csr_array") -> FloatArray:
    """``(3 n, 6)``, mass-orthonormal."""
    away = nodes - nodes.mean(axis=0)
    motions = [np.tile(axis, len(nodes)) for axis in np.eye(3)]
    motions += [np.cross(axis, away).ravel() for axis in np.eye(3)]
    columns = np.stack(motions, axis=1)
    heavy = np.asarray(mass @ columns.reshape(len(nodes), -1)).reshape(columns.shape)
    upper = np.linalg.cholesky(columns.T @ heavy).T
    return np.asarray(np.linalg.solve(upper.T, columns.T).T)
