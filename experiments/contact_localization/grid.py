"""The exact posterior over a grid of places and yaws, then refined between the grid's points."""

from dataclasses import dataclass, replace

import numpy as np

from experiments.contact_localization.heard import Heard
from experiments.contact_localization.hypotheses import Hypotheses, best_of
from experiments.contact_localization.model import Prior
from experiments.contact_localization.search import Search
from experiments.contact_localization.shared_errors import UNKNOWNS, around, log_prior, stepped
from harness.arrays import FloatArray, IntArray
from harness.sim.compiled import compiled

_DROPPED_AT = 18.0
_WORTH_A_LOOK = 12.0
_MOST_LOOKS = 3000
_DRAWS_EACH = 4.0
_FILLED = 0.15
_WIDTH = np.array([0.8e-3, 0.8e-3, 0.6e-3])
_NARROW = 0.65
"""Times as wide are the draws of a round as those of the one before."""

_STEP = 0.75
"""Of the shared errors between rounds, in their sigmas."""


def on_samples(search: Search, members: IntArray, anchor: int, heard: Heard | None = None) -> Hypotheses:
    """The posterior over surface samples and yaws: places first, then coarse images, then fine ones.

    Args:
        search: the run.
        members: ``(m,)`` indices of the contacts that count.
        anchor: the one of them that a hypothesis puts on a sample.
        heard: what the strikes said; None without.
    """
    start = search.grid(members, anchor)
    told = np.zeros(len(start.yaws))
    if heard is not None:
        # Sound costs no picture: what it rules out is never looked at.
        told = heard.nats(search, start)
        kept = best_of(start.log_weights + told, _DROPPED_AT, len(told))
        start, told = start.taken(kept, start.log_weights[kept]), told[kept]
    looked = search.look(replace(start, log_weights=told), members, _DROPPED_AT)
    closer = looked.best(_WORTH_A_LOOK, _MOST_LOOKS)
    search.settle(closer.yaws)
    return _weighed(search, replace(closer, log_weights=np.zeros(len(closer.yaws))), members, 2, 1, heard)


def refine(
    search: Search,
    start: Hypotheses,
    members: IntArray,
    samples: int,
    rounds: int,
    seed: int,
    heard: Heard | None = None,
) -> Hypotheses:
    """The posterior in continuous place, yaw and shared errors, by repeated importance sampling.

    Each round draws from the last round's hypotheses widened by a Gaussian and weighs by the
    posterior over the whole mixture it drew from (Cappé et al., Population Monte Carlo, JCGS
    13(4), 2004), so that no draw is favoured for having many neighbours. Errors that all contacts share
    (``shared_errors``) are not in the grid; the first round draws them from their prior.

    Args:
        search: the run.
        start: the grid's hypotheses, weighed with their images.
        members: ``(m,)`` indices of the contacts that count.
        samples: least draws a round; a wide posterior gets up to five times as many.
        rounds: most rounds, each narrower; they end early where the draws already fill the
            posterior, because a further round would only lose places by chance. 0 returns ``start``.
        seed: of the draws.
        heard: what the strikes said; None without.
    """
    rng = np.random.default_rng(seed)
    current = start
    for attempt in range(rounds):
        draws = int(np.clip(_DRAWS_EACH * _perplexity(current.weights), samples, 5 * samples))
        drawn = _Kernel.of_round(search, members, attempt).draw(current, draws, rng)
        step = 1 if attempt == rounds - 1 else 2
        current = _weighed(search, drawn, members, step, 2, heard)
        if 1.0 / np.sum(current.weights**2) > _FILLED * draws:
            break
    return current


@dataclass(frozen=True, eq=False)
class _Kernel:
    """What a round's draws are widened by: a Gaussian of place and yaw, a step of the shared errors.

    The place is that of the contacts' middle, about which a turn moves none of them far: drawn so, place and
    yaw of a good hypothesis make another good one.
    """

    prior: Prior
    middle: FloatArray
    width: FloatArray
    turn: float

    @classmethod
    def of_round(cls, search: Search, members: IntArray, attempt: int) -> "_Kernel":
        narrower, middle = _NARROW**attempt, search.positions[members].mean(axis=0)
        return cls(search.prior, middle, _WIDTH * narrower, _turn(search) * narrower)

    def _middles(self, gels: FloatArray, yaws: FloatArray, way: float = 1.0) -> FloatArray:
        """Places of the contacts' middle from those of the first gel, or with -1 back."""
        return np.asarray(gels + way * (self.prior.object_from_base(yaws) @ self.middle))

    def draw(self, current: Hypotheses, draws: int, rng: np.random.Generator) -> Hypotheses:
        """Hypotheses, each weighed by one over the density it is drawn from.

        Shared errors that were not named before are drawn from their prior, and what is drawn from the prior
        has the prior's density.
        """
        parents = _systematic(current.weights, draws, rng)
        places = self._middles(current.gels, current.yaws)
        drawn = places[parents] + rng.normal(size=(draws, 3)) * self.width
        yaws = current.yaws[parents] + rng.normal(size=draws) * self.turn
        unique, repeats = np.unique(parents, return_counts=True)
        points, centres = [drawn / self.width], [places[unique] / self.width]
        if self.turn > 0.0:
            points.append(yaws[:, None] / self.turn)
            centres.append(current.yaws[unique, None] / self.turn)
        if current.shared is None:
            shared = rng.normal(size=(draws, UNKNOWNS))
            named: FloatArray | float = log_prior(shared)
        else:
            shared, named = stepped(current.shared[parents], _STEP, rng), 0.0
            points.append(shared / _STEP)
            centres.append(around(current.shared[unique], _STEP) / _STEP)
        log_density = _mixture(np.hstack(points), np.hstack(centres), repeats / draws) + named
        gels = self._middles(drawn, yaws, -1.0)
        return Hypotheses(gels, yaws, -log_density, shared)


def _weighed(
    search: Search, at: Hypotheses, members: IntArray, step: int, rings: int, heard: Heard | None
) -> Hypotheses:
    """Those worth a weight, with what images and sound say added to theirs."""
    touched = search.weigh(at, members, step, rings, _DROPPED_AT)
    if heard is None:
        return touched
    # A hammer strikes within a millimetre of where it is aimed: shared errors, less than that, do not show
    # in sound, and what its modes are wrong by would only be taken for them.
    return touched.told(heard.nats(search, touched, between=True))


def _turn(search: Search) -> float:
    """rad, one sigma of the first round's draws; a yaw that nothing shows is left alone."""
    if not search.yaw_observable:
        return 0.0
    return float(np.radians(0.8 if search.prior.yaw == "known" else 1.5))


def _perplexity(weights: FloatArray) -> float:
    """How many equal weights would be as undecided as these."""
    positive = weights[weights > 0.0]
    return float(np.exp(-np.sum(positive * np.log(positive))))


def _systematic(weights: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    marks = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks), len(weights) - 1).astype(np.int64)


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
