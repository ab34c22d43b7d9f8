"""The paper's particle filter over places on the surface (ObjectFolder 2.0, section 5.2).

Particles start uniformly over the surface. At each contact they are weighed by the
similarity between what was read and what would have been read at the particle, resampled,
and carried on by the arm's translation to the next contact, where each is put back on the
surface. The ten most similar particles are the candidates; their mean is the answer.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.posterior.hypotheses import normalised
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import similarities
from harness.basics.arrays import FloatArray, IntArray

Similarity = Callable[[int, IntArray, FloatArray], FloatArray | None]
"""Of a contact's reading to what particles would read, from the contact's index, the particles' ``(n,)``
samples and ``(n,)`` yaws: ``(n,)`` from -1 to 1; None for a contact that says nothing."""

CANDIDATES = 10
_EVERY = 5
"""Of the grid's yaws one in five: the filter's cosine hardly changes over 10 degrees."""

TEMPERATURE = 0.05
"""Of the weight ``exp(cosine / temperature)``; the paper states none, with 1 it hardly converges."""


@dataclass(frozen=True, eq=False)
class Particles:
    """Where the filter believes the last contact to be.

    Attributes:
        points: ``(n, 3)`` metres, on the surface.
        yaws: ``(n,)`` rad away from the nominal one.
        log_weights: ``(n,)`` nats, the greatest 0.
    """

    points: FloatArray
    yaws: FloatArray
    log_weights: FloatArray

    @property
    def weights(self) -> FloatArray:
        """``(n,)``, summing to 1."""
        return normalised(self.log_weights)

    def candidates(self) -> FloatArray:
        """``(10, 3)`` metres: the most probable particles."""
        return np.asarray(self.points[np.argsort(-self.log_weights, kind="stable")[:CANDIDATES]])


def particle_filter(search: Search, count: int, particles: int, seed: int) -> Particles:
    """Run the filter by touch over the first ``count`` contacts.

    Args:
        search: the run.
        count: contacts.
        particles: how many.
        seed: of the start and of the resampling.
    """

    def felt(k: int, at: IntArray, yaws: FloatArray) -> FloatArray | None:
        return _similarity(search, k, at, yaws) if search.contacts[k].shows_contact else None

    return filtered(search, count, felt, particles, seed)


def filtered(
    search: Search,
    count: int,
    similarity: Similarity,
    particles: int,
    seed: int,
) -> Particles:
    """Run the filter by any sense over the first ``count`` contacts.

    Args:
        search: the run.
        count: contacts.
        similarity: of each contact's reading.
        particles: how many.
        seed: of the start and of the resampling.
    """
    rng = np.random.default_rng(seed)
    surface = search.surface
    at = rng.choice(len(surface.points), size=particles, p=surface.areas / surface.areas.sum())
    yaws = _first_yaws(search, particles, rng)
    log_weights = np.zeros(particles)
    for k in range(count):
        if k > 0:
            at, yaws, log_weights = _resampled(at, yaws, log_weights, rng)
            moved = search.prior.object_from_base(yaws) @ (search.positions[k] - search.positions[k - 1])
            at = _nearest(search, surface.points[at] + moved)
        alike = similarity(k, at, yaws)
        if alike is not None:
            log_weights = log_weights + alike / TEMPERATURE
            log_weights -= log_weights.max()
    return Particles(surface.points[at], yaws, log_weights)


def _first_yaws(search: Search, count: int, rng: np.random.Generator) -> FloatArray:
    if search.prior.yaw == "known":
        return np.zeros(count)
    few = search.yaws[::_EVERY]
    return np.asarray(few[rng.integers(0, len(few), count)])


def _similarity(search: Search, contact: int, at: IntArray, yaws: FloatArray) -> FloatArray:
    result = np.zeros(len(at))
    points = search.surface.points[at]
    pictures = search.pictures(yaws)
    for picture in np.unique(pictures):
        chosen = np.nonzero(pictures == picture)[0]
        view = search.view(contact, int(picture))
        places = points[chosen] @ view.object_from_view
        result[chosen] = similarities(view, search.touch(contact), places)
    return result


def _resampled(
    at: IntArray, yaws: FloatArray, log_weights: FloatArray, rng: np.random.Generator
) -> tuple[IntArray, FloatArray, FloatArray]:
    weights = normalised(log_weights)
    count = len(at)
    if 1.0 / np.sum(weights**2) >= 0.5 * count:
        return at, yaws, log_weights
    marks = (np.arange(count) + rng.random()) / count
    chosen = np.minimum(np.searchsorted(np.cumsum(weights), marks), count - 1)
    return at[chosen], yaws[chosen], np.zeros(count)


def _nearest(search: Search, points: FloatArray) -> IntArray:
    return np.asarray(search.surface.tree.query(points)[1], dtype=np.int64)
