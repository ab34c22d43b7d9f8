"""Where lines lead to a flat object of known shape that was not seen: onto it, in every way it may stand."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from experiments.scale_estimation.envelope import placed
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.touch.fit import UNKNOWNS, FreeSpace, TouchProblem
from experiments.scale_estimation.touch.patch import Patch
from harness.basics.arrays import BoolArray, FloatArray
from harness.skills.exploring.lines import LINES, LOWEST, LineTarget
from harness.skills.exploring.unknown_space import FLAT

STANDS = 200
"""Sizes, places and turns that are drawn; of them those are likely that the readings so far leave."""

FLATTEST = 2.5e-3
"""M above the support where a line to the flattest object ends: with the support's height known to 1 mm the
gel stops above it."""

_ABOVE_END = 1.0e-3
"""M by which a place must be higher than a line from above ends, for the line to meet it."""

_REACH = 3.0e-3
"""M to a side within which the face of the gel meets what it comes down on."""

_LEAST_WEIGHT = 0.5
_NEAR = 8
_POINTS = 3
_ROUNDS = 4


def aims_unmet(
    model: ObjectModel, patches: Sequence[Patch], free: Sequence[FloatArray], random: np.random.Generator
) -> list[LineTarget]:
    """Lines from above onto a flat object, as it may stand by what was met and what was not.

    Lines to where its middle should be end above a small plate's well and pass beside a wrench. Those that
    are likely to meet it come first, by chance in part, so that they do not all lead to one place.

    Args:
        model: of the object.
        patches: of the contacts so far.
        free: ``(n, 3)`` m in base each, places along the ways that the gel has passed.
        random: what stands, places and their order are drawn from.
    """
    stands, chances = _stands(model, patches, free, random)
    lowest = lowest_end(model)
    places = []
    for index in random.choice(len(stands), LINES, p=chances):
        surface = placed(model, model.stand.points, stands[index])
        high = surface[surface[:, 2] > model.place[2] + lowest + _ABOVE_END]
        places.append(random.choice(high if len(high) else surface))
    ends = np.array(places)
    likely = _met(model, stands, ends[:, :2] - model.place[:2], lowest) @ chances
    order = np.argsort(-likely * random.uniform(_LEAST_WEIGHT, 1.0, LINES))
    return [LineTarget(ends[k], above=True, lowest=lowest) for k in order]


def is_flat(model: ObjectModel) -> bool:
    """Whether lines that slant would pass above it."""
    return _height(model) < FLAT * model.nominal


def _met(model: ObjectModel, stands: FloatArray, aims: FloatArray, lowest: float) -> BoolArray:
    """``(a, k)``: whether the gel, coming down on ``(a, 2)`` m off the place, meets objects that stand so."""
    scale = np.exp(stands[:, 0])
    cosine, sine = np.cos(stands[:, 3]), np.sin(stands[:, 3])
    x, y = np.moveaxis(aims[:, None] - stands[None, :, 1:3], -1, 0)
    standing = np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1) / scale[:, None]
    apart, near = cKDTree(model.stand.points[:, :2]).query(standing, k=_NEAR)
    heights = np.where(apart * scale[:, None] < _REACH, model.stand.points[near, 2], -np.inf)
    return np.asarray(heights.max(axis=-1) * scale > lowest)


def _height(model: ObjectModel) -> float:
    """M, of the nominal object above the support."""
    return float(model.corners[:, 2].max())


def lowest_end(model: ObjectModel) -> float:
    """M above the support where lines from above end: half as high as the smallest one, if that is less."""
    flattest = _height(model) * model.sizes.low / model.nominal
    return float(np.clip(0.5 * flattest, FLATTEST, LOWEST))


def _stands(
    model: ObjectModel, patches: Sequence[Patch], free: Sequence[FloatArray], random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """``(STANDS, UNKNOWNS)`` and ``(STANDS,)`` their probabilities."""
    drawn = np.zeros((STANDS, UNKNOWNS))
    low, high = np.log(np.array([model.sizes.low, model.sizes.high]) / model.nominal)
    drawn[:, 0] = random.uniform(low, high, STANDS)
    drawn[:, 1:3] = random.normal(0.0, model.place_error, (STANDS, 2))
    drawn[:, 3] = random.uniform(0.0, 2.0 * np.pi, STANDS)
    costs = np.zeros(STANDS)
    if patches:
        problem = TouchProblem(model.stand, patches, _POINTS)
        drawn, costs = problem.refined(drawn, _ROUNDS, fixed_size=True)
    costs = costs + FreeSpace(model.stand, free).cost(drawn)
    chances = np.exp(costs.min() - costs)
    return drawn, chances / chances.sum()
