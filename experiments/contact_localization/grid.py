"""The exact posterior over a grid of places and yaws, then refined between the grid's points."""

import numpy as np

from experiments.contact_localization.heard import Heard
from experiments.contact_localization.hypotheses import Hypotheses, best_of
from experiments.contact_localization.search import Search
from harness.arrays import FloatArray, IntArray
from harness.sim.compiled import compiled

_DROPPED_AT = 18.0
_WORTH_A_LOOK = 12.0
_MOST_LOOKS = 3000
_DRAWS_EACH = 8.0
_FILLED = 0.15


def on_samples(search: Search, members: IntArray, anchor: int, heard: Heard | None = None) -> Hypotheses:
    """The posterior over surface samples and yaws: places first, then coarse images, then fine ones.

    Args:
        search: the run.
        members: ``(m,)`` indices of the contacts that count.
        anchor: the one of them that a hypothesis puts on a sample.
        heard: what the strikes said; None without.
    """
    start = search.grid(members, anchor)
    if heard is None:
        looked = search.look(start, members, _DROPPED_AT)
    else:
        # Sound costs no picture: what it rules out is never looked at.
        told = heard.nats(search, start.gels, start.yaws)
        total = start.log_weights + told
        kept = best_of(total, _DROPPED_AT, len(total))
        start = Hypotheses(start.gels[kept], start.yaws[kept], start.log_weights[kept])
        looked = search.look(start, members, _DROPPED_AT, told[kept])
    closer = looked.best(_WORTH_A_LOOK, _MOST_LOOKS)
    search.settle(closer.yaws)
    log_weights = _weighed(search, closer.gels, closer.yaws, members, 2, 1, heard)
    return Hypotheses(closer.gels, closer.yaws, log_weights - log_weights.max())


def refine(
    search: Search,
    start: Hypotheses,
    members: IntArray,
    samples: int,
    rounds: int,
    seed: int,
    heard: Heard | None = None,
) -> Hypotheses:
    """The posterior in continuous place and yaw, by repeated importance sampling.

    Each round draws from the last round's hypotheses widened by a Gaussian and weighs by the
    posterior over the whole mixture it drew from (Cappé et al., Population Monte Carlo, JCGS
    13(4), 2004), so that no draw is favoured for having many neighbours.

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
        width = np.array([0.8e-3, 0.8e-3, 0.6e-3]) * 0.65**attempt
        turn = _turn(search) * 0.65**attempt
        parents = _systematic(current.weights, draws, rng)
        gels = current.gels[parents] + rng.normal(size=(draws, 3)) * width
        yaws = current.yaws[parents] + rng.normal(size=draws) * turn
        unique, repeats = np.unique(parents, return_counts=True)
        log_density = _mixture(
            _in_widths(gels, yaws, width, turn),
            _in_widths(current.gels[unique], current.yaws[unique], width, turn),
            repeats / draws,
        )
        finest = attempt == rounds - 1
        step = 1 if finest else 2
        log_weights = _weighed(search, gels, yaws, members, step, 2, heard) - log_density
        current = Hypotheses(gels, yaws, log_weights - log_weights.max())
        if 1.0 / np.sum(current.weights**2) > _FILLED * draws:
            break
    return current


def _weighed(
    search: Search,
    gels: FloatArray,
    yaws: FloatArray,
    members: IntArray,
    step: int,
    rings: int,
    heard: Heard | None,
) -> FloatArray:
    total = search.weigh(gels, yaws, members, step=step, rings=rings)
    return total if heard is None else np.asarray(total + heard.nats(search, gels, yaws, between=True))


def _turn(search: Search) -> float:
    """rad, one sigma of the first round's draws; a yaw that nothing shows is left alone."""
    if not search.yaw_observable:
        return 0.0
    return float(np.radians(0.8 if search.prior.yaw == "known" else 1.5))


def _in_widths(gels: FloatArray, yaws: FloatArray, width: FloatArray, turn: float) -> FloatArray:
    return gels / width if turn == 0.0 else np.column_stack([gels / width, yaws / turn])


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
            if gap < 60.0:
                total += shares[j] * np.exp(-0.5 * gap)
        result[i] = np.log(total)
    return result
