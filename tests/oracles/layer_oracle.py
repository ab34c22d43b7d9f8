"""Round contacts of an elastic layer, solved on a line instead of a surface: what forces are held against.

A pressure ``p(r) = E*/2 integral q A(q) J0(q r) dq`` with ``A(q) = integral_0^a f(t) cos(q t) dt`` vanishes
beyond ``a``; that the surface follows the object within is an integral equation of the second kind for ``f``
(Lebedev and Ufliand, PMM 22, 1958; its flat punches are tabulated by Hayes et al., J. Biomechanics 5, 1972).
Nothing here has pixels, transforms or a search.
"""

import numpy as np
from scipy.optimize import brentq

from harness.basics.arrays import FloatArray
from harness.sim.gel.elastic import taken_back

_NODES = 80
_WAVES, _WEIGHTS = np.polynomial.legendre.leggauss(600)
_WAVES, _WEIGHTS = 15.0 * (_WAVES + 1.0), 15.0 * _WEIGHTS


def flat_force(radius: float, depth: float, thickness: float, poisson: float) -> float:
    """Force over the plane strain modulus, m^2, of a flat round punch."""
    return _solved(radius, depth, 0.0, thickness, poisson)[0]


def ball_force(radius: float, depth: float, thickness: float, poisson: float) -> float:
    """The same of a paraboloid of that radius at its apex, pressed ``depth`` deep."""
    wide = np.sqrt(radius * depth)

    def edge(at: float) -> float:
        return _solved(at, depth, 1.0 / radius, thickness, poisson)[1]

    at = float(brentq(edge, 0.5 * wide, 2.5 * wide))
    return _solved(at, depth, 1.0 / radius, thickness, poisson)[0]


def _solved(
    radius: float, depth: float, curvature: float, thickness: float, poisson: float
) -> tuple[float, float]:
    """Force over the modulus, and ``f`` at the contact's edge, which is zero where the object is smooth."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    t, weights = 0.5 * radius * (nodes + 1.0), 0.5 * radius * weights
    taken = (1.0 - (1.0 + taken_back(_WAVES, poisson))) * _WEIGHTS

    def kernel(at: FloatArray) -> FloatArray:
        waves = (np.cos(np.outer(place, _WAVES) / thickness) for place in (at, t))
        one, other = waves
        return np.asarray((2.0 / np.pi) * (one * taken) @ other.T * weights / thickness)

    def rest(at: FloatArray) -> FloatArray:
        return np.asarray((2.0 / np.pi) * (depth - curvature * at**2))

    f = np.linalg.solve(np.eye(_NODES) - kernel(t), rest(t))
    rim = np.array([radius])
    return float(np.pi * weights @ f), float((rest(rim) + kernel(rim) @ f)[0])
