"""Which strikes speak for themselves, and whether places and sounds alone can be of this object."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Hypotheses, anchors
from experiments.contact_localization.posterior.likelihood import (
    SAME_AXIS,
    SAME_PLACE,
    arrange,
    geometry_scores,
)
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.strikes import ANCHORS, StrikeEvidence, strike_places
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import FitRefused
from harness.bench.acquisition import Strike
from harness.recording.observation import Observation
from harness.strikes.peaks import analyse

UNEXPLAINED = 0.3
"""Maximum fraction of the recorded resonances without a mode; above it the object may be another one."""


STRANGER = 0.5
"""Log-likelihood by which every resonance that no mode explains counts against the object."""


REFUSE_BELOW = -4.0
"""Minimum log-likelihood of positions and sound at the best hypothesis, without the worst position."""


REFUSE_UNHEARD_BELOW = -12.0
"""The same where next to nothing was heard."""


_TELLING = 3
"""Resonances that can tell whose they are."""


_FEWEST = 2


_STRANGE = "by its sound this may be another object, or one of another wall or material"


@dataclass(frozen=True, eq=False)
class SoundFit:
    """How contacts fit the best hypothesis without their images."""

    places: FloatArray  #: ``(contacts,)`` nats of each contact's place and tool axis, 0 at best.
    yaw: float  #: nats of the object's yaw, 0 at best.
    sound: float  #: nats over a sound that says nothing.
    resonances: int  #: number of recorded resonances.
    unexplained: int  #: how many of them no mode explains.

    @property
    def total(self) -> float:
        """Nats, 0 for contacts that lie on the object and were not heard. One contact may have slipped."""
        places = float(self.places.sum() - self.places.min())
        return places + self.yaw + self.sound - STRANGER * self.unexplained

    @property
    def limit(self) -> float:
        """The least ``total`` that is not refused."""
        return REFUSE_UNHEARD_BELOW if self.resonances < _TELLING else REFUSE_BELOW

    @property
    def strange(self) -> bool:
        """Whether so many resonances are no mode's that the sound may be another object's."""
        return self.resonances >= _TELLING and self.unexplained > UNEXPLAINED * self.resonances


def _fit_sound(search: Search, hypotheses: Hypotheses, evidence: StrikeEvidence, count: int) -> SoundFit:
    """Measure the fit of the most probable hypothesis."""
    best = hypotheses.top
    points, directions = strike_places(search, evidence.struck, best)
    rows = evidence.term.mode_table(points[0], directions[0])
    return SoundFit(
        places=_places(search, best, count),
        yaw=float(search.log_yaw_prior(best.yaws)[0]),
        sound=float(evidence.nats(search, best)[0]),
        resonances=len(rows),
        unexplained=sum(not row.modes for row in rows),
    )


def judge_sound(
    search: Search, hypotheses: Hypotheses, evidence: StrikeEvidence, count: int, alone: bool
) -> tuple[str, ...]:
    """State what a reader must know of an answer whose sound may be another object's; empty otherwise.

    Where the images fit, sound does not refuse: it warns. What the images of another object's like
    curvature let pass is nearly always recorded.

    Args:
        search: the run.
        hypotheses: the posterior.
        evidence: evidence of the run's strikes.
        count: contacts that count.
        alone: whether no image counts, so that a sound that cannot be of this object is refused.

    Raises:
        FitRefused: places and sounds together cannot be of this object; naming the worst contact.
    """
    fit = _fit_sound(search, hypotheses, evidence, count)
    resonances = f"no mode explains {fit.unexplained} of the {fit.resonances} resonances heard"
    if fit.resonances == 0:
        resonances = "nothing was heard that speaks for it"
    if not alone or fit.total >= fit.limit:
        return (f"{resonances}: {_STRANGE}",) if fit.strange else ()
    worst = int(np.argmin(fit.places))
    raise FitRefused(
        f"what was struck does not fit this object: the best place explains it with {fit.total:.1f} nats "
        f"(limit {fit.limit:g}), and {resonances}; contact {worst + 1} is the worst, its place fits "
        f"with {fit.places[worst]:.1f}. Check that it is this object, its units, its wall and its material"
    )


def distinct_strikes(
    base_from_gels: Sequence[FloatArray], strikes: Sequence[Strike | None]
) -> list[Strike | None]:
    """The strikes, with None for every one that repeats an earlier one's place.

    What the model does not know of a place is the same in every strike there: however often one place
    is struck, it is one witness, and by itself says nothing.

    Args:
        base_from_gels: ``(4, 4)`` each, of the contacts.
        strikes: of the same contacts.
    """
    repeated = _repeated(base_from_gels, strikes)
    return [None if k in repeated else strike for k, strike in enumerate(strikes)]


def doubts_of_sound(observations: Sequence[Observation]) -> tuple[str, ...]:
    """What a reader must know of a run's strikes; empty where all count, or none was meant to be made."""
    strikes = [observation.strike for observation in observations]
    if all(strike is None for strike in strikes):
        return ()
    poses = [observation.base_from_gel for observation in observations]
    distinct = distinct_strikes(poses, strikes)
    evidence = analyse([strike for strike in distinct if strike is not None])
    reasons = iter(evidence.reasons)
    repeated = _repeated(poses, strikes)
    missing = {k: f"struck where contact {earlier + 1} was" for k, earlier in repeated.items()}
    said = [
        next(reasons) if strike is not None else missing.get(k, "not struck")
        for k, strike in enumerate(distinct)
    ]
    left_out = ", ".join(f"contact {k + 1} ({reason})" for k, reason in enumerate(said) if reason)
    why = f"; left out: {left_out}" if left_out else ""
    usable = int(evidence.used.sum())
    if usable < _FEWEST:
        found = f"{usable} of {len(strikes)} strikes could be used and {_FEWEST} are needed"
    elif not evidence.peaks:
        found = "no resonance stood out of the noise in two strikes"
    else:
        return (f"{len(strikes) - usable} of {len(strikes)} strikes were not used{why}",) if why else ()
    return (f"sound says nothing: {found}{why}; the answer by sound is by the places of the contacts alone",)


