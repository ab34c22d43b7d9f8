"""What hypotheses are drawn from, round by round: those of the round before, each widened by a Gaussian.

Where a place can be exchanged for errors that contacts share the posterior is a thin slanted ellipsoid in ten
dimensions, which a Gaussian along the axes misses nearly always: few draws then carry all the weight. A place
is therefore carried along with the shared errors as hypotheses nearby say that it goes with them, and what is
left of it is drawn in the shape that it has among neighbours, so that places far apart do not widen it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist

from experiments.contact_localization.posterior.hypotheses import Hypotheses, normalised
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.shared_errors import UNKNOWNS, log_prior
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled

_PLACE = (0.8e-3, 0.8e-3, 0.6e-3)
_YAW_KNOWN = np.radians(0.8)
_YAW_UNKNOWN = np.radians(1.5)
"""The first round's widths, metres and rad; of all that follows the units. Shared errors are in sigmas."""

_NARROW = 0.65
"""Times as wide in place and yaw is what is taken to be known of a round's shape before it is looked at."""

_NEIGHBOURS = 5.0
"""Units within which two hypotheses are of one neighbourhood: 4 mm, or 4 degrees where the yaw is known."""

_LOOKED_AT = 300
_SMOOTHING = 0.7
"""Times as wide as its neighbourhood is a place's Gaussian: what a few hundred hypotheses are smoothed by
(Silverman, Density Estimation, 1986, section 4.3)."""

_STEP = 0.75
"""Of the shared errors between rounds, in their spread; 1 forgets the parents."""

_BELIEVED = 20.0
"""Hypotheses that the shape known beforehand counts for."""

_FLATTENED = (4.0, 2.0)
"""Where the yaw is unknown, what the first rounds' nats are divided by before parents are chosen: a grid of
2 mm and 2 degrees may have nothing of a mode but what is ten nats below its best."""


@dataclass(frozen=True, eq=False)
class _Axes:
    """Places as points: the contacts' middle, and the yaw where readings depend on it.

    About the middle a turn moves no contact far: drawn so, place and yaw of a good hypothesis make another.
    """

    search: Search
    middle: FloatArray

    @property
    def _yaw(self) -> float | None:
        if not self.search.yaw_observable:
            return None
        return float(_YAW_KNOWN if self.search.prior.yaw == "known" else _YAW_UNKNOWN)

    def of(self, at: Hypotheses) -> FloatArray:
        """``(n, 3 or 4)`` in units."""
        places = (at.gels + self.search.prior.object_from_base(at.yaws) @ self.middle) / _PLACE
        return places if self._yaw is None else np.column_stack([places, at.yaws / self._yaw])

    def hypotheses(self, points: FloatArray, shared: FloatArray, log_density: FloatArray) -> Hypotheses:
        """Of ``(n, 3 or 4)`` points in units and ``(n, 6)`` shared errors, drawn from a density."""
        yaws = np.zeros(len(points)) if self._yaw is None else points[:, 3] * self._yaw
        gels = points[:, :3] * _PLACE - self.search.prior.object_from_base(yaws) @ self.middle
        return Hypotheses(gels, yaws, -log_density, shared, log_density)


@dataclass(frozen=True, eq=False)
class _Shape:
    """Of the hypotheses of a round, in the neighbourhood of one.

    Attributes:
        carried: ``(d, 6)`` units of place for each sigma of a shared error.
        left: ``(d, d)`` lower triangular: a factor of the covariance of what is left of a place.
        shared: ``(6, 6)`` lower triangular: of the shared errors'.
        mean: ``(6,)`` of the shared errors.
    """

    carried: FloatArray
    left: FloatArray
    shared: FloatArray
    mean: FloatArray

    @classmethod
    def of(cls, places: FloatArray, shared: FloatArray, effective: float, width: float) -> "_Shape":
        """From hypotheses all of one weight, of which few say little: by their number they count.

        Args:
            places: ``(n, d)`` in units.
            shared: ``(n, 6)`` in sigmas.
            effective: how many hypotheses they stand for.
            width: units of a place, believed beforehand.
        """
        axes, points = places.shape[1], np.hstack([places, shared])
        squares, pairs = of_pairs(points, cdist(places, places) < _NEIGHBOURS)
        believed = np.diag([(width / _SMOOTHING) ** 2] * axes + [1.0] * UNKNOWNS)
        counts = effective / (effective + _BELIEVED)
        both: AnyArray = counts * (0.5 / pairs) * squares + (1.0 - counts) * believed
        carried = np.linalg.solve(both[axes:, axes:], both[axes:, :axes]).T
        left: AnyArray = both[:axes, :axes] - carried @ both[axes:, :axes]
        mean = counts * shared.mean(axis=0)
        return cls(carried, np.linalg.cholesky(left), np.linalg.cholesky(both[axes:, axes:]), mean)


