"""Which point of the object was touched: from tactile images and relative arm poses alone."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.gate import Gate, gates, refuse_bad_fit, refuse_inside_out
from experiments.contact_localization.grid import on_samples, refine
from experiments.contact_localization.hypotheses import Contact, Hypotheses, Noise
from experiments.contact_localization.levels import Levels
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.nearest import nearest_point
from experiments.contact_localization.observation import Observation, read_contacts
from experiments.contact_localization.particle import particle_filter
from experiments.contact_localization.posterior import (
    Mode,
    Region,
    best_point,
    credible_radius,
    credible_region,
    modes,
)
from experiments.contact_localization.search import Search
from harness.arrays import FloatArray, IntArray, read_only
from harness.errors import WrongUse

FLOOR = 1.0e-3
"""Metres, one sigma of the errors that all contacts of a run share, fitted to calibration runs."""

_CANDIDATES = 10
_UNKNOWN_YAW_FACTOR = 4
_ANCHORS = 3
_SUSPICIOUS_BELOW = -8.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """The answer to one run.

    Attributes:
        position_in_object: ``(3,)`` metres: the last contact, a point on the surface.
        contacts: ``(contacts, 3)`` metres: all of them, on the surface to half a pixel of a view.
        modes: places the last contact may be, heaviest first.
        region: the part of the surface that holds 90 % of the posterior.
        credible90: metres around the answer that hold 90 % of it.
        candidates: ``(10, 3)`` metres: the most probable distinct hypotheses of the last contact.
        gates: how each contact fits.
        yaw: rad away from the nominal orientation, of the best hypothesis.
        yaw_sigma: rad, circular spread of the posterior.
        points: ``(n, 3)`` metres: hypotheses of the last contact, for pictures.
        weights: ``(n,)`` of the hypotheses, summing to 1.
        seconds: by stage.
    """

    position_in_object: FloatArray
    contacts: FloatArray
    modes: tuple[Mode, ...]
    region: Region
    credible90: float
    candidates: FloatArray
    gates: tuple[Gate, ...]
    yaw: float
    yaw_sigma: float
    points: FloatArray
    weights: FloatArray
    seconds: dict[str, float]


def estimate(
    observations: Sequence[Observation],
    model: Model,
    prior: Prior,
    accuracy: Levels | None = None,
    noise: Noise | None = None,
    seed: int = 0,
) -> Estimate:
    """Localize the last contact.

    Args:
        observations: the contacts, in the order they were made.
        model: object and sensor.
        prior: of the object's orientation.
        accuracy: the method and its levels; the default is the grid at 2 mm.
        noise: of the terms; the default is what calibration runs gave.
        seed: of the draws inside the method.

    Raises:
        FitRefused: no place on this object explains the contacts.
        WrongUse: there are no observations.
    """
    return each_estimate(observations, model, prior, accuracy, noise, seed, first=len(observations))[-1]


def each_estimate(
    observations: Sequence[Observation],
    model: Model,
    prior: Prior,
    accuracy: Levels | None = None,
    noise: Noise | None = None,
    seed: int = 0,
    first: int = 1,
) -> tuple[Estimate, ...]:
    """The estimate after each contact from the ``first`` on; readings are prepared once.

    Estimates of fewer than all contacts are not refused: they are pictures of the way to the
    answer. The last one is as ``estimate`` gives it, and is refused as it is.
    """
    if len(observations) == 0:
        raise WrongUse("no contacts were given; a run needs at least one")
    levels, noise = accuracy or Levels(), noise or Noise()
    started = time.perf_counter()
    contacts = read_contacts(observations, model, levels.block, noise.touch)
    images = time.perf_counter() - started
    return locate(contacts, model, prior, levels, noise, seed, first, images)


def locate(
    contacts: Sequence[Contact],
    model: Model,
    prior: Prior,
    levels: Levels,
    noise: Noise,
    seed: int = 0,
    first: int | None = None,
    image_seconds: float = 0.0,
) -> tuple[Estimate, ...]:
    """As ``each_estimate``, from height maps already recovered."""
    search = Search(contacts, model, prior, levels.spacing, noise)
    count = len(contacts)
    answers = []
    for k in range(count if first is None else first, count + 1):
        seconds = {"images": image_seconds * k / count}
        found = _solve(search, k, levels, seed, seconds)
        # The paper's filter has no measure of fit to be refused by.
        if k == count and levels.method == "grid":
            refuse_bad_fit(search, found.members, found.fits)
            top = int(np.argmax(found.hypotheses.log_weights))
            best = found.hypotheses.gels[top], float(found.hypotheses.yaws[top])
            refuse_inside_out(search, *best, found.members)
        answers.append(_answer(search, k, found, seconds))
    return tuple(answers)


@dataclass(frozen=True, eq=False)
class _Solution:
    """Hypotheses with how the best of them fits."""

    hypotheses: Hypotheses
    members: IntArray
    fits: FloatArray


def _solve(search: Search, count: int, levels: Levels, seed: int, seconds: dict[str, float]) -> _Solution:
    members = search.members(count)
    if len(members) == 0:
        refuse_bad_fit(search, members, np.empty(0))
    if levels.method == "particle":
        return _by_particles(search, count, members, levels, seed, seconds)
    best: _Solution | None = None
    # A hypothesis hangs on its anchor: where that contact slipped, another must carry the others.
    for anchor in _anchors(members):
        found = _by_grid(search, members, int(anchor), levels, seed, seconds)
        if best is None or np.median(found.fits) > np.median(best.fits):
            best = found
        of_anchor = float(found.fits[np.nonzero(members == anchor)[0][0]])
        if min(of_anchor, float(np.median(found.fits))) > _SUSPICIOUS_BELOW:
            break
    assert best is not None
    return best


def _anchors(members: IntArray) -> IntArray:
    spread = np.linspace(0, len(members) - 1, min(_ANCHORS, len(members)))
    return members[np.unique(spread.astype(np.int64))]


def _by_grid(
    search: Search, members: IntArray, anchor: int, levels: Levels, seed: int, seconds: dict[str, float]
) -> _Solution:
    start = time.perf_counter()
    coarse = on_samples(search, members, anchor)
    _lap(seconds, "grid", start)
    start = time.perf_counter()
    samples = levels.samples * (1 if search.prior.yaw == "known" else _UNKNOWN_YAW_FACTOR)
    refined = refine(search, coarse, members, samples, levels.rounds, seed)
    top = int(np.argmax(refined.log_weights))
    fits = search.gates(refined.gels[top], float(refined.yaws[top]), members)
    _lap(seconds, "refine", start)
    return _Solution(refined, members, fits)


def _by_particles(
    search: Search, count: int, members: IntArray, levels: Levels, seed: int, seconds: dict[str, float]
) -> _Solution:
    start = time.perf_counter()
    particles = particle_filter(search, count, levels.particles, seed)
    rotations = search.prior.object_from_base(particles.yaws)
    last = count - 1
    inward = rotations @ search.axes[last]
    gels_at_last = particles.points + search.contacts[last].indentation * inward
    gels = gels_at_last - rotations @ search.positions[last]
    found = Hypotheses(gels, particles.yaws, particles.log_weights)
    top = int(np.argmax(found.log_weights))
    fits = search.gates(gels[top], float(found.yaws[top]), members)
    _lap(seconds, "particles", start)
    return _Solution(found, members, fits)


def _answer(search: Search, count: int, found: _Solution, seconds: dict[str, float]) -> Estimate:
    start = time.perf_counter()
    mesh, hypotheses = search.model.mesh, found.hypotheses
    weights = hypotheses.weights
    clouds, yaws = _everywhere(search, count, hypotheses)
    answers = np.array([best_point(cloud, weights) for cloud in clouds])
    # A view's pixel is off the surface where that curves within it; the answer is not.
    answers[-1] = nearest_point(mesh, answers[-1])
    points = clouds[-1]
    ranked = np.argsort(-hypotheses.log_weights, kind="stable")[:_CANDIDATES]
    top = int(ranked[0])
    turning = complex(np.exp(1j * yaws) @ weights)
    result = Estimate(
        position_in_object=read_only(answers[-1]),
        contacts=read_only(answers),
        modes=modes(points, weights),
        region=credible_region(points, weights, search.surface, FLOOR),
        credible90=credible_radius(points, weights, answers[-1], FLOOR),
        candidates=read_only(points[ranked]),
        gates=gates(search, count, found.members, found.fits),
        yaw=float(yaws[top]),
        yaw_sigma=float(np.sqrt(max(0.0, -2.0 * np.log(max(abs(turning), 1e-12))))),
        points=read_only(points),
        weights=read_only(weights),
        seconds=seconds,
    )
    _lap(seconds, "answer", start)
    return result


def _everywhere(search: Search, count: int, hypotheses: Hypotheses) -> tuple[list[FloatArray], FloatArray]:
    """Each contact's points and the yaws, spread over the turns that the object does not show."""
    clouds = [search.surface_points(k, hypotheses.gels, hypotheses.yaws) for k in range(count)]
    if search.turning is None:
        return clouds, hypotheses.yaws
    turns = search.turning.spread(len(hypotheses.yaws))
    # A point turned with the object is the same reading under a yaw turned the other way.
    return [search.turning.turned(cloud, turns) for cloud in clouds], hypotheses.yaws - turns


def _lap(seconds: dict[str, float], stage: str, start: float) -> None:
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
