"""The exact posterior over a grid of places and yaws, then refined between the grid's points."""

from dataclasses import replace

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Hypotheses, best_of
from experiments.contact_localization.posterior.proposal import drawn
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.subsampling import between_samples
from experiments.contact_localization.sound.evidence import StrikeEvidence
from harness.basics.arrays import IntArray

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

    Each round draws from the last round's hypotheses (``proposal``) and weighs by the posterior over the
    density that it drew from. Errors that all contacts share (``shared_errors``) are not in the grid; the
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
