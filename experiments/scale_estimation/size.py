"""What is believed of an object's size: a density over the logarithm of its longest side.

Each sense hands on a density of its own, and the fused one is their product. Each is first mixed with a
little of the uniform density, so that one wrong sense cannot silence the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import OutOfDomain

STEP = 1.0e-3
"""Of the logarithm, between points of the grid: a tenth of what the best sense can tell apart."""

BEYOND = 2.0
"""Factor by which every sense searches beyond the range it is asked about, each way: an object outside is
recognised as such. A search within the range would pile it up at the border, or take a wrong place inside."""

ENDS = 0.01
"""Of the logarithm, beyond each end of a range, that belongs to it: a thing is made half a per cent off its
drawing, so that one of the least size asked about may measure a little less."""

FLOOR = 0.02
"""Share of the uniform density that every sense is mixed with before the product is taken."""

SHARED = 3.0e-3
"""Error of the logarithm that all senses share: an object's longest side is longer than its model's, by
unevenness that neither an outline nor contacts elsewhere show."""

UNEVEN_EXCESS = 0.15e-3
"""Mean in m by which a made object's longest side exceeds that of its CAD model at the same scale: the side
ends at the highest points of an uneven surface."""

UNEVEN_SIGMA = 0.35e-3
"""Standard deviation in m of that excess: a quarter of a millimetre at each end."""

STRANGE = 0.05
"""How much less likely a size beyond the range is than one within, before anything is read."""

CREDIBLE = 0.9
"""Probability that the stated interval holds."""


@dataclass(frozen=True)
class SizeRange:
    """Sizes that an object may have."""

    low: float  #: m, the least longest side of its bounding box.
    high: float  #: m, the greatest.

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and 0.0 < self.low < self.high):
            raise OutOfDomain(
                f"sizes from {self.low!r} to {self.high!r} m were asked about; give a range whose low end is "
                "greater than zero and less than its high end"
            )

    @cached_property
    def logs(self) -> FloatArray:
        """``(n,)`` logarithms of the sizes in m that are searched, ``STEP`` apart, beyond the range."""
        low, high = np.log(self.low / BEYOND), np.log(self.high * BEYOND)
        return read_only(np.linspace(low, high, round((high - low) / STEP) + 1))

    @cached_property
    def inside(self) -> FloatArray:
        """``(n,)`` bool: which of them are in the range that was asked about."""
        return self._within(0.5 * STEP)

    @cached_property
    def possible(self) -> FloatArray:
        """``(n,)`` bool: which of them an object of that range may measure, ``ENDS`` beyond it included."""
        return self._within(ENDS + 0.5 * STEP)

    def _within(self, beyond: float) -> FloatArray:
        logs = self.logs
        return read_only((logs >= np.log(self.low) - beyond) & (logs <= np.log(self.high) + beyond))


@dataclass(frozen=True, eq=False)
class Belief:
    """What is believed of a size."""

    range: SizeRange  #: of sizes asked about.
    log_density: FloatArray  #: ``(n,)`` over ``range.logs``, normalised over all that is searched.

    @classmethod
    def of(cls, range_: SizeRange, log_density: FloatArray) -> "Belief":
        """From a density that need not be normalised; minus infinity where a size is impossible.

        Raises:
            OutOfDomain: not a number, of another length than the grid, or impossible everywhere.
        """
        given = np.asarray(log_density, dtype=np.float64)
        if given.shape != range_.logs.shape or np.isnan(given).any() or not given.max() > -np.inf:
            raise OutOfDomain(
                f"a density of shape {given.shape} was given for {len(range_.logs)} sizes; give one finite "
                "number a size, or minus infinity for a size that cannot be (not for all of them)"
            )
        given = given - given.max()
        return cls(range_, read_only(given - np.log(np.exp(given).sum() * STEP)))

    @classmethod
    def ignorant(cls, range_: SizeRange) -> "Belief":
        """Every size of the range as likely, in its logarithm; none beyond."""
        return cls.of(range_, np.where(range_.possible, 0.0, -np.inf))

    @cached_property
    def _shares(self) -> FloatArray:
        """``(n,)`` probabilities of the sizes in the range, as the answer is about those."""
        found = np.where(self.range.possible, np.exp(self.log_density), 0.0)
        total = found.sum()
        if total > 0.0:
            return np.asarray(found / total)
        # Nothing inside: the border nearest to what is believed.
        inside, best = np.flatnonzero(self.range.possible), int(np.argmax(self.log_density))
        found[inside[0] if best < inside[0] else inside[-1]] = 1.0
        return found

    @property
    def outside(self) -> float:
        """Probability that the size is not in the range that was asked about, which is thought of as rare."""
        density, inside = np.exp(self.log_density), self.range.possible.astype(bool)
        beyond = STRANGE * float(density[~inside].sum())
        return beyond / (beyond + float(density[inside].sum())) if beyond > 0.0 else 0.0

    @property
    def size(self) -> float:
        """M, the median of the sizes in the range."""
        return float(np.exp(_quantile(self.range.logs, self._shares, 0.5)))

    def below(self, probability: float) -> float:
        """M that the size is below with so much probability, sizes beyond the range included."""
        return float(np.exp(_quantile(self.range.logs, np.exp(self.log_density), probability)))

    @property
    def interval(self) -> tuple[float, float]:
        """M, the shortest interval in the logarithm that holds nine tenths of the probability."""
        edges = np.append(self.range.logs - 0.5 * STEP, self.range.logs[-1] + 0.5 * STEP)
        below = np.append(0.0, np.cumsum(self._shares))
        starts = np.flatnonzero(below + CREDIBLE <= below[-1] + 1e-12)
        ends = np.interp(below[starts] + CREDIBLE, below, edges)
        shortest = int(np.argmin(ends - edges[starts]))
        return float(np.exp(edges[starts[shortest]])), float(np.exp(ends[shortest]))

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm, over the range."""
        logs = self.range.logs
        middle = float(self._shares @ logs)
        return float(np.sqrt(self._shares @ (logs - middle) ** 2))

    @property
    def likeliest(self) -> float:
        """M, where the density is greatest, a size beyond the range thought of as rare."""
        return float(np.exp(self.range.logs[int(np.argmax(self._weights))]))

    def share_about(self, size: float, reach: float) -> float:
        """Probability of the sizes whose logarithm is no further than ``reach`` from that of one in m."""
        near = np.abs(self.range.logs - np.log(size)) <= reach
        return float(self._weights[near].sum() / self._weights.sum())

    @cached_property
    def _weights(self) -> FloatArray:
        """``(n,)`` density, not normalised, of sizes in the range and, as rare, beyond."""
        return np.asarray(np.exp(self.log_density) * np.where(self.range.possible, 1.0, STRANGE))

    def doubted(self, share: float) -> "Belief":
        """The same with so much probability spread evenly over all that is searched."""
        uniform = 1.0 / (STEP * len(self.log_density))
        return Belief.of(self.range, np.log((1.0 - share) * np.exp(self.log_density) + share * uniform))

    def widened(self, sigma: float) -> "Belief":
        """The same, its logarithm off by a normal error of that standard deviation besides."""
        if sigma < 0.25 * STEP:
            return self
        reach = int(np.ceil(6.0 * sigma / STEP))
        kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * STEP / sigma) ** 2)
        density = np.exp(self.log_density - self.log_density.max())
        spread = np.convolve(np.pad(density, reach, mode="edge"), kernel / kernel.sum(), mode="valid")
        with np.errstate(divide="ignore"):
            return Belief.of(self.range, np.log(spread))


