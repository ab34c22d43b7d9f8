"""Free vibration of a box by Ritz's method on Legendre polynomials: no mesh, no finite element.

Visscher, Migliori, Bell and Reinert, J. Acoust. Soc. Am. 90(4), 1991, with Legendre
polynomials instead of powers, so that the mass matrix is the unit matrix. Frequencies fall
towards the exact ones as the order grows.
"""

from itertools import product

import numpy as np
from numpy.polynomial import legendre

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.materials import Material

Symmetry = tuple[int, int, int]
"""Of the middle planes across x, y and z: 1 where the motion is its own mirror image, -1 its opposite."""


def ritz_frequencies(
    sides: tuple[float, float, float],
    material: Material,
    order: int,
    symmetry: Symmetry | None = None,
) -> FloatArray:
    """Hz, ascending, of the elastic modes of a free box.

    Args:
        sides: m.
        material: its elasticity and density.
        order: highest total degree of the polynomials.
        symmetry: only modes of this kind; None for all.
    """
    if symmetry is None:
        every = [(x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)]
        return np.sort(np.concatenate([ritz_frequencies(sides, material, order, kind) for kind in every]))
    lame = material.young * material.poisson / ((1.0 + material.poisson) * (1.0 - 2.0 * material.poisson))
    shear = material.young / (2.0 * (1.0 + material.poisson))
    flat, slope = _along(order)
    degrees = np.array([d for d in product(range(order + 1), repeat=3) if sum(d) <= order])
    chosen = [degrees[_kept(degrees, component, symmetry)] for component in range(3)]
    half = np.array(sides) / 2.0

    def slopes(a: int, b: int, first: int, second: int) -> FloatArray:
        """Integral of the slope along ``a`` of one function times that along ``b`` of another."""
        total = np.ones((len(chosen[first]), len(chosen[second])))
        for axis in range(3):
            left, right = chosen[first][:, axis], chosen[second][:, axis]
            table = {
                (True, True): slope,
                (True, False): flat,
                (False, True): flat.T,
                (False, False): np.eye(order + 1),
            }[axis == a, axis == b]
            total = total * table[np.ix_(left, right)]
        return np.asarray(total / (half[a] * half[b]))

    rows = []
    for i in range(3):
        row = []
        for j in range(3):
            block = lame * slopes(i, j, i, j) + shear * slopes(j, i, i, j)
            if i == j:
                block = block + shear * sum(slopes(k, k, i, j) for k in range(3))
            row.append(block)
        rows.append(np.concatenate(row, axis=1))
    values = np.linalg.eigvalsh(np.concatenate(rows) / material.density)
    # A displacement along an axis is the opposite of its image across it only, a turn across the other two.
    rigid = 1 if symmetry.count(-1) in (1, 2) else 0
    return np.asarray(np.sqrt(values[rigid:]) / (2.0 * np.pi))


def _along(order: int) -> tuple[FloatArray, FloatArray]:
    """Integrals over -1 to 1 of slope times value, and slope times slope, of unit Legendre polynomials."""
    points, weights = legendre.leggauss(order + 2)
    unit = np.sqrt(np.arange(order + 1) + 0.5)
    values = legendre.legvander(points, order) * unit
    slopes = np.stack(
        [legendre.legval(points, legendre.legder(np.eye(order + 1)[k])) * unit[k] for k in range(order + 1)],
        axis=1,
    )
    return (slopes * weights[:, None]).T @ values, (slopes * weights[:, None]).T @ slopes


def _kept(degrees: IntArray, component: int, symmetry: Symmetry) -> BoolArray:
    """Which products of polynomials have the parity that ``component`` of such a motion has."""
    odd = [(symmetry[axis] == 1) == (axis == component) for axis in range(3)]
    return np.asarray((degrees % 2 == np.array(odd, dtype=np.int64)).all(axis=1))
