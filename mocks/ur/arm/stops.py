"""The ways to rest, from whatever speed the arm has."""

import math
from typing import Final

from mocks.ur.arm import poses
from mocks.ur.arm.motions import ArmBody, Twist, as_six
from mocks.ur.arm.profiles import braking_way
from mocks.ur.hooks import CYCLE, Matrix, Six

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
