"""The paper's particle filter over places on the surface (ObjectFolder 2.0, section 5.2).

Particles start uniformly over the surface. At each contact they are weighed by the
similarity between what was read and what would have been read at the particle, resampled,
and carried on by the arm's translation to the next contact, where each is put back on the
surface. The ten most similar particles are the candidates; their mean is the answer.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.posterior.hypotheses import normalised, systematic
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.kernels import similarities_at
from harness.basics.arrays import FloatArray, IntArray

Similarity = Callable[[int, IntArray, FloatArray], FloatArray | None]
"""Of a contact's reading to what particles would read, from the contact's index, the particles' ``(n,)``
samples and ``(n,)`` yaws: ``(n,)`` from -1 to 1; None for a contact that says nothing."""


_BEHIND = 1.5e-3
"""Metres behind the first surface at which a place cannot be touched, and its similarity is 0."""


CANDIDATES = 10


_EVERY = 5
"""Of the grid's yaws one in five: the filter's cosine hardly changes over 10 degrees."""


TEMPERATURE = 0.05
"""Of the weight ``exp(cosine / temperature)``; the paper states none, with 1 it hardly converges."""


@dataclass(frozen=True, eq=False)
class Particles:
    """Where the filter believes the last contact to be."""

    points: FloatArray  #: ``(n, 3)`` metres, on the surface.
    yaws: FloatArray  #: ``(n,)`` rad away from the nominal one.
    log_weights: FloatArray  #: ``(n,)`` nats, the greatest 0.

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

    def similarity(contact: int, at: IntArray, yaws: FloatArray) -> FloatArray | None:
        """Cosines between what the gel read and what it would have read at each particle."""
        if not search.contacts[contact].shows_contact:
            return None
        reading, points, pictures = search.touch(contact).reading, surface.points[at], search.pictures(yaws)
        result = np.zeros(len(at))
        for picture in np.unique(pictures):
            chosen = np.nonzero(pictures == picture)[0]
            view = search.view(contact, int(picture))
            places = points[chosen] @ view.object_from_view
            result[chosen] = similarities_at(view.origin, view.pitch, view.depth, reading, places, _BEHIND)
        return result

    surface = search.surface
    return filtered(search, count, similarity, particles, seed)


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
    yaws = np.zeros(particles)
    if search.prior.yaw == "unknown":
        few = search.yaws[::_EVERY]
        yaws = few[rng.integers(0, len(few), particles)]
    log_weights = np.zeros(particles)
    for k in range(count):
        if k > 0:
            weights = normalised(log_weights)
            if 1.0 / np.sum(weights**2) < 0.5 * particles:
                chosen = systematic(weights, particles, rng)
                at, yaws, log_weights = at[chosen], yaws[chosen], np.zeros(particles)
            moved = search.prior.object_from_base(yaws) @ (search.positions[k] - search.positions[k - 1])
            at = np.asarray(surface.tree.query(surface.points[at] + moved)[1], dtype=np.int64)
        alike = similarity(k, at, yaws)
        if alike is not None:
            log_weights = log_weights + alike / TEMPERATURE
            log_weights -= log_weights.max()
    return Particles(surface.points[at], yaws, log_weights)
