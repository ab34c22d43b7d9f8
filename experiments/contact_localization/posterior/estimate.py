"""Locate the contact on the object from tactile images and relative arm poses alone.

Particles start uniformly over the surface. At each contact they are weighted by the
similarity between the reading and the predicted reading at the particle, resampled,
and moved by the arm's translation to the next contact, where each is projected onto the
surface. The ten most similar particles are the candidates; their mean is the answer.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.consistency import (
    Gate,
    gates,
    likeness_of,
    refuse_bad_fit,
    refuse_inside_out,
)
from experiments.contact_localization.posterior.grid import on_samples, refine
from experiments.contact_localization.posterior.hypotheses import Hypotheses, anchors, normalised, systematic
from experiments.contact_localization.posterior.likelihood import UNKNOWNS, Noise
from experiments.contact_localization.posterior.posterior import (
    Mode,
    Region,
    best_point,
    credible_radius,
    credible_region,
    modes,
    settled,
)
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.strike_consistency import (
    distinct_strikes,
    judge_sound,
)
from experiments.contact_localization.posterior.strikes import StrikeEvidence, by_sound, hear
from experiments.contact_localization.touch.kernels import similarities_at
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import FitRefused, WrongUse
from harness.basics.faces.nearest_surface import nearest_point
from harness.bench.acquisition import Strike
from harness.effects.accuracy import Accuracy, Knob, Setting

Similarity = Callable[[int, IntArray, FloatArray], FloatArray | None]
"""Similarity of a contact's reading to the readings predicted for particles. Arguments: index of the contact,
``(n,)`` samples and ``(n,)`` yaws of the particles. Result: ``(n,)`` from -1 to 1, or None if the contact
has no usable reading."""


_BEHIND = 1.5e-3
"""Distance in m behind the first surface beyond which a point cannot be touched; its similarity is 0."""


CANDIDATES = 10


_EVERY = 5
"""Stride through the yaws of the grid: the filter's cosine hardly changes over 10 degrees."""


TEMPERATURE = 0.05
"""Temperature of the weight ``exp(cosine / temperature)``; the paper states none, and 1 hardly converges."""


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


Method = Literal["grid", "particle"]
"""The exact posterior refined, or the paper's filter."""

Senses = Literal["touch", "audio", "both"]
"""``"both"``: whatever was recorded."""

METHOD: Knob[Method] = Knob(
    "localization.method", ("particle", "grid"), "", "method", "grid", "the paper's filter, or ours"
)
SENSES: Knob[Senses] = Knob(
    "localization.senses",
    ("touch", "audio", "both"),
    "",
    "method",
    "both",
    "what is used of what was recorded",
)
SPACING = Knob(
    "localization.spacing", (4e-3, 3e-3, 2e-3, 1.5e-3), "m", "number", 2e-3, "between surface samples"
)
ROUNDS = Knob(
    "localization.rounds", (0, 1, 2, 3, 5), "rounds", "number", 5, "most refinements after the grid"
)
SAMPLES = Knob(
    "localization.samples", (600, 1500, 3000, 6000), "", "number", 3000, "hypotheses a refinement draws"
)
PARTICLES = Knob(
    "localization.particles", (300, 1000, 3000, 10_000), "", "number", 1000, "of the paper's filter"
)
BLOCK = Knob("localization.block", (16, 8), "pixels", "number", 8, "tactile pixels averaged, each way")

DIALS = (SENSES, METHOD, SPACING, ROUNDS, SAMPLES, PARTICLES, BLOCK)


FLOORS: Mapping[Senses, float] = {"touch": 0.4e-3, "audio": 0.75e-3, "both": 0.3e-3}
"""Metres, one sigma of the errors that hypotheses by these senses do not show, fitted to calibration runs. By
sound alone they name no error that the contacts share, which therefore is here."""


AGREES = 6.0e-3
"""Metres from the answer at which a hypothesis of the last contact still agrees with it."""


SOUND_LEFT_OUT = (
    "the strikes do not fit any place that fits the tactile images, so this answer is from touch alone; "
    "check the object's material and wall thickness, and that the microphone did not move"
)


_CANDIDATES = 10


_TURNED = 4000
"""Points that stand for a posterior which no reading of the yaw narrows: a ring of a metre, well filled."""


