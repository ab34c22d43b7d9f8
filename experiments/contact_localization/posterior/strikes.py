"""What the strikes of a run's first contacts say, ready for the search."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.contact_localization.model import Model
from experiments.contact_localization.posterior.hypotheses import Hypotheses, anchors
from experiments.contact_localization.posterior.search import MOST_HYPOTHESES, Search
from experiments.contact_localization.sound.likelihood import SoundNoise, SoundTerm
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.bench.acquisition import Strike
from harness.strikes.peaks import analyse


@dataclass(frozen=True, eq=False)
class StrikeEvidence:
    """The sound of a run's strikes."""

    term: SoundTerm  #: of the posterior.
    struck: IntArray  #: ``(K,)`` indices of the contacts that were struck.

    def nats(self, search: Search, at: Hypotheses, between: bool = False) -> FloatArray:
        """``(n,)`` nats of hypotheses, see ``sound_nats``; 0 where sound says nothing."""
        return sound_nats(search, self.term, self.struck, at, between)

    def nats_of_draws(self, search: Search, at: Hypotheses, rng: np.random.Generator) -> FloatArray:
        """``(n,)`` nats of draws between samples, of which each also draws how far its strikes fell aside.

        Drawn from its prior, that takes no weight of its own, and whoever asks draws for their places alone
        has summed over it.
        """
        aside = self.term.aside * rng.normal(size=(len(at.yaws), 3))
        return sound_nats(search, self.term, self.struck, at, between=True, aside=aside)


def hear(
    strikes: Sequence[Strike | None], model: Model, spacing: float, alone: bool = False
) -> StrikeEvidence | None:
    """The strikes as a term; None where nothing was struck.

    Args:
        strikes: of the contacts in order; None for one that was not struck.
        model: with the object's modes.
        spacing: metres between the surface's samples.
        alone: whether no image speaks beside them.

    Raises:
        WrongUse: there are strikes, and the model has no modes.
    """
    struck = [k for k, strike in enumerate(strikes) if strike is not None]
    if not struck:
        return None
    if model.modes is None or model.material is None:
        raise WrongUse("the contacts were struck, and the model of the object has no modes to compare with")
    evidence = analyse([strike for strike in strikes if strike is not None])
    noise = SoundNoise()
    noise = replace(noise, weight=noise.alone) if alone else noise
    term = SoundTerm(evidence, model.gains(spacing), model.modes, model.material, noise)
    return StrikeEvidence(term, np.array(struck, dtype=np.int64))


def strike_places(
    search: Search, struck: IntArray, at: Hypotheses, aside: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Where strikes fell and which way they went: the press's place, along the tool.

    Args:
        search: the run.
        struck: ``(K,)`` indices of the contacts that were struck.
        at: ``h`` hypotheses; errors that contacts share do not move a strike.
        aside: ``(h, 3)`` metres, in the object's frame, by which all strikes of a hypothesis fell elsewhere
            than its presses; what of it lies along a hammer's way moves none.

    Returns:
        ``(h, K, 3)`` metres and ``(h, K, 3)`` unit, in the object's frame. The places are as far off
        the surface as the indentation is misread; a table of modes takes the nearest sample.
    """
    rotations = search.prior.object_from_base(at.yaws)
    directions = np.einsum("hij,kj->hki", rotations, search.axes[struck])
    indentations = np.array([search.contacts[k].indentation for k in struck])
    moved = np.einsum("hij,kj->hki", rotations, search.positions[struck])
    points: FloatArray = at.gels[:, None] + moved - indentations[:, None] * directions
    if aside is not None:
        along = np.einsum("hki,hi->hk", directions, aside)
        points = points + aside[:, None] - along[..., None] * directions
    return points, np.ascontiguousarray(directions)


def sound_nats(
    search: Search,
    term: SoundTerm,
    struck: IntArray,
    at: Hypotheses,
    between: bool = False,
    aside: FloatArray | None = None,
) -> FloatArray:
    """``(h,)`` nats of hypotheses by a run's sounds, 0 for sounds that say nothing.

    Args:
        search: the run.
        term: of its strikes, in the order of ``struck``.
        struck: ``(K,)`` indices of the contacts that were struck.
        at: ``h`` hypotheses.
        between: whether the places lie between samples, see ``SoundTerm.log_likelihood``.
        aside: ``(h, 3)`` metres, see ``strike_places``.
    """
    if not term.says_something:
        return np.zeros(len(at.yaws))
    return term.log_likelihood(*strike_places(search, struck, at, aside), between)


_WORTH_KEEPING = 18.0
"""Nats behind the best: all hypotheses beyond together weigh less than a thousandth of it."""

ANCHORS = 2
"""Contacts that the others hang on in turn."""


def by_sound(
    search: Search, term: SoundTerm, struck: IntArray, members: IntArray, use_axis: bool = True
) -> Hypotheses:
    """The posterior over surface samples and yaws by places, tool axes and sound, without any image.

    A hypothesis hangs on its anchor, which must lie on the surface: where that contact slipped off an
    edge, no hypothesis of it is right. The posterior is the mean of those by each anchor.

    Args:
        search: the run.
        term: of its strikes, in the order of ``struck``.
        struck: ``(K,)`` indices of the contacts that were struck.
        members: ``(m,)`` indices of the contacts whose place counts.
        use_axis: whether the tool's attitude counts, or only places.
    """
    carriers = anchors(members, ANCHORS)
    most = MOST_HYPOTHESES // len(carriers)
    parts = [search.places(members, int(anchor), use_axis, most) for anchor in carriers]
    gels, yaws, places = (np.concatenate(column) for column in zip(*parts, strict=True))
    at = Hypotheses(gels, yaws, places)
    return at.told(sound_nats(search, term, struck, at)).best(_WORTH_KEEPING, len(places))
