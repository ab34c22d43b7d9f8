"""What the strikes of a run's first contacts say, ready for the search."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.contact_localization.model import Model
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.sound.likelihood import SoundTerm
from experiments.contact_localization.sound.matching import SoundNoise
from experiments.contact_localization.sound.places import sound_nats
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.bench.acquisition import Strike
from harness.strikes.peaks import analyse


@dataclass(frozen=True, eq=False)
class StrikeEvidence:
    """The sound of a run's strikes.

    Attributes:
        term: of the posterior.
        struck: ``(K,)`` indices of the contacts that were struck.
    """

    term: SoundTerm
    struck: IntArray

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
