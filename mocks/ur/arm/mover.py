"""The arm's body: where it is commanded to be, which thread moves it, and what is too fast for it."""

import math
from collections import deque
from typing import Final

from mocks.ur.arm import kinematics, poses
from mocks.ur.arm.kinematics import ArmModel
from mocks.ur.arm.motions import ArmMotion, StopJoints, Twist
from mocks.ur.hooks import CYCLE, Matrix, Six

PROGRAM_STOP: Final = 10.0
"""rad/s^2 of the fastest joint, where a program ends or lets go of a moving arm."""

SAFETY_STOP: Final = 20.0
"""rad/s^2 of the fastest joint, where the controller stops the arm."""

HISTORY: Final = 500
STEADY_CYCLES: Final = 50
TCP_SPEED_LIMIT: Final = 1.5
"""m/s; a setting of the safety configuration on a real controller."""

_CONTROLLER: Final = -1
"""Owner of the stops that the controller makes by itself; threads are numbered from 1."""

_AT_REST: Final[Twist] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class MotionFault(Exception):
    """The controller cannot or may not follow this motion."""


class Mover:
    """Implements ``motions.Body``."""

    def __init__(self, arm: ArmModel, joints: Six) -> None:
        self.arm = arm
        self.joints = joints  #: rad, commanded; the mock's joints follow exactly.
        self.speeds: Six = (0.0,) * 6  #: rad/s, over the last cycle.
        self.accelerations: Six = (0.0,) * 6  #: rad/s^2, over the last cycle.
        self.twist = _AT_REST  #: of the tool centre point, over the last cycle.
        self.base_from_flange = kinematics.forward(arm, joints)  #: as commanded.
        self.history: deque[Six] = deque([joints], maxlen=HISTORY)
        self.motions = 0  #: how many motions have begun from rest.
        self._flange_from_tcp = poses.IDENTITY
        self._tcp_from_flange = poses.IDENTITY
        self._base_from_tcp = self.base_from_flange
        self._motion: ArmMotion | None = None
        self._owner = 0
        self._suspended: tuple[ArmMotion, int] | None = None
        self._still = STEADY_CYCLES

    @property
    def base_from_tcp(self) -> Matrix:
        """As commanded."""
        return self._base_from_tcp

    @property
    def flange_from_tcp(self) -> Matrix:
        """What the program set."""
        return self._flange_from_tcp

    @flange_from_tcp.setter
    def flange_from_tcp(self, value: Matrix) -> None:
        self._flange_from_tcp = value
        self._tcp_from_flange = poses.inverse(value)
        self._base_from_tcp = poses.compose(self.base_from_flange, value)

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves and nothing is to move."""
        return self._motion is None and self._still > 0

    @property
    def steady(self) -> bool:
        """At rest for 0.1 s."""
        return self._still >= STEADY_CYCLES

    @property
    def owner(self) -> int:
        """The thread that moves the arm; 0 where none does, or where the controller stops it."""
        return max(self._owner, 0) if self._motion is not None else 0

    def begin(self, motion: ArmMotion, owner: int) -> None:
        """Take the arm over, from wherever it is and at whatever speed."""
        if self._motion is None:
            self.motions += 1
        self._motion, self._owner = motion, owner

    def release(self, owner: int) -> None:
        """This thread is gone; unless another takes over within the cycle, the arm brakes."""
        if self._owner == owner:
            self._owner = 0
        if self._suspended is not None and self._suspended[1] == owner:
            self._suspended = None

    def brake(self, deceleration: float) -> None:
        """Stop; nobody's motion any more."""
        if self._motion is not None or self._still == 0:
            self.begin(StopJoints(deceleration), _CONTROLLER)

    def advance(self, seconds: float) -> None:
        """One cycle, ``seconds`` long where nothing slows the program down.

        Raises:
            MotionFault: the motion leaves the arm's reach, its joints' range or its speed limits.
        """
        before = self.joints, self.speeds, self._base_from_tcp
        motion = self._motion
        if motion is not None:
            if self._owner == 0:
                motion = self._motion = StopJoints(PROGRAM_STOP)
                self._owner = _CONTROLLER
            motion.advance(self, seconds)
            if motion.done and self._owner == _CONTROLLER:
                self._motion = None
        self._differentiate(*before)
        self.history.append(self.joints)

    def finish(self, motion: ArmMotion) -> None:
        """A move has come to rest: its last step's mean speed is over."""
        if self._motion is motion:
            self._motion, self._owner = None, 0
            self._still = 1
            self.speeds, self.twist = (0.0,) * 6, _AT_REST

    def hold(self) -> None:
        """Stand still at once: the brakes close."""
        self._motion = None

    def suspend(self) -> None:
        """Stop as fast as the controller may; the motion can be taken up again."""
        if self._motion is not None and self._owner > 0:
            self._suspended = self._motion, self._owner
        self.brake(SAFETY_STOP)

    def resume(self) -> None:
        """Take the suspended motion up again, from where the arm is now."""
        if self._suspended is not None:
            motion, owner = self._suspended
            motion.replan()
            self.begin(motion, owner)
        self._suspended = None

    def put_joints(self, joints: Six) -> None:
        """Command joints."""
        if not kinematics.within_limits(joints):
            raise MotionFault(f"a joint leaves its range: {[round(q, 3) for q in joints]} rad")
        self._put(joints, kinematics.forward(self.arm, joints))

    def put_tcp(self, base_from_tcp: Matrix) -> None:
        """Command a pose on the present branch."""
        base_from_flange = poses.compose(base_from_tcp, self._tcp_from_flange)
        joints = kinematics.follow(self.arm, base_from_flange, self.joints)
        if joints is None or not kinematics.within_limits(joints):
            raise MotionFault("the path leaves the reach of the arm")
        self._put(joints, base_from_flange, base_from_tcp)

    def _put(self, joints: Six, base_from_flange: Matrix, base_from_tcp: Matrix | None = None) -> None:
        for joint, (new, old, limit) in enumerate(
            zip(joints, self.joints, self.arm.speeds, strict=True), start=1
        ):
            if not abs(new - old) <= 1.05 * limit * CYCLE:
                raise MotionFault(
                    f"joint {joint} would turn at {abs(new - old) / CYCLE:.1f} rad/s; limit {limit:.2f}"
                )
        self.joints = joints
        self.base_from_flange = base_from_flange
        self._base_from_tcp = base_from_tcp or poses.compose(base_from_flange, self._flange_from_tcp)

    def _differentiate(self, joints: Six, speeds: Six, pose: Matrix) -> None:
        if self.joints == joints:
            self._still += 1
            self.speeds, self.twist = (0.0,) * 6, _AT_REST
            self.accelerations = tuple(-speed / CYCLE for speed in speeds)  # type: ignore[assignment]
            return
        self._still = 0
        a, b, c, d, e, f = ((new - old) / CYCLE for new, old in zip(self.joints, joints, strict=True))
        self.speeds = a, b, c, d, e, f
        a, b, c, d, e, f = ((new - old) / CYCLE for new, old in zip(self.speeds, speeds, strict=True))
        self.accelerations = a, b, c, d, e, f
        old, now = poses.translation(pose), poses.translation(self._base_from_tcp)
        x, y, z = ((end - start) / CYCLE for start, end in zip(old, now, strict=True))
        turn = poses.rotation_vector(poses.compose(self._base_from_tcp, poses.inverse(pose)))
        self.twist = (x, y, z), (turn[0] / CYCLE, turn[1] / CYCLE, turn[2] / CYCLE)
        speed = math.hypot(*self.twist[0])
        if speed > TCP_SPEED_LIMIT:
            raise MotionFault(f"the tool moves at {speed:.2f} m/s; the limit is {TCP_SPEED_LIMIT} m/s")