def of_pairs(points: FloatArray, near: BoolArray) -> tuple[FloatArray, int]:
    """``(d, d)``: the sum of ``(a - b)(a - b)^T`` over ordered pairs of ``(n, d)`` points, and their number.

    Args:
        points: of which pairs are made.
        near: ``(n, n)`` symmetric: which pairs count.
    """
    points = points - points.mean(axis=0)  # squares are subtracted
    partners = near.sum(axis=1)
    own = (points * partners[:, None]).T @ points
    across = points.T @ (near.astype(np.float64) @ points)
    return np.asarray(2.0 * (own - across), dtype=np.float64), int(partners.sum())


def drawn(
    search: Search, members: IntArray, current: Hypotheses, draws: int, attempt: int, rng: np.random.Generator
) -> Hypotheses:
    """Hypotheses, each weighed by one over the density it is drawn from.

    The density is that of the whole mixture, so that none is favoured for having many neighbours (Cappé et
    al., Population Monte Carlo, JCGS 13(4), 2004), nor for being chosen more often than it weighs. Shared
    errors that were not named before are drawn from their prior, and have the prior's density.

    Args:
        search: the run.
        members: ``(m,)`` indices of the contacts that count.
        current: what is drawn from.
        draws: how many.
        attempt: rounds before this one.
        rng: of the draws.
    """
    axes = _Axes(search, search.positions[members].mean(axis=0))
    places, weights = axes.of(current), current.weights
    chosen = systematic(_chosen_by(search, current, attempt), draws, rng)
    parents, repeats = np.unique(chosen, return_counts=True)
    steps = rng.normal(size=(draws, places.shape[1])), rng.normal(size=(draws, UNKNOWNS))
    if current.shared is None:
        points = np.repeat(places[parents], repeats, axis=0) + steps[0]
        log_density = _mixture(points, places[parents], repeats / draws) + log_prior(steps[1])
        return axes.hypotheses(points, steps[1], log_density)
    few = systematic(weights, _LOOKED_AT, rng)
    shape = _Shape.of(places[few], current.shared[few], current.effective, _NARROW**attempt)
    centres = _whitened(shape, places[parents], current.shared[parents])
    # Drawn towards their mean by what the step adds, shared errors keep their spread.
    centres[:, -UNKNOWNS:] *= np.sqrt(1.0 - _STEP**2)
    points = np.repeat(centres, repeats, axis=0) + np.hstack(steps)
    log_density = _mixture(points, centres, repeats / draws)
    return axes.hypotheses(*_unwhitened(shape, points), log_density)


def _chosen_by(search: Search, current: Hypotheses, attempt: int) -> FloatArray:
    """``(n,)`` shares of the draws: the weights, flatter in the first rounds where the yaw is unknown."""
    if search.prior.yaw == "known" or attempt >= len(_FLATTENED):
        return current.weights
    return normalised(current.log_weights / _FLATTENED[attempt])


def systematic(weights: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    """``(count,)`` rising indices, each as often as its weight asks for, but for one."""
    marks = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks), len(weights) - 1).astype(np.int64)


def _whitened(shape: _Shape, places: FloatArray, shared: FloatArray) -> FloatArray:
    """``(n, d + 6)``, in which a draw is one standard normal step from its parent."""
    left = solve_triangular(_SMOOTHING * shape.left, (places - shared @ shape.carried.T).T, lower=True)
    errors = solve_triangular(_STEP * shape.shared, (shared - shape.mean).T, lower=True)
    return np.ascontiguousarray(np.vstack([left, errors]).T)


def _unwhitened(shape: _Shape, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places in units and shared errors in sigmas, of points as ``_whitened`` gives them."""
    shared = shape.mean + points[:, -UNKNOWNS:] @ (_STEP * shape.shared).T
    places = points[:, :-UNKNOWNS] @ (_SMOOTHING * shape.left).T + shared @ shape.carried.T
    return places, shared


@compiled
def _mixture(points: FloatArray, centres: FloatArray, shares: FloatArray) -> FloatArray:
    result = np.empty(len(points))
    for i in range(len(points)):
        total = 0.0
        for j in range(len(centres)):
            gap = 0.0
            for d in range(points.shape[1]):
                gap += (points[i, d] - centres[j, d]) ** 2
                # Most centres are far in place already.
                if gap >= 60.0:
                    break
            if gap < 60.0:
                total += shares[j] * np.exp(-0.5 * gap)
        result[i] = np.log(total)
    return result
