"""The sparse stiffness and mass of ten-node tetrahedra, element by element, in machine code.

A cell lists its four corners and then the middles of the edges in ``EDGES``. Stiffness is
integrated at four points (exact where the edges are straight), mass at fourteen (degree five;
Walkington, Quadrature on Simplices of Arbitrary Dimension, 2000), so that the mass of a
straight element is the consistent one to rounding.
"""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.compiled import compiled, copy_line

EDGES = read_only(np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], dtype=np.int64))
"""``(6, 2)``: the corners whose middle is node ``4 + row``."""


def _orbit(inner: float) -> FloatArray:
    """``(4, 4)`` barycentric coordinates: ``1 - 3 inner`` at one corner, ``inner`` at the others."""
    return np.full((4, 4), inner) + (1.0 - 4.0 * inner) * np.eye(4)


def _edge_orbit(inner: float) -> FloatArray:
    """``(6, 4)`` barycentric coordinates: ``inner`` at two corners, ``0.5 - inner`` at the others."""
    shares = np.full((6, 4), 0.5 - inner)
    for row, pair in enumerate(EDGES):
        shares[row, pair] = inner
    return shares


STIFFNESS_POINTS = read_only(_orbit((5.0 - np.sqrt(5.0)) / 20.0))
"""``(4, 4)`` barycentric coordinates; the weights are equal."""

MASS_POINTS = read_only(
    np.vstack([_orbit(0.31088591926330060980), _orbit(0.092735250310891226402),
               _edge_orbit(0.045503704125649649492)])
)  # fmt: skip
"""``(14, 4)`` barycentric coordinates."""

MASS_WEIGHTS = read_only(
    6.0 * np.repeat([0.018781320953002641800, 0.012248840519393658257, 0.0070910034628469110730], [4, 4, 6])
)
"""``(14,)``, as shares of the volume: they add up to 1."""


def shape_slopes(shares: FloatArray) -> FloatArray:
    """``(q, 10, 3)`` slopes of the shape functions along the reference coordinates.

    The reference coordinates are the barycentric ones of the corners 1, 2 and 3.
    """
    by_share = np.zeros((len(shares), 10, 4))
    for corner in range(4):
        by_share[:, corner, corner] = 4.0 * shares[:, corner] - 1.0
    for row, (a, b) in enumerate(EDGES):
        by_share[:, 4 + row, a] = 4.0 * shares[:, b]
        by_share[:, 4 + row, b] = 4.0 * shares[:, a]
    slopes: FloatArray = by_share[:, :, 1:] - by_share[:, :, :1]
    return slopes


@compiled
def determinants(nodes: FloatArray, cells: IntArray, slopes: FloatArray) -> FloatArray:
    """``(c, q)``: six times the volume, were the map everywhere as at each of ``(q, 10, 3)`` slopes."""
    found = np.empty((len(cells), len(slopes)))
    jacobian = np.empty((3, 3))
    for e in range(len(cells)):
        for q in range(len(slopes)):
            found[e, q] = _jacobian(nodes, cells[e], slopes[q], jacobian)
    return found


@compiled
def _jacobian(nodes: FloatArray, cell: IntArray, slopes: FloatArray, jacobian: FloatArray) -> float:
    """Fill ``d x_i / d r_j`` and return its determinant."""
    jacobian[:] = 0.0
    for a in range(10):
        for i in range(3):
            x = nodes[cell[a], i]
            for j in range(3):
                jacobian[i, j] += x * slopes[a, j]
    determinant: float = (
        jacobian[0, 0] * (jacobian[1, 1] * jacobian[2, 2] - jacobian[1, 2] * jacobian[2, 1])
        - jacobian[0, 1] * (jacobian[1, 0] * jacobian[2, 2] - jacobian[1, 2] * jacobian[2, 0])
        + jacobian[0, 2] * (jacobian[1, 0] * jacobian[2, 1] - jacobian[1, 1] * jacobian[2, 0])
    )
    return determinant


@compiled
def _gradients(jacobian: FloatArray, determinant: float, slopes: FloatArray, out: FloatArray) -> None:
    """``(10, 3)`` slopes of the shape functions along x, y and z."""
    cofactor = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            p, q, r, s = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            cofactor[i, j] = jacobian[p, r] * jacobian[q, s] - jacobian[p, s] * jacobian[q, r]
    for a in range(10):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += slopes[a, j] * cofactor[i, j]
            out[a, i] = total / determinant


