"""The times of an instrument's samples on the bench clock, from when they arrived.

A sample arrives after it was taken, by a latency that varies but has a floor; so the line of
sample number against arrival time lies under all arrivals and touches the quickest. Of the lines
under all points the one nearest to them is an edge of their lower convex hull (Moon, Skelly and
Towsley, "Estimation and removal of clock skew from network delay measurements", INFOCOM 1999).
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only

BUCKET = 0.1
"""s: of the arrivals within it, the quickest is kept."""

_KEPT_BUCKETS = 600


@dataclass(frozen=True, eq=False)
class ClockFit:
    """A steady clock of samples."""

    start: float  #: s on the bench clock at which sample 0 was taken, plus the least latency.
    rate: float  #: Hz, samples a second of the bench clock.
    residual: float  #: s, median lateness of the arrivals that it was fitted to.
    samples: FloatArray  #: ``(n,)`` numbers of the samples that it was fitted to.
    arrivals: FloatArray  #: ``(n,)`` s on the bench clock, of those.

    def time(self, sample: float) -> float:
        """Bench-clock seconds at which a sample was taken."""
        return self.start + sample / self.rate

    @property
    def lateness(self) -> FloatArray:
        """``(n,)`` s by which the arrivals it was fitted to were later than it says."""
        late: FloatArray = self.arrivals - self.start - self.samples / self.rate
        return late

    @property
    def span(self) -> float:
        """Seconds between the first and the last arrival."""
        return float(self.arrivals[-1] - self.arrivals[0])


class ArrivalClock:
    """Collects arrivals of a run and fits a clock to them.

    Args:
        nominal_rate: Hz, as the maker states it: good enough to tell which of two arrivals was the
            quicker within a ``BUCKET``, and used for nothing else.
    """

    def __init__(self, nominal_rate: float) -> None:
        self._nominal = nominal_rate
        self._origin: tuple[float, float] | None = None
        self._quickest: deque[tuple[float, float]] = deque(maxlen=_KEPT_BUCKETS)
        self._bucket = -1
        self._lead = 0.0

    def arrived(self, sample: int, time: float) -> None:
        """Sample ``sample`` was the newest to be there at ``time`` s on the bench clock."""
        if self._origin is None:
            self._origin = (float(sample), time)
        late = (time - self._origin[1]) - (sample - self._origin[0]) / self._nominal
        bucket = int((time - self._origin[1]) / BUCKET)
        if bucket != self._bucket:
            self._bucket, self._lead = bucket, late
            self._quickest.append((float(sample), time))
        elif late < self._lead:
            self._lead = late
            self._quickest[-1] = (float(sample), time)

    @property
    def span(self) -> float:
        """Seconds over which arrivals are kept."""
        return self._quickest[-1][1] - self._quickest[0][1] if self._quickest else 0.0

    def fit(self) -> ClockFit:
        """The steady clock under all arrivals kept.

        Raises:
            ValueError: fewer than two are kept.
        """
        points = np.array(self._quickest)
        if len(points) < 2:
            raise ValueError("a clock needs arrivals at two moments; wait longer before it is fitted")
        samples, arrivals = points[:, 0] - points[0, 0], points[:, 1] - points[0, 1]
        first, last = _edge_under(samples, arrivals)
        period = (arrivals[last] - arrivals[first]) / (samples[last] - samples[first])
        start = arrivals[first] - period * samples[first]
        residual = float(np.median(arrivals - start - period * samples))
        zero = points[0, 1] + start - period * points[0, 0]
        return ClockFit(
            float(zero),
            float(1.0 / period),
            residual,
            read_only(points[:, 0].copy()),
            read_only(points[:, 1].copy()),
        )


def _edge_under(x: FloatArray, y: FloatArray) -> tuple[int, int]:
    """The edge of the lower hull of points in order of ``x`` that is over their mean ``x``."""
    hull: list[int] = []
    for index in range(len(x)):
        while len(hull) > 1 and _turns_down(x, y, hull[-2], hull[-1], index):
            hull.pop()
        hull.append(index)
    middle = float(x.mean())
    last = next(k for k in range(1, len(hull)) if x[hull[k]] >= middle or k == len(hull) - 1)
    return hull[last - 1], hull[last]


def _turns_down(x: FloatArray, y: FloatArray, a: int, b: int, c: int) -> bool:
    """Whether ``b`` is on or above the line from ``a`` to ``c``."""
    return bool((y[b] - y[a]) * (x[c] - x[a]) >= (y[c] - y[a]) * (x[b] - x[a]))
