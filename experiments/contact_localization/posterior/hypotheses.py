"""What the search is about: contacts, places they may have been, and how noisy everything is."""

from dataclasses import dataclass, replace

import numpy as np

from harness.basics.arrays import FloatArray, IntArray

_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Weighted places of the gel's centre at the first contact."""

    gels: FloatArray  #: ``(n, 3)`` metres, in the object's frame.
    yaws: FloatArray  #: ``(n,)`` rad away from the nominal one.
    log_weights: FloatArray  #: ``(n,)`` nats, the greatest 0.
    shared: FloatArray | None = None
    """``(n, 6)`` errors that all contacts share (``noise.SharedNoise``); None where not named."""
    log_drawn: FloatArray | None = None
    """``(n,)`` nats, up to a constant: the density that each was drawn from, by one over which it is weighed;
    None where all were drawn alike."""

    @property
    def weights(self) -> FloatArray:
        """``(n,)``, summing to 1."""
        return normalised(self.log_weights)

    @property
    def effective(self) -> float:
        """How many equal weights would make as sure a mean (Kong, 1992): one over the sum of squares."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def perplexity(self) -> float:
        """How many equal weights would be as undecided as these."""
        positive = self.weights[self.weights > 0.0]
        return float(np.exp(-np.sum(positive * np.log(positive))))

    def told(self, nats: FloatArray) -> "Hypotheses":
        """With ``(n,)`` nats more, up to a constant."""
        total = self.log_weights + nats
        return replace(self, log_weights=total - total.max(initial=-np.inf))

    def best(self, within: float, most: int) -> "Hypotheses":
        """Those within so many nats of the best, evenly thinned where they are more than ``most``."""
        kept = best_of(self.log_weights, within, most)
        if len(kept) == len(self.log_weights):
            return self
        return self.taken(kept, self.log_weights[kept])

    def taken(self, chosen: IntArray, log_weights: FloatArray) -> "Hypotheses":
        """Those of ``(m,)`` indices, with other weights."""
        shared = None if self.shared is None else self.shared[chosen]
        drawn = None if self.log_drawn is None else self.log_drawn[chosen]
        return Hypotheses(self.gels[chosen], self.yaws[chosen], log_weights, shared, drawn)

    @property
    def top(self) -> "Hypotheses":
        """The most probable one alone: of the greatest density, which its weight is not.

        A draw from the far tail of what it was drawn from weighs much however badly it fits.
        """
        density = self.log_weights if self.log_drawn is None else self.log_weights + self.log_drawn
        best = int(np.argmax(density))
        return self.taken(np.array([best], dtype=np.int64), np.zeros(1))


def anchors(members: IntArray, most: int) -> IntArray:
    """At most ``most`` of ``(m,)`` contacts, evenly among them, that hypotheses are hung on in turn.

    A hypothesis hangs on its anchor: where that contact slid off an edge, another must carry the others.
    """
    spread = np.linspace(0, len(members) - 1, min(most, len(members)))
    return members[np.unique(spread.astype(np.int64))]


def normalised(log_weights: FloatArray) -> FloatArray:
    """``(n,)`` weights summing to 1, of ``(n,)`` nats the greatest of which is 0."""
    weights = np.exp(log_weights)
    return np.asarray(weights / weights.sum())


def systematic(weights: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    """``(count,)`` rising indices, each as often as its weight asks for, but for one."""
    marks = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks), len(weights) - 1).astype(np.int64)


def best_of(log_weights: FloatArray, within: float, most: int) -> IntArray:
    """Rising indices within so many nats of the best; of more than ``most``, an even choice of ``most``.

    Hypotheses come in the samples' random order with the yaws of each in turn, so any even choice
    covers the surface; one without a period covers the yaws too (a stride that their number
    divides would keep one yaw of all). Multiples of the golden section, modulo 1, are such a choice.
    """
    kept = np.nonzero(log_weights > log_weights.max() - within)[0].astype(np.int64)
    if len(kept) <= most:
        return kept
    ranks = np.mod(np.arange(len(kept)) * _GOLDEN, 1.0)
    return np.asarray(kept[np.sort(np.argpartition(ranks, most)[:most])])