@compiled
def pattern(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Which nodes share an element: row starts ``(count + 1,)`` and sorted columns."""
    per_node = np.zeros(count + 1, np.int64)
    for e in range(len(cells)):
        for a in range(10):
            per_node[cells[e, a] + 1] += 1
    starts = np.cumsum(per_node)
    filled = starts[:-1].copy()
    touching = np.empty(starts[-1], np.int64)
    for e in range(len(cells)):
        for a in range(10):
            node = cells[e, a]
            touching[filled[node]] = e
            filled[node] += 1
    rows = np.zeros(count + 1, np.int64)
    columns = np.empty(10 * starts[-1], np.int64)
    seen = np.full(count, -1, np.int64)
    total = 0
    for node in range(count):
        first = total
        for k in range(starts[node], starts[node + 1]):
            for b in range(10):
                other = cells[touching[k], b]
                if seen[other] != node:
                    seen[other] = node
                    columns[total] = other
                    total += 1
        copy_line(columns[first:], np.sort(columns[first:total]))
        rows[node + 1] = total
    return rows, columns[:total].copy()


@compiled
def _position(rows: IntArray, columns: IntArray, row: int, column: int) -> int:
    low: int = rows[row]
    high: int = rows[row + 1] - 1
    while low < high:
        middle = (low + high) // 2
        if columns[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def assemble(
    nodes: FloatArray,
    cells: IntArray,
    lame: FloatArray,
    density: FloatArray,
    rows: IntArray,
    columns: IntArray,
    slopes: FloatArray,
    mass_slopes: FloatArray,
    mass_values: FloatArray,
    mass_weights: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Stiffness blocks ``(nnz, 3, 3)`` N/m and mass entries ``(nnz,)`` kg on the pattern.

    Args:
        nodes: ``(n, 3)`` m.
        cells: ``(c, 10)``, positively oriented.
        lame: ``(c, 2)`` Pa, Lame's lambda and mu of each element.
        density: ``(c,)`` kg/m^3.
        rows: as ``pattern`` gives them.
        columns: as ``pattern`` gives them.
        slopes: ``(q, 10, 3)`` at the stiffness points, of equal weight.
        mass_slopes: ``(p, 10, 3)`` at the mass points.
        mass_values: ``(p, 10)`` at the mass points.
        mass_weights: ``(p,)``, adding up to 1.
    """
    stiffness = np.zeros((len(columns), 3, 3))
    mass = np.zeros(len(columns))
    jacobian = np.empty((3, 3))
    gradient = np.empty((10, 3))
    block = np.empty((10, 10, 3, 3))
    share = np.empty((10, 10))
    for e in range(len(cells)):
        block[:] = 0.0
        share[:] = 0.0
        for q in range(len(slopes)):
            determinant = _jacobian(nodes, cells[e], slopes[q], jacobian)
            _gradients(jacobian, determinant, slopes[q], gradient)
            weight = determinant / (6.0 * len(slopes))
            _add_stiffness(block, gradient, weight * lame[e, 0], weight * lame[e, 1])
        for q in range(len(mass_slopes)):
            determinant = _jacobian(nodes, cells[e], mass_slopes[q], jacobian)
            weight = density[e] * mass_weights[q] * determinant / 6.0
            for a in range(10):
                for b in range(a, 10):
                    share[a, b] += weight * mass_values[q, a] * mass_values[q, b]
        _scatter(cells[e], block, share, rows, columns, stiffness, mass)
    return stiffness, mass


@compiled
def _add_stiffness(block: FloatArray, gradient: FloatArray, first: float, second: float) -> None:
    for a in range(10):
        for b in range(a, 10):
            along = second * (
                gradient[a, 0] * gradient[b, 0]
                + gradient[a, 1] * gradient[b, 1]
                + gradient[a, 2] * gradient[b, 2]
            )
            for i in range(3):
                for j in range(3):
                    block[a, b, i, j] += (
                        first * gradient[a, i] * gradient[b, j] + second * gradient[a, j] * gradient[b, i]
                    )
                block[a, b, i, i] += along


@compiled
def _scatter(
    cell: IntArray,
    block: FloatArray,
    share: FloatArray,
    rows: IntArray,
    columns: IntArray,
    stiffness: FloatArray,
    mass: FloatArray,
) -> None:
    for a in range(10):
        for b in range(a, 10):
            there = _position(rows, columns, cell[a], cell[b])
            _add(stiffness[there], block[a, b])
            mass[there] += share[a, b]
            if a != b:
                back = _position(rows, columns, cell[b], cell[a])
                _add(stiffness[back], block[a, b].T)
                mass[back] += share[a, b]


@compiled
def _add(target: FloatArray, more: FloatArray) -> None:
    for i in range(3):
        for j in range(3):
            target[i, j] += more[i, j]
