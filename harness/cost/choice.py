"""Which setting to take for a budget of seconds, or for an error to be met.

The rules and why they are these: ``docs/decisions/0004-cost.md``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.errors import WrongUse
from harness.cost.bounds import like, likely_error, most_seconds
from harness.cost.curve import Point, best_within, front
from harness.cost.promise import promise_share, typical_promise
from harness.effects.accuracy import Level


@dataclass(frozen=True, eq=False)
class Budgeted:
    """What a budget buys."""

    point: Point  #: the setting to take.
    seconds: float  #: s on the clock that it takes at most, in nearly every run.
    fits: bool  #: whether that is within the budget; else the point is the cheapest there is.


def for_budget(
    points: Sequence[Point],
    budget: float,
    name: str | None,
    speed: float = 1.0,
    spent: float | None = None,
    work: float | None = None,
) -> Budgeted:
    """The setting of least error on this object whose seconds, at most, keep a budget.

    Args:
        points: of one condition, at least one.
        budget: s on the clock, above zero.
        name: of the object, see ``Sample``.
        speed: s that a measured CPU second takes here and now.
        spent: s already taken by what settings share; predicted where None.
        work: of the run, see ``Sample``; None where it is not known yet.
    """
    prices = {point.name: most_seconds(point, name, speed, spent, work) for point in points}
    best = best_within(points, budget, prices, {point.name: likely_error(point, name) for point in points})
    if best is not None:
        return Budgeted(best, prices[best.name], fits=True)
    cheapest = min(points, key=lambda point: prices[point.name])
    return Budgeted(cheapest, prices[cheapest.name], fits=False)


def for_error(points: Sequence[Point], error: float, name: str | None) -> tuple[Point, ...]:
    """Return the settings to try in turn until one promises an error in m: the cheapest on average first.

    A first setting that cannot promise it is followed by the setting that can most often, so a try
    costs its own seconds and, as often as it fails, those of the other. Only settings on the front
    are considered: of many, some would have small errors by chance. One or two settings are returned.
    """
    points = front(points)
    shares = {point.name: promise_share(point, name, error) for point in points}
    # Where none can promise it, the one that promises most; it is said that it does not.
    last = min(points, key=lambda p: (-shares[p.name], typical_promise(p, name), _price(p, name)))
    price_of_last = _price(last, name)

    def expected(point: Point) -> float:
        again = 0.0 if point is last else (1.0 - shares[point.name]) * price_of_last
        return _price(point, name) + again

    first = min(points, key=expected)
    return (last,) if first is last or shares[last.name] == 0.0 else (first, last)


def nearest_condition(
    conditions: Sequence[Mapping[str, Level]], wanted: Mapping[str, Level], count: str
) -> tuple[Mapping[str, Level], float]:
    """The measured condition to go by, and how many times its seconds are to be expected.

    Args:
        conditions: those measured.
        wanted: the run's own.
        count: the condition that seconds grow with, such as ``"contacts"``; of those measured with
            no more of them the largest, so that errors are not promised from more than there is.

    Raises:
        WrongUse: nothing like it was measured.
    """
    alike = [c for c in conditions if all(c.get(k) == v for k, v in wanted.items() if k != count)]
    if not alike:
        said = ", ".join(f"{name} {value}" for name, value in wanted.items() if name != count)
        raise WrongUse(
            f"what accuracy costs was not measured for {said}; measure it with `touchstone cost`, "
            "or choose levels with --level"
        )
    number = float(wanted[count])
    fewer = [c for c in alike if float(c[count]) <= number]
    chosen = max(fewer, key=lambda c: float(c[count])) if fewer else min(alike, key=lambda c: float(c[count]))
    return chosen, number / float(chosen[count])


def _price(point: Point, name: str | None) -> float:
    return float(np.exp(np.mean([np.log(s.shared + s.cpu) for s in like(point, name)])))
