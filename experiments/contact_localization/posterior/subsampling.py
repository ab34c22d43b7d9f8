"""A grid filled between its samples and yaws, where what it holds is too sharp for its steps."""

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray

_EVENLY = 1.2207440846057596 ** -np.arange(1.0, 4.0)
"""Steps of the additive recurrence that fills three axes evenly, powers of the root of ``x^4 = x + 1``
(Roberts, The unreasonable effectiveness of quasirandom sequences, 2018)."""


def between_samples(search: Search, anchor: int, at: Hypotheses, copies: int) -> Hypotheses:
    """Each hypothesis so many times, spread evenly over what its sample and its yaw of the grid stand for.

    The anchor's place goes along the surface as its tool sees it, up to half the samples' spacing each way,
    and stays there while the object is turned by up to half a step of its yaws.

    Args:
        search: the run.
        anchor: the contact that ``at`` puts on samples.
        at: ``n`` hypotheses of the grid.
        copies: of each.

    Returns:
        ``copies * n``, each weighed as what it is a copy of.
    """
    copied = np.repeat(np.arange(len(at.yaws), dtype=np.int64), copies)
    spread = np.mod(np.arange(1.0, len(copied) + 1.0)[:, None] * _EVENLY, 1.0) - 0.5
    yaws = at.yaws[copied]
    if search.yaw_observable:
        yaws = yaws + search.yaw_step * spread[:, 2]
    turned = search.prior.object_from_base(yaws)
    # From the gel's centre at the first contact to the anchor's place on the surface.
    reach = search.positions[anchor] - search.contacts[anchor].indentation * search.axes[anchor]
    samples = at.gels + search.prior.object_from_base(at.yaws) @ reach
    places = samples[copied] + search.surface.spacing * _across(turned @ search.axes[anchor], spread[:, :2])
    return Hypotheses(places - turned @ reach, yaws, at.log_weights[copied])


def _across(axes: FloatArray, amounts: FloatArray) -> FloatArray:
    """``(n, 3)``: ``(n, 2)`` amounts along two directions square to each other and to unit ``axes``."""
    first = np.cross(axes, np.eye(3)[np.argmin(np.abs(axes), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.asarray(amounts[:, :1] * first + amounts[:, 1:] * np.cross(axes, first))
