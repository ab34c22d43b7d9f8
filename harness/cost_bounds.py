"""What a next run will cost at most, and how far its answer may be off, from runs measured before."""

import numpy as np
from scipy import stats

from harness.arrays import FloatArray
from harness.cost import Point, Sample
from harness.errors import WrongUse

KEPT = 0.975
"""Share of runs in which a budget is to be kept: above the 95 % promised, for what was not sampled."""

MET = 0.95
"""Share of runs in which an error is to be met."""

_ENOUGH = 4


def predicted_at_most(values: FloatArray, share: float = KEPT) -> float:
    """What the next of such positive values stays below with probability ``share``.

    The one-sided prediction bound for one future observation, of the logarithms taken as normal
    (Hahn and Meeker, Statistical Intervals, 1991, section 4.6):
    ``exp(m + t(share, n - 1) s sqrt(1 + 1 / n))``.

    Args:
        values: ``(n,)``, n at least 2.
        share: between one half and 1.
    """
    count = len(values)
    if count < 2 or not (np.isfinite(values).all() and (values > 0.0).all()):
        raise WrongUse(f"a bound on the next of {count} values needs two or more, all above zero")
    logs = np.log(values)
    reach = float(stats.t.ppf(share, count - 1)) * float(logs.std(ddof=1)) * np.sqrt(1.0 + 1.0 / count)
    return float(np.exp(logs.mean() + reach))


def like(point: Point, name: str | None) -> tuple[Sample, ...]:
    """The runs of a point that tell about one object: its own where there are enough, else all."""
    own = tuple(sample for sample in point.samples if sample.object == name)
    return own if len(own) >= _ENOUGH else point.samples


def most_seconds(point: Point, name: str | None, speed: float = 1.0, spent: float | None = None) -> float:
    """Seconds on the clock that an answer takes at most, in ``KEPT`` of runs.

    Args:
        point: the setting.
        name: of the object.
        speed: how many seconds a measured CPU second takes here and now.
        spent: s that the part shared by all settings has taken already; predicted where None.
    """
    shared = max(s.shared for s in like(point, name)) * speed if spent is None else spent
    return shared + _most_of_the_rest(point, name) * speed


def _most_of_the_rest(point: Point, name: str | None) -> float:
    """The bound on the next run's own CPU seconds: about its object's mean, where that was measured.

    Objects differ far more than runs of one object do, and these alike: the spread within objects
    is taken from all of them together, so two runs of each already tell it.
    """
    groups: dict[str, list[float]] = {}
    for sample in point.samples:
        groups.setdefault(sample.object, []).append(float(np.log(sample.cpu)))
    freedom = len(point.samples) - len(groups)
    if name not in groups or freedom < _ENOUGH:
        return predicted_at_most(np.array([sample.cpu for sample in point.samples]))
    own = np.array(groups[name])
    squares = sum(float(((np.array(logs) - np.mean(logs)) ** 2).sum()) for logs in groups.values())
    reach = float(stats.t.ppf(KEPT, freedom)) * np.sqrt(squares / freedom * (1.0 + 1.0 / len(own)))
    return float(np.exp(own.mean() + reach))


def stretch(point: Point, share: float = MET) -> float:
    """What a claimed 90 % radius must be multiplied with to hold the truth in ``share`` of runs.

    Split conformal prediction with error / radius as the score (Lei et al., Distribution-free
    predictive inference for regression, 2018): the ``ceil((n + 1) share)``-th smallest score.
    Nothing is assumed of the errors' distribution, and a radius that claims too much is found out.

    Returns:
        Infinity where too few runs were measured to promise that share.
    """
    scores = [s.error / s.radius for s in point.samples if s.radius is not None and s.radius > 0.0]
    rank = int(np.ceil((len(scores) + 1) * share - 1e-9))
    return float(np.sort(scores)[rank - 1]) if 1 <= rank <= len(scores) else float("inf")


def promise_share(point: Point, name: str | None, error: float) -> float:
    """Share of runs like these in which the answer can promise an ``error`` in m."""
    factor, samples = stretch(point), like(point, name)
    return float(np.mean([s.radius is not None and factor * s.radius <= error for s in samples]))