_UNKNOWN_YAW_FACTOR = 4


_ANCHORS = 3


_SUSPICIOUS_BELOW = -8.0


USUAL_FIT = 2.6
"""Mean of a contact's fit at the best hypothesis over calibration runs, as -2 log-likelihood."""


_SLIPPED = 40.0
"""Twice the nats from which on a contact counts as slipped, and says nothing of the bench."""


STRAINED = 1.3
"""Maximum nuisance-parameter cost at which the stated errors are used."""


MOST = 2.0
"""Times as large as stated, what errors are taken for at most: beyond, the object is another one."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """The answer to one run."""

    position_in_object: FloatArray  #: ``(3,)`` metres: the last contact, a point on the surface.
    contacts: FloatArray  #: ``(contacts, 3)`` metres: all of them, on the surface to half a pixel of a view.
    modes: tuple[Mode, ...]  #: places the last contact may be, heaviest first.
    region: Region  #: the part of the surface that holds 90 % of the posterior.
    credible90: float  #: metres around the answer that hold 90 % of it.
    candidates: FloatArray  #: ``(10, 3)`` metres: the most probable distinct hypotheses of the last contact.
    gates: tuple[Gate, ...]  #: how each contact's image fits; none where no image was used.
    yaw: float  #: rad away from the nominal orientation, of the hypothesis that ``contacts`` are of.
    yaw_sigma: float  #: rad, circular spread of the posterior.
    points: FloatArray  #: ``(n, 3)`` metres: hypotheses of the last contact, for pictures.
    weights: FloatArray  #: ``(n,)`` of the hypotheses, summing to 1.
    seconds: dict[str, float]  #: by stage.
    hypotheses: Hypotheses
    """where the gel was at the first contact; turns that the object does not show are not among them."""
    doubts: tuple[str, ...] = ()
    """what a reader must know of an answer whose sound may be another object's, or whose bench is further off
    than stated."""
    strain: float = 0.0
    """how many times further off the readings are than the bench's stated errors allow (``strain``); 0 where
    no image says."""

    @property
    def times_stated(self) -> float:
        """The factor by which the stated bench errors are enlarged; 1 up to ``STRAINED``."""
        return 1.0 if self.strain <= STRAINED else min(self.strain, MOST)


@dataclass(frozen=True, eq=False)
class PosteriorSolution:
    """Hypotheses with how the best of them fits."""

    hypotheses: Hypotheses  #: the posterior.
    members: IntArray  #: ``(m,)`` indices of the contacts whose image counts.
    fits: FloatArray  #: ``(m,)`` nats of each at the best hypothesis.
    pictured: bool = True
    """whether pictures along the tool say where a hypothesis' contact lies; without, it is the sample nearest
    to where the tool ended."""


def locate(
    contacts: Sequence[Contact],
    model: Model,
    prior: Prior,
    accuracy: Accuracy,
    noise: Noise,
    seed: int = 0,
    first: int | None = None,
    image_seconds: float = 0.0,
    strikes: Sequence[Strike | None] = (),
    judged: bool = True,
) -> tuple[Estimate, ...]:
    """The estimate after each contact from the ``first`` on; of the last contact alone where None.

    Estimates of fewer than all contacts are not refused: they are pictures of the way to the answer.

    Args:
        contacts: what each image shows, in the order they were made.
        model: object and sensor.
        prior: of the object's orientation.
        accuracy: the method and its levels.
        noise: of the terms.
        seed: of the draws inside the method.
        first: contacts of the first estimate.
        image_seconds: s that reading all images took.
        strikes: of the contacts, as they were captured.
        judged: whether contacts that fit no place are refused, or estimated all the same.

    Raises:
        FitRefused: no place on this object explains the contacts, or no image shows one.
        WrongUse: there are no contacts, or none was struck and sound alone is asked for.
    """
    if len(contacts) == 0:
        raise WrongUse("no contacts were given; a run needs at least one")
    senses, spacing = accuracy.of(SENSES), accuracy.of(SPACING)
    search = Search(contacts, model, prior, spacing, noise)
    strikes = distinct_strikes([contact.base_from_gel for contact in contacts[: len(strikes)]], strikes)
    count = len(contacts)
    answers = []
    for k in range(count if first is None else first, count + 1):
        seconds = {"images": image_seconds * k / count}
        start = time.perf_counter()
        alone = senses == "audio"
        heard = None if senses == "touch" else hear(strikes[:k], model, spacing, alone)
        if alone and heard is None:
            raise WrongUse("an estimate by sound was asked for, and no contact was struck; ask for touch")
        if heard is not None:
            lap(seconds, "sounds", start)
        # Sound that tells no places apart leaves both senses with the answer and the floor of touch.
        weighed = heard if heard is not None and (alone or heard.term.says_something) else None
        found = _solve_run(search, k, accuracy, seed, seconds, weighed)
        doubts: tuple[str, ...] = ()
        if judged and k == count:
            try:
                doubts = _judged(search, found, accuracy, heard, k, seconds)
            except FitRefused:
                if weighed is None or alone:
                    raise
                # The images are the better judge of the object: if they fit without the strikes, the strikes
                # are what does not fit.
                weighed = None
                found = _solve_run(search, k, accuracy, seed, seconds, None)
                doubts = (*_judged(search, found, accuracy, None, k, seconds), SOUND_LEFT_OUT)
        floor = noise.floor * FLOORS[senses if weighed else "touch"]
        answers.append(_answer(search, k, found, seconds, floor, doubts))
    return tuple(answers)


def _judged(
    search: Search,
    found: PosteriorSolution,
    accuracy: Accuracy,
    heard: StrikeEvidence | None,
    count: int,
    seconds: dict[str, float],
) -> tuple[str, ...]:
    """What a reader must know of an answer that is not refused."""
    start = time.perf_counter()
    doubts: tuple[str, ...] = ()
    if heard is not None:
        doubts = judge_sound(search, found.hypotheses, heard, count, accuracy.of(SENSES) == "audio")
    # The paper's filter has no measure of fit to be refused by.
    if accuracy.of(METHOD) == "grid" and found.pictured:
        refuse_bad_fit(search, found.members, found.fits)
        refuse_inside_out(search, found.hypotheses.top, found.members)
    lap(seconds, "judge", start)
    return doubts


def _answer(
    search: Search,
    count: int,
    found: PosteriorSolution,
    seconds: dict[str, float],
    floor: float,
    doubts: tuple[str, ...],
) -> Estimate:
    start = time.perf_counter()
    mesh = search.model.mesh
    hypotheses, clouds, owners = _everywhere(search, count, found)
    weights, yaws = hypotheses.weights, hypotheses.yaws
    # The last contact is the answer; the others are those of the most probable hypothesis that agrees with
    # it, so that a symmetric object's contacts are not each answered under a yaw of its own.
    answer = best_point(clouds[-1], weights)
    near = np.linalg.norm(clouds[-1] - answer, axis=1) < AGREES
    chosen = int(np.argmax(np.where(near, hypotheses.log_weights, -np.inf)))
    others = [settled(cloud, weights, cloud[chosen]) for cloud in clouds[:-1]]
    answers = np.array([*others, answer])
    # A view's pixel is off the surface where that curves within it; the answer is not.
    answers[-1] = nearest_point(mesh, answers[-1])
    points = clouds[-1]
    ranked = np.argsort(-found.hypotheses.log_weights, kind="stable")[:_CANDIDATES]
    turning = complex(np.exp(1j * yaws) @ weights)
    result = Estimate(
        position_in_object=read_only(answers[-1]),
        contacts=read_only(answers),
        modes=modes(points, weights),
        region=credible_region(points, weights, search.surface, floor),
        credible90=credible_radius(points, weights, answers[-1], floor),
        candidates=read_only(points[np.searchsorted(owners, ranked)]),
        gates=gates(search, count, found.members, found.fits) if found.pictured else (),
        yaw=float(yaws[chosen]),
        yaw_sigma=float(np.sqrt(max(0.0, -2.0 * np.log(max(abs(turning), 1e-12))))),
        points=read_only(points),
        weights=read_only(weights),
        seconds=seconds,
        hypotheses=found.hypotheses,
        doubts=doubts,
        strain=strain_of(search, found.hypotheses, found.fits) if len(found.fits) else 0.0,
    )
    lap(seconds, "answer", start)
    return result


def _everywhere(
    search: Search, count: int, found: PosteriorSolution
) -> tuple[Hypotheses, list[FloatArray], IntArray]:
    """Hypotheses spread over turns that the object does not show, contacts' points, and whose each is."""
    hypotheses, surface = found.hypotheses, search.surface
    if found.pictured:
        clouds = [search.surface_points(k, hypotheses) for k in range(count)]
    else:
        places = [search.contact_places(k, hypotheses) for k in range(count)]
        clouds = [surface.points[surface.tree.query(each)[1]] for each in places]
    if search.turning is None:
        return hypotheses, clouds, np.arange(len(hypotheses.yaws))
    owners, turns, weights = search.turning.copies(hypotheses.weights, _TURNED)
    # A point turned with the object is the same reading under a yaw turned the other way.
    yaws, logs = hypotheses.yaws[owners] - turns, np.log(np.maximum(weights, 1e-300))
    spread = Hypotheses(hypotheses.gels[owners], yaws, logs - logs.max())
    return spread, [search.turning.turned(cloud[owners], turns) for cloud in clouds], owners


