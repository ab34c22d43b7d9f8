"""How many places the arm's poses alone leave a run: what the seconds of its answer grow with."""

from collections.abc import Sequence

import numpy as np

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.bench_noise import noise_at
from experiments.contact_localization.posterior.hypotheses import Contact
from experiments.contact_localization.posterior.search import Search
from harness.recording.observation import Observation

SPACING = 8.0e-3
"""Metres between the surface's samples: coarse, as counting must cost little beside any answer."""

_ALL = 10**9
"""Hypotheses: more than there are, so that none is left out of the count."""


def places_left(observations: Sequence[Observation], model: Model, prior: Prior) -> float:
    """The number of coarse hypotheses within the grid's reach, before any image or sound is looked at.

    A mug's handle leaves few, a tray's floor thousands: an answer weighs each by all that was read.

    Args:
        observations: the contacts; only their poses are used.
        model: of the object.
        prior: of its orientation.

    Returns:
        At least 1.
    """
    contacts = [Contact(observation.base_from_gel) for observation in observations]
    search = Search(contacts, model, prior, SPACING, noise_at(model.errors))
    everyone = np.arange(len(contacts), dtype=np.int64)
    gels, _, _ = search.places(everyone, 0, most=_ALL)
    return float(max(1, len(gels)))
