"""What a next run will cost at most, and how far off it is likely to be, from runs measured before."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, stdtrit

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.cost.curve import GROSS, Point, Sample

KEPT = 0.975
"""Share of runs in which a budget is to be kept: above the 95 % promised, for what was not sampled."""

_ENOUGH = 4

_LENT = 4.0
"""Degrees of freedom that the usual spread counts for, beside those of an object's own runs."""

_LENT_ERRORS = 15.0
"""Runs that the mean error over all objects counts for, beside an object's own ten: of 0 to 30 and of no
regard to the object it chose best for runs left out of the curve of six objects, one seed at a time."""

_LEAST_SPREAD = 0.05
"""Of the logarithm of seconds: clocks and other programs leave no less."""


def predicted_at_most(values: FloatArray, share: float = KEPT) -> float:
    """Return the upper bound of the next of ``(n,)`` positive values, n >= 2, with probability ``share``.

    The one-sided prediction bound for one future observation, of the logarithms taken as normal
    (Hahn and Meeker, Statistical Intervals, 1991, section 4.6):
    ``exp(m + t(share, n - 1) s sqrt(1 + 1 / n))``.
    """
    count = len(values)
    if count < 2 or not (np.isfinite(values).all() and (values > 0.0).all()):
        raise WrongUse(f"a bound on the next of {count} values needs two or more, all above zero")
    logs = np.log(values)
    reach = float(stdtrit(count - 1, share)) * float(logs.std(ddof=1)) * np.sqrt(1.0 + 1.0 / count)
    return float(np.exp(logs.mean() + reach))


def like(point: Point, name: str | None) -> tuple[Sample, ...]:
    """The runs of a point that tell about one object: its own where there are enough, else all."""
    own = tuple(sample for sample in point.samples if sample.object == name)
    return own if len(own) >= _ENOUGH else point.samples


def likely_error(point: Point, name: str | None) -> float:
    """m: the mean error to be expected of one object, none counted beyond ``GROSS``.

    What is precise on one object fails on another: by touch alone a tray's floor is the same everywhere.
    The mean of the object's own runs is shrunk towards all runs' as if that were so many of its own.
    """
    own = [min(sample.error, GROSS) for sample in point.samples if sample.object == name]
    return (_LENT_ERRORS * point.error.value + sum(own)) / (_LENT_ERRORS + len(own))


def most_seconds(
    point: Point,
    name: str | None,
    speed: float = 1.0,
    spent: float | None = None,
    work: float | None = None,
) -> float:
    """Seconds on the clock that an answer takes at most, in ``KEPT`` of runs.

    Args:
        point: the setting.
        name: of the object.
        speed: how many seconds a measured CPU second takes here and now.
        spent: s that the part shared by settings has taken already; predicted where None.
        work: of the run, see ``Sample``; None where it is not known yet.
    """
    shared = max(s.shared for s in like(point, name)) * speed if spent is None else spent
    return shared + _most_of_the_rest(point, name, work) * speed


def _most_of_the_rest(point: Point, name: str | None, work: float | None) -> float:
    """The bound on the next run's own CPU seconds: about its object's mean, where that was measured.

    Objects differ in their seconds, and in how far these differ from run to run: a wrench takes much
    the same in every run, a tray ten times as long where places look alike. So the variance is the
    object's own, shrunk towards the geometric mean of all objects' as if that were known from
    ``_LENT`` degrees of freedom (Gelman et al., Bayesian Data Analysis, 3rd ed., section 2.6).

    Where the run's work is known, the mean is that of a straight line through the object's own
    logarithms, and the variance what is left about it, see ``harness.cost.bounds``.
    """
    found = lines(point, by_work=work is not None)
    pooled = sum(len(line.rest) - 1 for line in found.of.values())
    if name is None or name not in found.of or pooled < _ENOUGH:
        return predicted_at_most(np.array([sample.cpu for sample in point.samples]))
    own = found.of[name]
    freedom = len(own.rest) - 1
    lent = np.mean([_log_variance(line.rest) for line in found.of.values() if len(line.rest) > 1])
    squares = freedom * _variance(own.rest) if freedom else 0.0
    variance = (_LENT * float(np.exp(lent)) + squares) / (_LENT + freedom)
    aside = float(np.log(work)) - own.work if work is not None and found.squares > 0.0 else 0.0
    unsure = 1.0 + 1.0 / len(own.rest) + (aside**2 / found.squares if aside else 0.0)
    reach = float(stdtrit(_LENT + freedom, KEPT)) * np.sqrt(variance * unsure)
    return float(np.exp(own.seconds + found.slope * aside + reach))


def _variance(logs: FloatArray) -> float:
    return max(float(np.var(logs, ddof=1)), _LEAST_SPREAD**2)


def _log_variance(logs: FloatArray) -> float:
    """Of the variance that few values were drawn with; the logarithm of theirs is lower on average."""
    half = 0.5 * (len(logs) - 1)
    return float(np.log(_variance(logs)) + np.log(half) - digamma(half))


_STEEPEST = 1.0
"""Seconds grow at most in proportion to the work; a steeper line is a chance of few runs."""

_ALIKE = 1e-9
"""Squares that rounding leaves where all works are alike."""


@dataclass(frozen=True, eq=False)
class ObjectLine:
    """One object's runs at a setting, in logarithms."""

    work: float  #: mean over the runs; 0 where work is not looked at.
    seconds: float  #: mean of the CPU seconds beyond what settings share.
    rest: FloatArray  #: ``(runs,)`` what is left of each run's seconds about the line.


@dataclass(frozen=True, eq=False)
class ParallelLines:
    """All objects of a setting: parallel lines, one each."""

    of: Mapping[str, ObjectLine]  #: by object.
    slope: float  #: common to all: what a factor of e in work does to the logarithm of the seconds.
    squares: float
    """of the works about their objects' means, summed; 0 where work is not looked at or alike."""


def lines(point: Point, by_work: bool) -> ParallelLines:
    """Fit parallel lines of log seconds over log work, one line per object, by least squares.

    An analysis of covariance (Montgomery, Design and Analysis of Experiments, section 15.3). Lines are level
    if not ``by_work``, or if a run has no work.
    """
    by_work = by_work and all(sample.work is not None for sample in point.samples)
    groups: dict[str, list[tuple[float, float]]] = {}
    for sample in point.samples:
        work = float(np.log(sample.work)) if by_work and sample.work is not None else 0.0
        groups.setdefault(sample.object, []).append((work, float(np.log(sample.cpu))))
    arrays = {name: np.array(pairs) for name, pairs in groups.items()}
    aside = np.concatenate([pairs - pairs.mean(axis=0) for pairs in arrays.values()])
    squares = float(aside[:, 0] @ aside[:, 0])
    if squares < _ALIKE:
        squares = slope = 0.0
    else:
        slope = float(np.clip(aside[:, 0] @ aside[:, 1] / squares, 0.0, _STEEPEST))
    fitted = {}
    for name, pairs in arrays.items():
        work, seconds = pairs.mean(axis=0).tolist()
        fitted[name] = ObjectLine(work, seconds, pairs[:, 1] - seconds - slope * (pairs[:, 0] - work))
    return ParallelLines(fitted, slope, squares)
