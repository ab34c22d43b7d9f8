"""How a setting's seconds grow with what a run shows, before it is answered, of how much there is to do."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.cost.curve import Point

_STEEPEST = 1.0
"""Seconds grow at most in proportion to the work; a steeper line is a chance of few runs."""

_ALIKE = 1e-9
"""Squares that rounding leaves where all works are alike."""


@dataclass(frozen=True, eq=False)
class ObjectLine:
    """One object's runs at a setting, in logarithms.

    Attributes:
        work: mean over the runs; 0 where work is not looked at.
        seconds: mean of the CPU seconds beyond what settings share.
        rest: ``(runs,)`` what is left of each run's seconds about the line.
    """

    work: float
    seconds: float
    rest: FloatArray


@dataclass(frozen=True, eq=False)
class ParallelLines:
    """All objects of a setting: parallel lines, one each.

    Attributes:
        of: by object.
        slope: common to all: what a factor of e in work does to the logarithm of the seconds.
        squares: of the works about their objects' means, summed; 0 where work is not looked at or alike.
    """

    of: Mapping[str, ObjectLine]
    slope: float
    squares: float

    @property
    def pooled(self) -> int:
        """Runs beyond the first of each object."""
        return sum(len(line.rest) - 1 for line in self.of.values())


def lines(point: Point, by_work: bool) -> ParallelLines:
    """Parallel lines of the logarithm of seconds over that of work, one an object, by least squares.

    An analysis of covariance (Montgomery, Design and Analysis of Experiments, section 15.3).

    Args:
        point: the setting.
        by_work: whether to look at work; without, or where a run of the setting has none, all lines
            are level and the rest is what is left about the object's mean.
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
    return ParallelLines({name: _line(pairs, slope) for name, pairs in arrays.items()}, slope, squares)


def _line(pairs: FloatArray, slope: float) -> ObjectLine:
    work, seconds = pairs.mean(axis=0)
    return ObjectLine(float(work), float(seconds), pairs[:, 1] - seconds - slope * (pairs[:, 0] - work))
