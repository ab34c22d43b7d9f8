"""What error may be promised to the run at hand, from runs measured before.

The rules and why they are these: ``docs/decisions/0004-cost.md``.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.cost.bounds import like
from harness.cost.curve import GROSS, Point, Sample

MET = 0.95
"""Share of runs in which a promised error is to be met. Nothing is put on top for what was not sampled: a
promise's rank is rounded up, which keeps 98 % on runs left out of the curve already."""

_GROUPS = (0.5, 0.75, 0.9, 1.0)
"""Shares of the measured runs, those of least doubt, that promises are made by: few, as each that is looked
at adds a chance to be taken in by luck."""

_LENT = 4.0
"""Runs that the mean error over all objects counts for, beside an object's own ten: of 2, 4, 10 and 15 it
promised most to runs left out of the curve, and 2 hardly less."""


_ROUNDING = 1e-9
"""Of a record less one run, against the same without it."""


@dataclass(frozen=True, eq=False)
class _Record:
    """What a setting erred, by object and, as None, in all: runs, and the sum of errors up to ``GROSS``."""

    runs: Mapping[str | None, int]
    errors: Mapping[str | None, float]

    @classmethod
    def of(cls, samples: Sequence[Sample]) -> "_Record":
        runs: dict[str | None, int] = {None: 0}
        errors: dict[str | None, float] = {None: 0.0}
        for sample in samples:
            for name in (None, sample.object):
                runs[name] = runs.get(name, 0) + 1
                errors[name] = errors.get(name, 0.0) + min(sample.error, GROSS)
        return cls(runs, errors)

    def doubt(self, radius: float, name: str | None, without: Sample | None = None) -> float:
        """Of an answer about an object; a measured run does not vouch for itself."""
        out, less = (0, 0.0) if without is None else (1, min(without.error, GROSS))
        runs = self.runs[None] - out
        usual = (self.errors[None] - less) / runs if runs else GROSS
        known = name is not None and name in self.runs
        own = (self.runs[name] - out, self.errors[name] - less) if known else (0, 0.0)
        return float(np.sqrt(radius * max(_LENT * usual + own[1], 0.0) / (_LENT + own[0])))


def doubt(point: Point, radius: float, name: str | None) -> float:
    """Return the uncertainty of an answer in m: the geometric mean of its claim and its object's error.

    A small claimed error is less reliable for an object on which the setting has large errors.
    Only the order of the uncertainties matters, see ``promises``. An object that was not
    measured has the errors of all objects.
    """
    return _Record.of(point.samples).doubt(radius, name)


def doubts(point: Point, samples: Iterable[Sample]) -> FloatArray:
    """``(n,)`` m: of those of measured runs that claim anything, each by the record of the others."""
    record = _Record.of(point.samples)
    return np.array([record.doubt(s.radius, s.object, s) for s in samples if s.radius is not None])


def promises(point: Point, share: float = MET) -> tuple[FloatArray, FloatArray]:
    """What a setting can promise by how sure its answer is to be taken for.

    The ``n`` measured runs of least doubt are exchangeable with a new run of no more doubt than the last
    of them: its error stays, with probability ``share``, below the ``ceil((n + 1) share)``-th smallest of
    theirs (Vovk et al., Algorithmic Learning in a Random World, 2005, section 2.2; as a choice of whom to
    answer: Geifman and El-Yaniv, Selective classification for deep neural networks, 2017). Each group
    promises something; the least of what the groups a run belongs to promise is taken. Nothing is assumed
    of the errors' distribution, and answers that are wrong and sure of themselves are counted where they do
    harm: among the sure. That an object's record is of the same runs costs some of the exchangeability: a
    measured run's is without itself, a new run's of one more.

    Runs whose answer was refused claim nothing and promise nothing.

    Returns:
        ``(k,)`` m, ascending: doubts up to which groups go that are large enough for any promise;
        ``(k,)`` m: the error promised to an answer of no more doubt.
    """
    claiming = [sample for sample in point.samples if sample.radius is not None]
    pairs = sorted(zip(doubts(point, claiming), (sample.error for sample in claiming), strict=True))
    sure, errors = np.array([pair[0] for pair in pairs]), [pair[1] for pair in pairs]
    limits, promised = [], []
    for part in _GROUPS if pairs else ():
        limit = sure[int(np.ceil(part * len(pairs))) - 1]
        count = int(np.searchsorted(sure, limit, side="right"))
        rank = int(np.ceil((count + 1) * share - 1e-9))
        if rank <= count:
            limits.append(limit * (1.0 + _ROUNDING))
            promised.append(sorted(errors[:count])[rank - 1])
    least = np.minimum.accumulate(np.array(promised)[::-1])[::-1] if promised else np.zeros(0)
    return np.array(limits), least


def promise(point: Point, radius: float, name: str | None, share: float = MET) -> float:
    """Return the error bound in m that holds in the fraction ``share`` of runs, for a claimed radius in m.

    Infinity if too few runs were measured, or none of such uncertainty.
    """
    limits, promised = promises(point, share)
    group = int(np.searchsorted(limits, doubt(point, radius, name)))
    return float(promised[group]) if group < len(limits) else float("inf")


def promise_share(point: Point, name: str | None, error: float) -> float:
    """Share of runs like these in which the answer can promise an ``error`` in m."""
    limits, promised = promises(point)
    kept = limits[promised <= error]
    reach = float(kept.max()) if len(kept) else -1.0
    alike = like(point, name)
    return float(np.count_nonzero(doubts(point, alike) <= reach) / len(alike))


def smallest_promise(point: Point, name: str | None) -> float:
    """Return the smallest error in m that a setting promises to any of the runs like these, or infinity."""
    return float(_find_bounds(point, name).min(initial=np.inf))


def typical_promise(point: Point, name: str | None) -> float:
    """Metres promised to half of the runs like these, or infinity."""
    found = _find_bounds(point, name)
    return float(np.median(found)) if len(found) else float("inf")


def _find_bounds(point: Point, name: str | None) -> FloatArray:
    limits, promised = promises(point)
    return np.append(promised, np.inf)[np.searchsorted(limits, doubts(point, like(point, name)))]