def _solve_run(
    search: Search,
    count: int,
    accuracy: Accuracy,
    seed: int,
    seconds: dict[str, float],
    heard: StrikeEvidence | None,
) -> PosteriorSolution:
    """Compute the posterior of the first ``count`` contacts; add the seconds of each stage to the clock."""
    if accuracy.of(SENSES) == "audio":
        assert heard is not None
        start = time.perf_counter()
        by_places = by_sound(search, heard.term, heard.struck, np.arange(count, dtype=np.int64))
        lap(seconds, "grid", start)
        return PosteriorSolution(by_places, np.empty(0, dtype=np.int64), np.empty(0), pictured=False)
    members = search.members(count)
    if len(members) == 0:
        refuse_bad_fit(search, members, np.empty(0))
    if accuracy.of(METHOD) == "particle":
        return _by_particles(search, count, members, accuracy, seed, seconds)
    best: PosteriorSolution | None = None
    clear = -np.inf
    samples = accuracy.of(SAMPLES) * (1 if search.prior.yaw == "known" else _UNKNOWN_YAW_FACTOR)
    for anchor in anchors(members, _ANCHORS):
        start = time.perf_counter()
        coarse = on_samples(search, members, int(anchor), heard)
        lap(seconds, "grid", start)
        start = time.perf_counter()
        refined = refine(search, coarse, members, samples, accuracy.of(ROUNDS), seed, heard)
        fits = search.gates(refined.top, members)
        lap(seconds, "refine", start)
        likeness = likeness_of(search, members, fits)
        if best is None or likeness.margin > clear:
            best, clear = PosteriorSolution(refined, members, fits), likeness.margin
        of_anchor = float(fits[np.nonzero(members == anchor)[0][0]])
        if min(of_anchor, likeness.typical) > _SUSPICIOUS_BELOW and likeness.margin > 0.0:
            break
    assert best is not None
    return best


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


def strain_of(search: Search, hypotheses: Hypotheses, fits: FloatArray) -> float:
    """Root mean square of the standardised residuals, 1 on average where errors are as stated.

    Args:
        search: the run.
        hypotheses: the posterior.
        fits: ``(m,)`` nats of the contacts at the best hypothesis.
    """
    own = -2.0 * fits[-2.0 * fits < _SLIPPED]
    squares, expected = float(own.sum()), USUAL_FIT * len(own)
    if hypotheses.shared is not None:
        squares += float(hypotheses.weights @ (hypotheses.shared**2).sum(axis=1))
        expected += UNKNOWNS
    if search.prior.yaw == "known":
        squares += float(hypotheses.weights @ (hypotheses.yaws / search.prior.yaw_sigma) ** 2)
        expected += 1.0
    return float(np.sqrt(squares / expected))


def needs_images(setting: Setting) -> bool:
    """Return whether a setting uses the tactile images."""
    return setting.get(SENSES.name, SENSES.default) != "audio"


def particle_filter(search: Search, count: int, particles: int, seed: int) -> Particles:
    """Run the particle filter on the tactile images of the first ``count`` contacts."""

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
