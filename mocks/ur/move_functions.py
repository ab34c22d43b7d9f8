"""URScript's motion commands: generators that yield until the arm has done what they ask.

Blends (``r``) are accepted and not performed: every move comes to rest.
"""

from collections.abc import Callable, Generator
from typing import Any

from mocks.ur.arm import kinematics, poses
from mocks.ur.arm.motions import (
    ArmMotion,
    MoveJoints,
    MoveLine,
    SpeedLine,
    as_six,
)
from mocks.ur.arm.mover import PROGRAM_STOP
from mocks.ur.arm.stops import StopJoints, StopLine
from mocks.ur.geometry_functions import matrix
from mocks.ur.hooks import Matrix, Six
from mocks.ur.robot import Robot
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.values import PoseValue, number, six

Cycles = Generator[None, None, None]


class MoveFunctions:
    """The commands of one arm."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._mover = robot.mover

    def table(self) -> dict[str, Callable[..., Any]]:
        """By name."""
        return {
            "movej": self.movej,
            "movel": self.movel,
            "speedl": self.speedl,
            "stopj": self.stopj,
            "stopl": self.stopl,
        }

    def movej(self, q: Any, a: Any = 1.4, v: Any = 1.05, t: Any = 0, r: Any = 0) -> Cycles:
        """To joints, or to the joints of a pose nearest to the present ones."""
        number(r)
        motion = MoveJoints(self._joints(q, "movej"), _above(v, "v"), _above(a, "a"), _not_below(t, "t"))
        yield from self._from_rest()
        yield from self._perform(motion)

    def movel(self, pose: Any, a: Any = 1.2, v: Any = 0.25, t: Any = 0, r: Any = 0) -> Cycles:
        """In a straight line to a pose, or to the pose of joints."""
        number(r)
        motion = MoveLine(self._tcp(pose, "movel"), _above(v, "v"), _above(a, "a"), _not_below(t, "t"))
        yield from self._from_rest()
        yield from self._perform(motion)

    def speedl(self, xd: Any, a: Any, t: Any = None, aRot: Any = "a") -> Cycles:  # noqa: N803 - UR's name
        """Towards a velocity of the tool centre point."""
        seconds = None if t is None else _not_below(t, "t")
        turning = _above(a if aRot == "a" else aRot, "aRot")
        motion = SpeedLine(as_six(six(xd, "speedl")), _above(a, "a"), turning, seconds)
        yield from self._perform(motion, goes_on=True)

    def stopj(self, a: Any = 2.0) -> Cycles:
        """To rest, joint by joint."""
        yield from self._perform(StopJoints(_above(a, "a")))

    def stopl(self, a: Any = 20.0, aRot: Any = "a") -> Cycles:  # noqa: N803 - UR's name
        """To rest along the tool's path."""
        turning = _above(a if aRot == "a" else aRot, "aRot")
        yield from self._perform(StopLine(_above(a, "a"), turning))

    def _from_rest(self) -> Cycles:
        """Moves are planned from rest; a motion that was killed under way comes to rest first."""
        self._require_free()
        if not self._mover.at_rest:
            yield from self._perform(StopJoints(PROGRAM_STOP))

    def _perform(self, motion: ArmMotion, *, goes_on: bool = False) -> Cycles:
        """Until it is done; a motion that ``goes_on`` is not over when the program may continue."""
        self._require_free()
        thread = self._robot.thread
        self._mover.begin(motion, thread)
        while not motion.done:
            yield
        if goes_on:
            self._mover.release(thread)
        else:
            self._mover.finish(motion)

    def _require_free(self) -> None:
        if self._robot.thread <= 0:
            raise ScriptError("a secondary program must not move the arm")
        if self._mover.owner not in (0, self._robot.thread):
            raise ScriptError("another thread is already controlling the robot")

    def _joints(self, value: Any, what: str) -> Six:
        if isinstance(value, PoseValue):
            return solved(self._robot, self._flange(value, what), self._mover.joints)
        return as_six(six(value, what))

    def _tcp(self, value: Any, what: str) -> Matrix:
        if isinstance(value, PoseValue):
            goal = matrix(value, what)
        else:
            flange = kinematics.forward(self._robot.arm, six(value, what))
            goal = poses.compose(flange, self._mover.flange_from_tcp)
        return goal

    def _flange(self, value: Any, what: str) -> Matrix:
        return poses.compose(matrix(value, what), poses.inverse(self._mover.flange_from_tcp))


def solved(robot: Robot, base_from_flange: Matrix, near: Six) -> Six:
    """Joints nearest to ``near``; the program stops where there are none."""
    found = kinematics.postures(robot.arm, base_from_flange, near)
    if not found:
        raise ScriptError("get_inverse_kin: unable to find an inverse kinematics solution")
    return found[0]


def _above(value: Any, name: str) -> float:
    if not 0.0 < number(value) < float("inf"):
        raise ScriptError(f"'{name}' must be above zero, not {value}")
    return float(value)


def _not_below(value: Any, name: str) -> float:
    if not 0.0 <= number(value) < float("inf"):
        raise ScriptError(f"'{name}' must not be below zero, not {value}")
    return float(value)
