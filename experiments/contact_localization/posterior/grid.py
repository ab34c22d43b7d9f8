"""The exact posterior over a grid of places and yaws, then refined between the grid's points."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist

from experiments.contact_localization.posterior.hypotheses import Hypotheses, best_of, normalised, systematic
from experiments.contact_localization.posterior.likelihood import UNKNOWNS, log_prior
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.strikes import StrikeEvidence
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled

_DROPPED_AT = 18.0


_WORTH_A_LOOK = 12.0


_MOST_LOOKS = 3000


_FILLED = 8000
"""Hypotheses up to which a grid is filled between its samples where the yaw is unknown: steps of 2 mm and 2
degrees leave a sharp place with a hypothesis or two, each millimetres aside."""


_MOST_COPIES = 16


_DRAWS_EACH = 2.0


_ENOUGH = 0.05
"""Of a round's draws, effective."""


_FILLS = 200.0
"""Effective samples of the grid that fill a region 2 mm apart so well that draws need not."""


def on_samples(
    search: Search, members: IntArray, anchor: int, heard: StrikeEvidence | None = None
) -> Hypotheses:
    """The posterior over surface samples and yaws: places first, then coarse images, then fine ones.

    Args:
        search: the run.
        members: ``(m,)`` indices of the contacts that count.
        anchor: the one of them that a hypothesis puts on a sample.
        heard: what the strikes said; None without.
    """
    start = search.grid(members, anchor)
    copies = min(_MOST_COPIES, _FILLED // len(start.yaws)) if search.prior.yaw == "unknown" else 1
    if copies > 1:
        start = between_samples(search, anchor, start, copies)
    told = np.zeros(len(start.yaws))
    if heard is not None:
        # Sound costs no picture: what it rules out is never looked at.
        told = heard.nats(search, start, between=copies > 1)
        kept = best_of(start.log_weights + told, _DROPPED_AT, len(told))
        start, told = start.taken(kept, start.log_weights[kept]), told[kept]
    looked = search.look(replace(start, log_weights=told), members, _DROPPED_AT)
    closer = looked.best(_WORTH_A_LOOK, _MOST_LOOKS)
    search.settle(closer.yaws)
    again = replace(closer, log_weights=np.zeros(len(closer.yaws)))
    touched = search.weigh(again, members, 2, 1, _DROPPED_AT)
    return touched if heard is None else touched.told(heard.nats(search, touched, between=True))


def refine(
    search: Search,
    start: Hypotheses,
    members: IntArray,
    samples: int,
    rounds: int,
    seed: int,
    heard: StrikeEvidence | None = None,
) -> Hypotheses:
    """The posterior in continuous place, yaw and shared errors, by repeated importance sampling.

    Each round draws from the last round's hypotheses and weighs by the posterior over the
    density that it drew from. Errors that all contacts share (``noise.SharedNoise``) are not in the grid; the
    first round draws them from their prior. The answer is the round with the most effective hypotheses, so
    one whose weight falls on few of its draws is none. It is the grid itself where that has more than the
    first round, and enough to fill a region: on a bare floor draws would only lose places that samples hold.

    Args:
        search: the run.
        start: the grid's hypotheses, weighed with their images.
        members: ``(m,)`` indices of the contacts that count.
        samples: least draws a round; a wide posterior gets up to five times as many.
        rounds: most rounds; they end where enough of the draws are effective, because a further round would
            only lose places by chance. 0 returns ``start``.
        seed: of the draws.
        heard: what the strikes said; None without.
    """
    # Sound has chances of its own, so that one which says nothing leaves the answer of touch as it is.
    rng, of_sound = np.random.default_rng(seed), np.random.default_rng((seed, 1))
    best = current = start
    most = start.effective if start.effective > _FILLS else 0.0
    for attempt in range(rounds):
        draws = int(np.clip(_DRAWS_EACH * current.perplexity, samples, 5 * samples))
        at = drawn(search, members, current, draws, attempt, rng)
        touched = search.weigh(at, members, 2, 2, _DROPPED_AT)
        # Shared errors, less than a millimetre, do not show in sound: what its modes are wrong by would only
        # be taken for them. Nor may it move a place by so little.
        current = touched if heard is None else touched.told(heard.nats_of_draws(search, touched, of_sound))
        if current.effective < most and best is start:
            break
        if current.effective > most:
            best, most = current, current.effective
        if most > _ENOUGH * draws:
            break
    return best


_EVENLY = 1.2207440846057596 ** -np.arange(1.0, 4.0)
"""Steps of the additive recurrence that fills three axes evenly, powers of the root of ``x^4 = x + 1``
(Roberts, The unreasonable effectiveness of quasirandom sequences, 2018)."""


def between_samples(search: Search, anchor: int, at: Hypotheses, copies: int) -> Hypotheses:
    """Each hypothesis so many times, spread evenly over what its sample and its yaw of the grid stand for.

    The anchor's place goes along the surface as its tool sees it, up to half the samples' spacing each way,
    and stays there while the object is turned by up to half a step of its yaws.

    Args:
        search: the run.
        anchor: the contact that ``at`` puts on samples.
        at: ``n`` hypotheses of the grid.
        copies: of each.

    Returns:
        ``copies * n``, each weighed as what it is a copy of.
    """
    copied = np.repeat(np.arange(len(at.yaws), dtype=np.int64), copies)
    spread = np.mod(np.arange(1.0, len(copied) + 1.0)[:, None] * _EVENLY, 1.0) - 0.5
    yaws = at.yaws[copied]
    if search.yaw_observable:
        yaws = yaws + search.yaw_step * spread[:, 2]
    turned = search.prior.object_from_base(yaws)
    # From the gel's centre at the first contact to the anchor's place on the surface.
    reach = search.positions[anchor] - search.contacts[anchor].indentation * search.axes[anchor]
    samples = at.gels + search.prior.object_from_base(at.yaws) @ reach
    axes = turned @ search.axes[anchor]
    # Two directions square to each other and to the tool's axis.
    first = np.cross(axes, np.eye(3)[np.argmin(np.abs(axes), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    across = spread[:, :1] * first + spread[:, 1:2] * np.cross(axes, first)
    places = samples[copied] + search.surface.spacing * across
    return Hypotheses(places - turned @ reach, yaws, at.log_weights[copied])


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
    """Of the hypotheses of a round, in the neighbourhood of one."""

    carried: FloatArray  #: ``(d, 6)`` units of place for each sigma of a shared error.
    left: FloatArray  #: ``(d, d)`` lower triangular: a factor of the covariance of what is left of a place.
    shared: FloatArray  #: ``(6, 6)`` lower triangular: of the shared errors'.
    mean: FloatArray  #: ``(6,)`` of the shared errors.

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

    def whitened(self, places: FloatArray, shared: FloatArray) -> FloatArray:
        """``(n, d + 6)``, in which a draw is one standard normal step from its parent."""
        left = solve_triangular(_SMOOTHING * self.left, (places - shared @ self.carried.T).T, lower=True)
        errors = solve_triangular(_STEP * self.shared, (shared - self.mean).T, lower=True)
        return np.ascontiguousarray(np.vstack([left, errors]).T)

    def unwhitened(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places in units and shared errors in sigmas, of points as ``whitened`` gives them."""
        shared = self.mean + points[:, -UNKNOWNS:] @ (_STEP * self.shared).T
        places = points[:, :-UNKNOWNS] @ (_SMOOTHING * self.left).T + shared @ self.carried.T
        return places, shared


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
    # A grid of an unknown yaw may hold little of a mode: the first rounds choose by flatter weights.
    flat = search.prior.yaw == "unknown" and attempt < len(_FLATTENED)
    odds = normalised(current.log_weights / _FLATTENED[attempt]) if flat else weights
    chosen = systematic(odds, draws, rng)
    parents, repeats = np.unique(chosen, return_counts=True)
    steps = rng.normal(size=(draws, places.shape[1])), rng.normal(size=(draws, UNKNOWNS))
    if current.shared is None:
        points = np.repeat(places[parents], repeats, axis=0) + steps[0]
        log_density = _mixture(points, places[parents], repeats / draws) + log_prior(steps[1])
        return axes.hypotheses(points, steps[1], log_density)
    few = systematic(weights, _LOOKED_AT, rng)
    shape = _Shape.of(places[few], current.shared[few], current.effective, _NARROW**attempt)
    centres = shape.whitened(places[parents], current.shared[parents])
    # Drawn towards their mean by what the step adds, shared errors keep their spread.
    centres[:, -UNKNOWNS:] *= np.sqrt(1.0 - _STEP**2)
    points = np.repeat(centres, repeats, axis=0) + np.hstack(steps)
    log_density = _mixture(points, centres, repeats / draws)
    return axes.hypotheses(*shape.unwhitened(points), log_density)


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
