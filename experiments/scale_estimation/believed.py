"""How an object of known shape is believed to stand while it is explored."""

from collections.abc import Sequence

import numpy as np

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.touch.fit import UNKNOWNS, FreeSpace, TouchProblem
from experiments.scale_estimation.touch.touch import by_touch
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused

BELIEVED_AFTER = 2
"""Contacts without a look after which the object is believed to stand where they say."""

ALONG_SIGHT = (0.0, 1.0, -1.0, 2.0, -2.0)
"""Standard deviations of its place along the line of sight at which a seen object is thought of."""

SURE_OF_SIZE = 0.1
"""Of the size's logarithm: where contacts fit a seen object farther off than that, it is by chance."""


def believed(answering: ScaleAnswering, seen: Sequence[SeenStand]) -> FloatArray | None:
    """``(4,)`` of the hypothesis that fits all readings best; None where there is none yet."""
    return _of_seen(answering, seen) if seen else _of_touched(answering)


def _of_touched(answering: ScaleAnswering) -> FloatArray | None:
    model, patches = answering.model, answering.patches
    if len(patches) < BELIEVED_AFTER:
        return None
    try:
        found = by_touch(model.stand, patches, model.nominal, model.sizes, free=answering.free)
    except FitRefused:
        return None
    return np.asarray(found.unknowns[:4])


def _of_seen(answering: ScaleAnswering, seen: Sequence[SeenStand]) -> FloatArray:
    """Of every turn that was seen, and places along the line of sight: what the contacts fit best."""
    model, patches = answering.model, answering.patches
    away = np.array(ALONG_SIGHT)
    starts = np.zeros((len(seen) * len(away), UNKNOWNS))
    for row, (stand, far) in enumerate((stand, far) for stand in seen for far in away):
        starts[row, :4] = stand.unknowns
        starts[row, 1:3] += far * stand.farthest
    costs = 0.5 * np.tile(away, len(seen)) ** 2
    problem = TouchProblem(model.stand, patches, len(patches[0].points) if patches else 1)
    found = starts
    if patches:
        found, misfits = problem.refined(starts, 8, fixed_size=False)
        costs = costs + misfits
    best = int((costs + FreeSpace(model.stand, answering.free).cost(found)).argmin())
    # A few contacts can be fitted by another size: what was seen of it holds.
    kept = found if abs(found[best, 0] - starts[best, 0]) < SURE_OF_SIZE else starts
    return np.asarray(kept[best, :4])
