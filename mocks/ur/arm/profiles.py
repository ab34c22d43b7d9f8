"""How a motion spends its time: the trapezoid of speed, and the ramp to a standstill."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Trapezoid:
    """Rest to rest over one unit of way.

    Attributes:
        duration: s.
        ramp: s of speeding up, and again of slowing down.
    """

    duration: float
    ramp: float

    def share(self, time: float) -> float:
        """Share of the way done after ``time`` s, 0 to 1; exactly 1 from the end on."""
        if time >= self.duration:
            return 1.0
        peak = 1.0 / (self.duration - self.ramp)
        if time < self.ramp:
            return 0.5 * peak * time * time / self.ramp
        left = self.duration - time
        if left < self.ramp:
            return 1.0 - 0.5 * peak * left * left / self.ramp
        return peak * (time - 0.5 * self.ramp)


def trapezoid(length: float, speed: float, acceleration: float) -> Trapezoid:
    """The fastest at no more than ``speed`` and ``acceleration``; without a cruise where the way is short.

    An infinite acceleration is at full speed all the way.
    """
    if length <= 0.0:
        return Trapezoid(0.0, 0.0)
    ramp = min(speed / acceleration, math.sqrt(length / acceleration))
    peak = min(speed, acceleration * ramp) if ramp > 0.0 else speed
    return Trapezoid(length / peak + ramp, ramp)


def lasting(duration: float, ramp_share: float = 0.25) -> Trapezoid:
    """One that takes a given time, each ramp a share of it."""
    return Trapezoid(duration, ramp_share * duration)


def braking_way(time: float, until: float) -> float:
    """Way in units of the first speed, ``time`` s into a ramp that ends at rest after ``until`` s."""
    if time >= until:
        return 0.5 * until
    return time * (1.0 - 0.5 * time / until)