def _repeated(base_from_gels: Sequence[FloatArray], strikes: Sequence[Strike | None]) -> dict[int, int]:
    """Contacts whose strike repeats that of an earlier contact, which can be used itself."""
    repeated: dict[int, int] = {}
    counting: list[int] = []
    for k, strike in enumerate(strikes):
        if strike is None or strike.fault:
            continue
        here = base_from_gels[k]
        earlier = [
            j
            for j in counting
            if float(np.linalg.norm(base_from_gels[j][:3, 3] - here[:3, 3])) < SAME_PLACE
            and float(base_from_gels[j][:3, 2] @ here[:3, 2]) > float(np.cos(SAME_AXIS))
        ]
        if earlier:
            repeated[k] = earlier[0]
        else:
            counting.append(k)
    return repeated


def _places(search: Search, best: Hypotheses, count: int) -> FloatArray:
    """``(contacts,)`` nats of every contact's place and axis at one hypothesis, hung where it fits best."""
    surface, rotations = search.surface, search.prior.object_from_base(best.yaws)
    indentations = np.array([contact.indentation for contact in search.contacts[:count]])
    points = search.positions[:count] - indentations[:, None] * search.axes[:count]
    zero = np.zeros(1, dtype=np.int64)

    def score(members: list[int], sample: IntArray) -> float:
        arrangement = arrange(rotations, points[members], search.axes[members], 0)
        scores = geometry_scores(
            surface, arrangement, sample, zero, np.zeros(1), search.geometry, True, np.inf
        )
        return float(scores[0])

    every = []
    for anchor in map(int, anchors(np.arange(count), ANCHORS)):
        sample = np.asarray(surface.tree.query(search.contact_places(anchor, best))[1], dtype=np.int64)
        first = score([anchor], sample)
        nats = [first if k == anchor else score([anchor, k], sample) - first for k in range(count)]
        every.append(np.array(nats))
    return max(every, key=lambda places: float(places.sum()))
