"""What accuracy costs: errors and seconds as measured, the settings worth taking, and which to take.

A setting is a choice of levels. It is measured on many runs, the same runs for every setting, so
that settings are compared in pairs. Error is stated as the mean, each counted at 20 mm at most: a
median would not see the run in five that fails grossly, and a plain mean would see little else.
Seconds are stated as the geometric mean: they span decades, and "half as long again" is a ratio.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.metrics import Interval, bootstrap, mean, median
from harness.effects.accuracy import Level

GROSS = 20.0e-3
"""m: errors beyond this are failures, and count alike; as the estimate itself counts them."""


@dataclass(frozen=True)
class ErrorUnit:
    """What a program's errors are."""

    key: str  #: of the unit, where a name has to say it.
    label: str  #: of an error that is drawn.
    scale: float = 1.0  #: what an error is multiplied by to be shown.
    gross: float = float("inf")  #: errors beyond this are failures, and count alike.


METRES = ErrorUnit("m", "error in mm (mean, each at most 20 mm; 90 % interval)", 1e3, GROSS)


@dataclass(frozen=True)
class Sample:
    """One run, answered at one setting."""

    run: str  #: its name; the same readings at every setting.
    object: str  #: what was touched, by a name that two different objects do not share.
    error: float  #: in the point's unit; a refused answer counts as a random one.
    radius: float | None  #: m, within which the answer itself claims 90 %; None where it claims nothing.
    shared: float  #: s of CPU time for what is done alike at every setting that needs it: reading images.
    cpu: float  #: s of CPU time for the rest.
    wall: float  #: s on the clock for the rest.
    work: float | None = None
    """what the run itself showed, before it was answered, of how much there is to do; what it counts is the
    program's own. None where it was not counted."""

    def __post_init__(self) -> None:
        numbers = (self.error, 0.0 if self.radius is None else self.radius, self.shared, self.cpu, self.wall)
        if not all(np.isfinite(number) and number >= 0.0 for number in numbers):
            raise WrongUse(
                f"run {self.run}: error, radius and seconds must be finite and not negative, not {numbers}"
            )
        if self.work is not None and not (np.isfinite(self.work) and self.work > 0.0):
            raise WrongUse(f"run {self.run}: work must be finite and above zero, not {self.work}")
        if self.cpu == 0.0 or self.wall == 0.0:
            raise WrongUse(f"run {self.run}: an answer in 0 s was not measured; use a finer clock")


@dataclass(frozen=True, eq=False)
class Point:
    """One setting, measured."""

    name: str  #: for people.
    levels: Mapping[str, Level]  #: of the dials that are turned.
    condition: Mapping[str, Level]
    """what was given and not chosen: how many contacts, whether the yaw was known."""
    samples: tuple[Sample, ...]  #: at least one, each of another run.
    unit: ErrorUnit = METRES  #: of the samples' errors.

    def __post_init__(self) -> None:
        runs = [sample.run for sample in self.samples]
        if not runs or len(set(runs)) != len(runs):
            raise WrongUse(f"{self.name}: {len(runs)} samples of {len(set(runs))} runs; give each run once")
        object.__setattr__(self, "levels", MappingProxyType(dict(self.levels)))
        object.__setattr__(self, "condition", MappingProxyType(dict(self.condition)))

    @cached_property
    def errors(self) -> FloatArray:
        """``(runs,)`` in the unit."""
        return np.array([sample.error for sample in self.samples])

    @cached_property
    def cpu_seconds(self) -> FloatArray:
        """``(runs,)`` s of CPU time, from readings to answer."""
        return np.array([sample.shared + sample.cpu for sample in self.samples])

    @cached_property
    def wall_seconds(self) -> FloatArray:
        """``(runs,)`` s on the clock, from readings to answer."""
        return np.array([sample.shared + sample.wall for sample in self.samples])

    @cached_property
    def error(self) -> Interval:
        """Mean over the runs, none counted beyond the unit's ``gross``, with its 90 % bootstrap interval."""
        return bootstrap(np.minimum(self.errors, self.unit.gross), mean)

    @cached_property
    def median_error(self) -> Interval:
        """Of the runs, with its 90 % bootstrap interval."""
        return bootstrap(self.errors, median)

    @cached_property
    def seconds(self) -> Interval:
        """In s of CPU time: geometric mean over the runs, with its 90 % bootstrap interval."""
        return bootstrap(self.cpu_seconds, geometric_mean)


@dataclass(frozen=True, eq=False)
class Curve:
    """All settings of a program, with where and with what they were measured."""

    program: str  #: such as ``"contact-localization"``.
    points: tuple[Point, ...]  #: measured.
    machine: Mapping[str, str]  #: its description, see ``harness.cost.provenance``.
    code: Mapping[str, str]  #: its version, likewise.
    made: str  #: ISO time of the last measurement.
    title: str = ""  #: of the page.
    notes: tuple[str, ...] = field(default=())

    def where(self, condition: Mapping[str, Level]) -> tuple[Point, ...]:
        """The points measured under a condition; what it leaves open may be anything."""
        return tuple(
            point for point in self.points if all(point.condition.get(k) == v for k, v in condition.items())
        )

    def conditions(self) -> tuple[dict[str, Level], ...]:
        """Each condition that points were measured under, once, in their order."""
        found: list[dict[str, Level]] = []
        for point in self.points:
            if dict(point.condition) not in found:
                found.append(dict(point.condition))
        return tuple(found)


def geometric_mean(values: FloatArray) -> FloatArray:
    """``(k,)`` geometric means of ``(k, n)`` positive values."""
    return np.asarray(np.exp(np.log(values).mean(axis=1)))


def front(points: Iterable[Point]) -> tuple[Point, ...]:
    """The points that no other beats in error without costing more (Pareto), cheapest first."""
    kept: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds.value, p.error.value)):
        if not kept or point.error.value < kept[-1].error.value:
            kept.append(point)
    return tuple(kept)


def best_within(
    points: Sequence[Point],
    seconds: float,
    prices: Mapping[str, float] | None = None,
    errors: Mapping[str, float] | None = None,
) -> Point | None:
    """Return the setting of least error that costs at most ``seconds``; None if none does.

    ``prices`` in s and ``errors`` in m by name of a point stand for its measured means.
    """
    if not (np.isfinite(seconds) and seconds > 0.0):
        raise WrongUse(f"a budget of {seconds:g} s cannot be kept; give a number above zero")
    price = {p.name: p.seconds.value for p in points} if prices is None else prices
    loss = {p.name: p.error.value for p in points} if errors is None else errors
    within = [point for point in points if price[point.name] <= seconds]
    return min(within, key=lambda p: (loss[p.name], price[p.name]), default=None)
