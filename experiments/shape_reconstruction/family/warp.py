"""What the family cannot bend to: contacts that are off its surface move the surface near them."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from harness.basics.arrays import FloatArray

LENGTH = 15.0e-3
"""M over which a displacement dies away."""

AMPLITUDE = 3.0e-3
"""M: one standard deviation of a displacement where nothing was read."""

FAR = 45.0e-3
"""M over which a shape of the wrong class is off alike."""


def displacement(
    places: FloatArray, offsets: FloatArray, sigma: FloatArray, queries: FloatArray, far: float = 0.0
) -> FloatArray:
    """The mean of a Gaussian process of displacements, squared-exponential, each axis by itself.

    A surface is moved by vectors, not along its normals by amounts, so that both sides of a wall go together.

    Args:
        places: ``(n, 3)`` m.
        offsets: ``(n, 3)`` m that the surface is displaced by there.
        sigma: ``(n,)`` m, one standard deviation of those, greater than zero.
        queries: ``(m, 3)`` m.
        far: m, one standard deviation of displacements that die away over ``FAR``; none by default.

    Returns:
        ``(m, 3)`` m; zero far from all places.
    """
    if len(places) == 0:
        return np.zeros_like(queries)
    covariance = _kernel(places, places, far) + np.diag(sigma**2)
    weights = cho_solve(cho_factor(covariance, lower=True), offsets)
    return np.asarray(_kernel(queries, places, far) @ weights)


def _kernel(a: FloatArray, b: FloatArray, far: float) -> FloatArray:
    squares = cdist(a, b, "sqeuclidean")
    near = _falling(squares, AMPLITUDE, LENGTH)
    return np.asarray(near + _falling(squares, far, FAR) if far > 0.0 else near)


def _falling(squares: FloatArray, amplitude: float, length: float) -> FloatArray:
    """A squared-exponential covariance at squared distances; made in one array, which is large."""
    found = squares * (-0.5 / length**2)
    np.exp(found, out=found)
    found *= amplitude**2
    return found
