"""How many times further off the readings are than a bench's stated errors allow, by the fit's own residuals.

Of errors that are as stated, the posterior's mean square of each, in units of its sigma, is 1 on average,
however little the readings say of it. Where it is more, errors are larger than stated and regions too small.
"""

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.shared_errors import UNKNOWNS
from harness.basics.arrays import FloatArray

USUAL_FIT = 2.6
"""Twice the nats that a contact's own fit costs at the best hypothesis, on average over calibration runs (24:
four objects, three seeds, close and spread)."""

_SLIPPED = 40.0
"""Twice the nats from which on a contact counts as slipped, and says nothing of the bench."""

STRAINED = 1.3
"""Strain up to which errors are taken as stated: one of those 24 runs exceeds it, and 14 of the same 24 on a
bench whose errors are twice as large."""

MOST = 2.0
"""Times as large as stated, what errors are taken for at most: beyond, the object is another one."""


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


def times_stated(strain: float) -> float:
    """How many times as large as stated errors are taken to be; 1 where the fit does not contradict them."""
    return 1.0 if strain <= STRAINED else min(strain, MOST)
