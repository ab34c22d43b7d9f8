"""The motions of a program: each moves the arm one cycle at a time until it is done.

Blends are not modelled: every move comes to rest at its goal.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Generic, Protocol, TypeVar

from mocks.ur.arm import poses
from mocks.ur.arm.poses import Vector
from mocks.ur.hooks import CYCLE, Matrix, Six


@dataclass(frozen=True)
class Trapezoid:
    """Rest to rest over one unit of way."""

    duration: float  #: s.
    ramp: float  #: s of speeding up, and again of slowing down.

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


TURN_LENGTH: Final = 0.1
"""m of way that one radian of turning counts as, for the speed of a line that turns more than it moves."""

Twist = tuple[Vector, Vector]
"""m/s and rad/s of the tool centre point, in base."""


Goal = TypeVar("Goal", Six, Matrix)


class ArmBody(Protocol):
    """What a motion moves."""

    joints: Six  #: rad, commanded.
    speeds: Six  #: rad/s, over the last cycle.
    twist: Twist  #: of the tool centre point, over the last cycle.

    @property
    def base_from_tcp(self) -> Matrix:
        """Where the tool centre point is commanded to be."""

    def put_joints(self, joints: Six) -> None:
        """Command joints."""

    def put_tcp(self, base_from_tcp: Matrix) -> None:
        """Command a pose on the present branch; a stop where no joints reach it."""


class ArmMotion(Protocol):
    """One cycle at a time."""

    @property
    def done(self) -> bool:
        """Whether nothing is left to do."""

    def advance(self, body: ArmBody, seconds: float) -> None:
        """Move on by one cycle; ``seconds`` is less than a cycle where the speed slider is below 1."""

    def replan(self) -> None:
        """Start again from where the arm is, after a stop in between."""


class _PlannedMove(Generic[Goal]):
    """A move from rest to rest that is planned at its start.

    Args:
        goal: joints in rad, or ``base_from_tcp``.
        speed: speed of the leading joint in rad/s, or of the tool in m/s.
        acceleration: acceleration of the leading joint in rad/s^2, or of the tool in m/s^2.
        duration: duration in s; above zero it replaces speed and acceleration.
    """

    def __init__(self, goal: Goal, speed: float, acceleration: float, duration: float = 0.0) -> None:
        self._goal: Goal = goal
        self._limits = speed, acceleration, duration
        self._start: Goal | None = None
        self._profile = Trapezoid(0.0, 0.0)
        self._time = 0.0
        self.done = False

    def advance(self, body: ArmBody, seconds: float) -> None:
        """Move on."""
        start = self._start
        if start is None:
            speed, acceleration, duration = self._limits
            self._start = start = self._place(body)
            self._time, length = 0.0, self._length(start)
            self._profile = lasting(duration) if duration > 0.0 else trapezoid(length, speed, acceleration)
        self._time += seconds
        share = self._profile.share(self._time)
        self.done = share == 1.0
        self._put(body, start, share)

    def replan(self) -> None:
        """From where the arm is."""
        self._start = None

    @abstractmethod
    def _place(self, body: ArmBody) -> Goal:
        """Return the position of the arm: joints, or the pose of the tool centre point."""

    @abstractmethod
    def _length(self, start: Goal) -> float:
        """Return the length of the move, in rad or m."""

    @abstractmethod
    def _put(self, body: ArmBody, start: Goal, share: float) -> None:
        """Command the body to a fraction of the move."""


class MoveJoints(_PlannedMove[Six]):
    """``movej``: all joints move in proportion to the joint with the longest motion."""

    def _place(self, body: ArmBody) -> Six:
        return body.joints

    def _length(self, start: Six) -> float:
        return max(abs(b - a) for a, b in zip(start, self._goal, strict=True))

    def _put(self, body: ArmBody, start: Six, share: float) -> None:
        pairs = zip(start, self._goal, strict=True)
        body.put_joints(self._goal if self.done else as_six([a + share * (b - a) for a, b in pairs]))


class MoveLine(_PlannedMove[Matrix]):
    """``movel``: the tool centre point moves in a straight line and rotates uniformly."""

    _turn: Vector = (0.0, 0.0, 0.0)

    def _place(self, body: ArmBody) -> Matrix:
        return body.base_from_tcp

    def _length(self, start: Matrix) -> float:
        self._turn = poses.rotation_vector(poses.compose(poses.inverse(start), self._goal))
        length = math.dist(poses.translation(start), poses.translation(self._goal))
        return max(length, TURN_LENGTH * math.hypot(*self._turn))

    def _put(self, body: ArmBody, start: Matrix, share: float) -> None:
        end = poses.translation(self._goal)
        body.put_tcp(self._goal if self.done else poses.between(start, self._turn, end, share))


class SpeedLine:
    """``speedl``: towards a velocity of the tool; done after ``seconds``, or once it is reached.

    Args:
        target: m/s and rad/s of the tool centre point, in base.
        acceleration: m/s^2.
        turning: rad/s^2.
        seconds: None for as long as it takes.
    """

    def __init__(self, target: Six, acceleration: float, turning: float, seconds: float | None) -> None:
        self._target = target
        self._rates = acceleration, turning
        self._left = seconds
        self.done = False

    def advance(self, body: ArmBody, seconds: float) -> None:
        """Move on."""
        linear, angular = body.twist
        target = [seconds / CYCLE * speed for speed in self._target]
        velocity, there = _approached(linear, target[:3], self._rates[0] * CYCLE)
        turning, turned = _approached(angular, target[3:], self._rates[1] * CYCLE)
        body.put_tcp(poses.carried(body.base_from_tcp, (*velocity, *turning), CYCLE))
        self._left = None if self._left is None else self._left - CYCLE
        self.done = (there and turned) if self._left is None else self._left < 0.5 * CYCLE

    def replan(self) -> None:
        """Nothing to plan."""


def as_six(numbers: Sequence[float]) -> Six:
    """Six numbers."""
    a, b, c, d, e, f = numbers
    return a, b, c, d, e, f


def _approached(present: Sequence[float], target: Sequence[float], step: float) -> tuple[list[float], bool]:
    """The speed a step nearer to the target, and whether that is the target."""
    change = [b - a for a, b in zip(present, target, strict=True)]
    size = math.hypot(*change)
    if size <= step:
        return list(target), True
    return [a + step / size * d for a, d in zip(present, change, strict=True)], False


_STILL: Final = 1e-9
"""m/s below which only turning is left to stop."""


class StopJoints:
    """``stopj``: every joint to rest in proportion, the fastest at ``deceleration`` rad/s^2."""

    def __init__(self, deceleration: float) -> None:
        self._deceleration = deceleration
        self._start: tuple[Six, Six] | None = None
        self._until = 0.0
        self._time = 0.0
        self.done = False

    def advance(self, body: ArmBody, _seconds: float) -> None:
        """Move on."""
        if self._start is None:
            self._start = body.joints, body.speeds
            self._until = max(map(abs, body.speeds)) / self._deceleration
        self._time += CYCLE
        way = braking_way(self._time, self._until)
        joints, speeds = self._start
        body.put_joints(as_six([q + way * speed for q, speed in zip(joints, speeds, strict=True)]))
        self.done = self._time >= self._until + CYCLE

    def replan(self) -> None:
        """From the speed the arm has then: none."""
        self._start, self._time = None, 0.0


class StopLine:
    """``stopl``: the tool centre point to rest along its present velocity."""

    def __init__(self, deceleration: float, turning: float) -> None:
        self._rates = deceleration, turning
        self._start: tuple[Matrix, Twist] | None = None
        self._until = 0.0
        self._time = 0.0
        self.done = False

    def advance(self, body: ArmBody, _seconds: float) -> None:
        """Move on."""
        if self._start is None:
            self._start = body.base_from_tcp, body.twist
            linear, angular = (math.hypot(*part) for part in body.twist)
            turning = angular / self._rates[1] if linear < _STILL else 0.0
            self._until = max(linear / self._rates[0], turning)
        self._time += CYCLE
        pose, (linear_start, angular_start) = self._start
        if self._until > 0.0:
            body.put_tcp(
                poses.carried(pose, (*linear_start, *angular_start), braking_way(self._time, self._until))
            )
        self.done = self._time >= self._until + CYCLE

    def replan(self) -> None:
        """From the speed the arm has then: none."""
        self._start, self._time = None, 0.0