def add_unevenness(belief: Belief) -> Belief:
    """Convert a density of the CAD model's size to one of the made object's longest side.

    Args:
        belief: density of the size at which the CAD model fits the readings.
    """
    excess = UNEVEN_EXCESS / belief.size
    logs, density = belief.range.logs, np.exp(belief.log_density)
    with np.errstate(divide="ignore"):
        shifted = np.log(np.interp(logs - excess, logs, density))
    return Belief.of(belief.range, shifted).widened(UNEVEN_SIGMA / belief.size)


def fused(beliefs: Sequence[Belief]) -> Belief:
    """What several senses believe together, each on evidence of its own but for what they err by alike.

    Raises:
        OutOfDomain: no belief was given, or of different ranges.
    """
    if not beliefs or any(one.range != beliefs[0].range for one in beliefs):
        raise OutOfDomain("beliefs about one range of sizes can be fused, one or more; give such")
    if len(beliefs) == 1:
        return beliefs[0]
    product = np.sum([one.doubted(FLOOR).log_density for one in beliefs], axis=0)
    return Belief.of(beliefs[0].range, product).widened(SHARED)


def _quantile(logs: FloatArray, shares: FloatArray, share: float) -> float:
    """Within the grid's step, as if each share were spread evenly over its own."""
    ends = np.cumsum(shares)
    k = int(np.searchsorted(ends, share * ends[-1]))
    before = ends[k] - shares[k]
    return float(logs[k] + STEP * ((share * ends[-1] - before) / shares[k] - 0.5))
