"""A field from places of a surface and its normals there: a Gaussian process with a thin-plate prior.

The covariance is that of Williams and Fitzgibbon (Gaussian process implicit surfaces, 2007),
``2 r^3 - 3 R r^2 + R^3``, where ``R`` is ``WIDER`` times what holds all data; values and gradients are both
observed. Its mean is the triharmonic interpolant of Hermite data, its variance says how far the surface may
be from it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled

UNIT = 1.0 / 18.0
"""Amplitude at which gradients are as long as unit normals: of each component a variance of a third."""

_AMPLITUDES = (0.3, 1.0, 3.0, 10.0)
"""Over ``UNIT``, of which the likeliest is taken."""

_JITTER = 1e-10

WIDER = 1.3
"""Times the ball that holds all data, ``R``: over the whole of a ball ``R`` across the covariance of values
and gradients is not positive definite, over one of ``R / 1.2`` it is (eigenvalues for data on balls, spheres,
rings and rods)."""


@dataclass(frozen=True, eq=False)
class SurfaceData:
    """Observations of a field ``f`` that is 0 on a surface and grows outward with slope one."""

    points: FloatArray  #: ``(n, 3)`` m, where ``values`` are known.
    values: FloatArray  #: ``(n,)`` m.
    sigmas: FloatArray  #: ``(n,)`` m, one standard deviation of each value.
    normals: FloatArray  #: ``(n, 3)``, gradients there; ignored where ``normal_sigmas`` is infinite.
    normal_sigmas: FloatArray  #: ``(n,)`` one standard deviation of each component.

    def joined(self, other: "SurfaceData") -> "SurfaceData":
        """Both."""
        return SurfaceData(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.values, other.values]),
            np.concatenate([self.sigmas, other.sigmas]),
            np.concatenate([self.normals, other.normals]),
            np.concatenate([self.normal_sigmas, other.normal_sigmas]),
        )


@dataclass(frozen=True, eq=False)
class ThinPlateField:
    """A fitted field; lengths inside are shares of ``reach``."""

    centre: FloatArray  #: ``(3,)`` m.
    reach: float  #: m, the ``R`` of the covariance.
    data: SurfaceData  #: that it was fitted to.
    weights: FloatArray  #: ``(n, 4)`` of value and gradient at every place.
    factor: FloatArray  #: ``(4 n, 4 n)`` lower Cholesky factor of the covariance of all data.
    amplitude: float  #: of the covariance.

    def values(self, points: FloatArray) -> FloatArray:
        """``(m,)`` m: the mean field at ``(m, 3)`` points."""
        local = self._local(points)
        found = _mean_values(local, self._local(self.data.points), self.weights * self.amplitude)
        return np.asarray(found * self.reach)

    def deviations(self, points: FloatArray) -> FloatArray:
        """``(m,)`` m: one standard deviation of the field at ``(m, 3)`` points."""
        between = self.amplitude * _covariances(self._local(points), self._local(self.data.points), 1)
        solved = solve_triangular(self.factor, between.T, lower=True, check_finite=False)
        variance = self.amplitude - np.einsum("ij,ij->j", solved, solved)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * self.reach)

    def _local(self, points: FloatArray) -> FloatArray:
        return np.ascontiguousarray((points - self.centre) / self.reach)


def fitted(
    data: SurfaceData, low: FloatArray, high: FloatArray, amplitude: float | None = None
) -> ThinPlateField:
    """The field of a roughness, or of the likeliest.

    Args:
        data: one place or more.
        low: ``(3,)`` m, of the box in which the field will be read.
        high: ``(3,)`` m.
        amplitude: of the covariance; None for the likeliest of a few.
    """
    corners = np.concatenate([data.points, low[None], high[None]])
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    reach = WIDER * 2.0 * float(np.linalg.norm(corners - centre, axis=1).max())
    local = np.ascontiguousarray((data.points - centre) / reach)
    prior = _covariances(local, local, 4)
    observed = np.column_stack([data.values / reach, data.normals]).ravel()
    noise = (
        np.column_stack([data.sigmas / reach, np.repeat(data.normal_sigmas[:, None], 3, axis=1)]).ravel() ** 2
    )
    kept = np.isfinite(noise)
    noise[~kept], observed[~kept] = 1.0, 0.0
    prior[~kept], prior[:, ~kept] = 0.0, 0.0  # what is not observed weighs nothing
    best: tuple[float, float, FloatArray, FloatArray] | None = None
    for tried in [a * UNIT for a in _AMPLITUDES] if amplitude is None else [amplitude]:
        total = tried * prior
        total[np.diag_indices_from(total)] += noise + _JITTER * tried
        lower, _ = cho_factor(total, lower=True, overwrite_a=True, check_finite=False)
        lower = np.tril(lower)
        weights = np.asarray(cho_solve((lower, True), observed, check_finite=False))
        likelihood = -0.5 * float(observed @ weights) - float(np.log(np.diag(lower)).sum())
        if best is None or likelihood > best[0]:
            best = likelihood, tried, lower, weights
    assert best is not None
    _, chosen, factor, weights = best
    return ThinPlateField(centre, reach, data, weights.reshape(-1, 4), factor, chosen)


@compiled
def _covariances(at: FloatArray, of: FloatArray, rows: int) -> FloatArray:
    """``(rows m, 4 n)`` covariances of values at ``(m, 3)`` places with all data of ``(n, 3)``.

    With 4 ``rows`` a place, of the value and of the three components of the gradient there; with 1, of the
    value alone.
    """
    found = np.zeros((rows * len(at), 4 * len(of)))
    d = np.empty(3)
    for m in range(len(at)):
        for n in range(len(of)):
            for axis in range(3):
                d[axis] = at[m, axis] - of[n, axis]
            r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            found[rows * m, 4 * n] = 2.0 * r**3 - 3.0 * r * r + 1.0
            for i in range(3):
                found[rows * m, 4 * n + 1 + i] = 6.0 * (1.0 - r) * d[i]
                if rows == 1:
                    continue
                found[rows * m + 1 + i, 4 * n] = -6.0 * (1.0 - r) * d[i]
                for j in range(3):
                    bent = -6.0 * d[i] * d[j] / r if r > 0.0 else 0.0
                    straight = 6.0 * (1.0 - r) if i == j else 0.0
                    found[rows * m + 1 + i, 4 * n + 1 + j] = straight + bent
    return found


@compiled
def _mean_values(at: FloatArray, of: FloatArray, weights: FloatArray) -> FloatArray:
    found = np.zeros(len(at))
    for m in range(len(at)):
        total = 0.0
        for n in range(len(of)):
            x, y, z = at[m, 0] - of[n, 0], at[m, 1] - of[n, 1], at[m, 2] - of[n, 2]
            r2 = x * x + y * y + z * z
            r = np.sqrt(r2)
            total += weights[n, 0] * (2.0 * r * r2 - 3.0 * r2 + 1.0)
            total += 6.0 * (1.0 - r) * (weights[n, 1] * x + weights[n, 2] * y + weights[n, 3] * z)
        found[m] = total
    return found
