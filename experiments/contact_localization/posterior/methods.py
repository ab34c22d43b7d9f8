"""The ways to a posterior: the grid with images and sound, sound alone, and the paper's filter."""

import time
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.posterior.consistency import likeness_of, refuse_bad_fit
from experiments.contact_localization.posterior.dials import METHOD, PARTICLES, ROUNDS, SAMPLES, SENSES
from experiments.contact_localization.posterior.grid import on_samples, refine
from experiments.contact_localization.posterior.hypotheses import Hypotheses, anchors
from experiments.contact_localization.posterior.particle import particle_filter
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.sound.evidence import StrikeEvidence
from experiments.contact_localization.sound.places import by_sound
from harness.basics.arrays import FloatArray, IntArray
from harness.effects.accuracy import Accuracy

_UNKNOWN_YAW_FACTOR = 4
_ANCHORS = 3
_SUSPICIOUS_BELOW = -8.0


@dataclass(frozen=True, eq=False)
class PosteriorSolution:
    """Hypotheses with how the best of them fits.

    Attributes:
        hypotheses: the posterior.
        members: ``(m,)`` indices of the contacts whose image counts.
        fits: ``(m,)`` nats of each at the best hypothesis.
        pictured: whether pictures along the tool say where a hypothesis' contact lies; without, it
            is the sample nearest to where the tool ended.
    """

    hypotheses: Hypotheses
    members: IntArray
    fits: FloatArray
    pictured: bool = True


def solve_run(
    search: Search,
    count: int,
    accuracy: Accuracy,
    seed: int,
    seconds: dict[str, float],
    heard: StrikeEvidence | None,
) -> PosteriorSolution:
    """The posterior of the first ``count`` contacts.

    Args:
        search: the run.
        count: contacts that are used.
        accuracy: the method and its dials.
        seed: of the draws inside the method.
        seconds: by stage; what is spent here is added.
        heard: what their strikes said; None without.

    Raises:
        FitRefused: no image shows a contact, and no sound is asked for alone.
    """
    if accuracy.of(SENSES) == "audio":
        assert heard is not None
        return _by_sound(search, count, heard, seconds)
    members = search.members(count)
    if len(members) == 0:
        refuse_bad_fit(search, members, np.empty(0))
    if accuracy.of(METHOD) == "particle":
        return _by_particles(search, count, members, accuracy, seed, seconds)
    best: PosteriorSolution | None = None
    clear = -np.inf
    for anchor in anchors(members, _ANCHORS):
        found = _by_grid(search, members, int(anchor), accuracy, seed, seconds, heard)
        likeness = likeness_of(search, members, found.fits)
        if best is None or likeness.margin > clear:
            best, clear = found, likeness.margin
        of_anchor = float(found.fits[np.nonzero(members == anchor)[0][0]])
        if min(of_anchor, likeness.typical) > _SUSPICIOUS_BELOW and likeness.margin > 0.0:
            break
    assert best is not None
    return best


def _by_grid(
    search: Search,
    members: IntArray,
    anchor: int,
    accuracy: Accuracy,
    seed: int,
    seconds: dict[str, float],
    heard: StrikeEvidence | None,
) -> PosteriorSolution:
    start = time.perf_counter()
    coarse = on_samples(search, members, anchor, heard)
    lap(seconds, "grid", start)
    start = time.perf_counter()
    samples = accuracy.of(SAMPLES) * (1 if search.prior.yaw == "known" else _UNKNOWN_YAW_FACTOR)
    refined = refine(search, coarse, members, samples, accuracy.of(ROUNDS), seed, heard)
    fits = search.gates(refined.top, members)
    lap(seconds, "refine", start)
    return PosteriorSolution(refined, members, fits)


def _by_sound(
    search: Search, count: int, heard: StrikeEvidence, seconds: dict[str, float]
) -> PosteriorSolution:
    start = time.perf_counter()
    everyone = np.arange(count, dtype=np.int64)
    found = by_sound(search, heard.term, heard.struck, everyone)
    lap(seconds, "grid", start)
    return PosteriorSolution(found, np.empty(0, dtype=np.int64), np.empty(0), pictured=False)


def _by_particles(
    search: Search, count: int, members: IntArray, accuracy: Accuracy, seed: int, seconds: dict[str, float]
) -> PosteriorSolution:
    start = time.perf_counter()
    particles = particle_filter(search, count, accuracy.of(PARTICLES), seed)
    rotations = search.prior.object_from_base(particles.yaws)
    last = count - 1
    inward = rotations @ search.axes[last]
    gels_at_last = particles.points + search.contacts[last].indentation * inward
    gels = gels_at_last - rotations @ search.positions[last]
    found = Hypotheses(gels, particles.yaws, particles.log_weights)
    fits = search.gates(found.top, members)
    lap(seconds, "particles", start)
    return PosteriorSolution(found, members, fits)


def lap(seconds: dict[str, float], stage: str, start: float) -> None:
    """Add the time since ``start``, of ``time.perf_counter``, to a stage."""
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
