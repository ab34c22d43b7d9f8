"""The motions of a program: each moves the arm one cycle at a time until it is done.

Blends are not modelled: every move comes to rest at its goal.
"""

import math
from collections.abc import Sequence
from typing import Final, Protocol

from mocks.ur.arm import poses
from mocks.ur.arm.poses import Vector
from mocks.ur.arm.profiles import Trapezoid, lasting, trapezoid
from mocks.ur.hooks import CYCLE, Matrix, Six

TURN_LENGTH: Final = 0.1
"""m of way that one radian of turning counts as, for the speed of a line that turns more than it moves."""

Twist = tuple[Vector, Vector]
"""m/s and rad/s of the tool centre point, in base."""


class ArmBody(Protocol):
    """What a motion moves.

    Attributes:
        joints: rad, commanded.
        speeds: rad/s, over the last cycle.
        twist: of the tool centre point, over the last cycle.
    """

    joints: Six
    speeds: Six
    twist: Twist

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


class MoveJoints:
    """``movej``: all joints in proportion to the one that turns most.

    Args:
        goal: rad.
        speed: rad/s of the leading joint.
        acceleration: rad/s^2 of the leading joint.
        duration: s; where above zero it decides instead.
    """

    def __init__(self, goal: Six, speed: float, acceleration: float, duration: float = 0.0) -> None:
        self._goal = goal
        self._limits = speed, acceleration, duration
        self._start: Six | None = None
        self._profile = Trapezoid(0.0, 0.0)
        self._time = 0.0
        self.done = False

    def advance(self, body: ArmBody, seconds: float) -> None:
        """Move on."""
        if self._start is None:
            self._begin(body)
        assert self._start is not None, "just begun"
        self._time += seconds
        share = self._profile.share(self._time)
        self.done = share == 1.0
        body.put_joints(self._goal if self.done else _mixed(self._start, self._goal, share))

    def replan(self) -> None:
        """From where the arm is."""
        self._start = None

    def _begin(self, body: ArmBody) -> None:
        speed, acceleration, duration = self._limits
        self._start, self._time = body.joints, 0.0
        furthest = max(abs(b - a) for a, b in zip(self._start, self._goal, strict=True))
        self._profile = lasting(duration) if duration > 0.0 else trapezoid(furthest, speed, acceleration)


class MoveLine:
    """``movel``: the tool centre point in a straight line, turning evenly.

    Args:
        goal: ``base_from_tcp``.
        speed: m/s.
        acceleration: m/s^2.
        duration: s; where above zero it decides instead.
    """

    def __init__(self, goal: Matrix, speed: float, acceleration: float, duration: float = 0.0) -> None:
        self._goal = goal
        self._limits = speed, acceleration, duration
        self._start: Matrix | None = None
        self._turn = (0.0, 0.0, 0.0)
        self._profile = Trapezoid(0.0, 0.0)
        self._time = 0.0
        self.done = False

    def advance(self, body: ArmBody, seconds: float) -> None:
        """Move on."""
        if self._start is None:
            self._begin(body)
        assert self._start is not None, "just begun"
        self._time += seconds
        share = self._profile.share(self._time)
        self.done = share == 1.0
        end = poses.translation(self._goal)
        pose = self._goal if self.done else poses.between(self._start, self._turn, end, share)
        body.put_tcp(pose)

    def replan(self) -> None:
        """From where the arm is."""
        self._start = None

    def _begin(self, body: ArmBody) -> None:
        speed, acceleration, duration = self._limits
        self._start, self._time = body.base_from_tcp, 0.0
        self._turn = poses.rotation_vector(poses.compose(poses.inverse(self._start), self._goal))
        length = math.dist(poses.translation(self._start), poses.translation(self._goal))
        way = max(length, TURN_LENGTH * math.hypot(*self._turn))
        self._profile = lasting(duration) if duration > 0.0 else trapezoid(way, speed, acceleration)


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


def _mixed(start: Six, goal: Six, share: float) -> Six:
    return as_six([a + share * (b - a) for a, b in zip(start, goal, strict=True)])


def _approached(present: Sequence[float], target: Sequence[float], step: float) -> tuple[list[float], bool]:
    """The speed a step nearer to the target, and whether that is the target."""
    change = [b - a for a, b in zip(present, target, strict=True)]
    size = math.hypot(*change)
    if size <= step:
        return list(target), True
    return [a + step / size * d for a, d in zip(present, change, strict=True)], False
