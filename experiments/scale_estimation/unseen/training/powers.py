"""The powers of the pool, from shapes that nothing was learnt from, each looked at, struck and touched."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from scipy.optimize import minimize

from experiments.scale_estimation.size import STEP, Belief, SizeRange
from experiments.scale_estimation.unseen.network import by_ways, shipped
from experiments.scale_estimation.unseen.pool import key_of, pooled
from experiments.scale_estimation.unseen.regression import by_outline
from experiments.scale_estimation.unseen.training.contact_samples import TouchableShape, contact_sample
from experiments.scale_estimation.unseen.training.outlines import picture
from experiments.scale_estimation.unseen.training.samples import (
    SIZES,
    draw_size,
    mapped,
    ringing_of,
    shape_of,
)
from experiments.scale_estimation.unseen.training.strike_samples import strike_sample
from experiments.scale_estimation.vision.outline import hull_of
from harness.basics.materials import MATERIALS

SENSES = ("audio", "touch", "vision")

AWAY = 10_000
"""Added to the seed that networks were fitted with: shapes of their families, none of them theirs."""

_LEAST, _MOST = 0.0, 1.0

Sample = tuple[Mapping[str, Belief], float]
"""What each sense says of one object, and its size in m."""


def readings(seed: int, count: int, number: int) -> list[Sample]:
    """So many looks with strikes and contacts of one shape, as the networks answer them."""
    shape, ringing = shape_of(number, seed), ringing_of(number, seed)
    touchable, corners = TouchableShape.of(shape), hull_of(shape.inside.nodes)
    random, sizes = np.random.default_rng((seed, number, 5)), SizeRange(*SIZES)
    found: list[Sample] = []
    for _ in range(count):
        size = draw_size(random)
        beliefs = {
            "vision": by_outline(*picture(corners, size, random), sizes),
            "touch": by_ways(contact_sample(touchable, size, random), sizes)[0],
        }
        if ringing is not None:
            bands, extras = strike_sample(ringing, size, str(random.choice(list(MATERIALS))), random)
            beliefs["audio"] = shipped("sound").belief([{"bands": bands, "extras": extras}], sizes)[0]
        found.append((beliefs, size))
    return found


def fitted_powers(fitting: Sequence[Sample], held_out: Sequence[Sample]) -> dict[str, Any]:
    """Powers for every two or more senses, and what they reach beside those of one."""
    powers, reached = {}, {}
    for number in (2, 3):
        for senses in combinations(SENSES, number):
            best = _fitted(senses, _of(senses, fitting))
            ones = dict.fromkeys(senses, 1.0)
            powers[key_of(best)] = best
            others = _of(senses, held_out)
            reached[key_of(best)] = {"powers": reaches(others, best), "ones": reaches(others, ones)}
    return {"powers": powers, "held_out": reached, "samples": len(fitting) + len(held_out)}


def _of(senses: Sequence[str], samples: Sequence[Sample]) -> list[Sample]:
    """What these senses say, where all of them answer."""
    return [
        ({sense: beliefs[sense] for sense in senses}, size)
        for beliefs, size in samples
        if set(senses) <= set(beliefs)
    ]


def reaches(samples: Sequence[Sample], powers: Mapping[str, float]) -> dict[str, float]:
    """Mean error in cm, and the share of intervals that hold the truth."""
    found = [(pooled(beliefs, powers), size) for beliefs, size in samples]
    held = [one.interval[0] <= size <= one.interval[1] for one, size in found]
    errors = [1e2 * abs(one.size - size) for one, size in found]
    return {"mean_error_cm": round(float(np.mean(errors)), 2), "held": round(float(np.mean(held)), 3)}


def _fitted(senses: Sequence[str], samples: Sequence[Sample]) -> dict[str, float]:
    """Those by which the true sizes are likeliest."""

    def surprise(powers: np.ndarray[Any, Any]) -> float:
        given = dict(zip(senses, map(float, powers), strict=True))
        return -float(np.mean([_log_density(pooled(beliefs, given), size) for beliefs, size in samples]))

    bounds = [(_LEAST, _MOST)] * len(senses)
    start = np.full(len(senses), 0.7)
    found = minimize(surprise, start, bounds=bounds, method="L-BFGS-B", options={"eps": 1e-2, "ftol": 1e-6})
    return {sense: round(float(power), 2) for sense, power in zip(senses, found.x, strict=True)}


def _log_density(belief: Belief, size: float) -> float:
    logs = belief.range.logs
    row = int(np.clip(round((np.log(size) - logs[0]) / STEP), 0, len(logs) - 1))
    return float(belief.log_density[row])


def train_powers(shapes: int, each: int, seed: int, processes: int) -> dict[str, Any]:
    """Make the readings, fit on every other shape, and say what is reached on the rest."""
    parts: tuple[list[Sample], list[Sample]] = [], []
    make = partial(readings, seed + AWAY, each)
    for number, rows in enumerate(mapped(make, shapes, processes, "powers")):
        parts[number % 2].extend(rows)
    return fitted_powers(*parts)
