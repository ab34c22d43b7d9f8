"""URScript's functions that a program on the controller may call (Universal Robots, Script manual).

Motions are generators that yield until the arm has done what they ask. Blends (``r``) are accepted and not
performed: every move comes to rest.
"""

import math
from collections.abc import Callable, Generator
from typing import Any, Final

from mocks.ur.arm import kinematics, poses
from mocks.ur.arm.motions import (
    ArmMotion,
    MoveJoints,
    MoveLine,
    SpeedLine,
    StopJoints,
    StopLine,
    as_six,
)
from mocks.ur.arm.mover import HISTORY, PROGRAM_STOP
from mocks.ur.hooks import CYCLE, Matrix, Six
from mocks.ur.robot import INT32, NUMERIC, RegisterWatchdog, Robot
from mocks.ur.urscript.values import PoseValue, ScriptError, number, show, six

UNMODELLED: Final = (
    *("movec", "movep", "servoc", "servoj", "speedj"),
    *("force_mode", "teach_mode", "freedrive_mode", "get_freedrive_status"),
    *("get_joint_torques", "ft_rtde_input_enable", "enable_external_ft_sensor", "direct_torque"),
    *("get_mass_matrix", "get_coriolis_and_centrifugal_torques", "get_target_joint_accelerations"),
    *("get_jacobian", "get_jacobian_time_derivative"),
)
"""Functions that a program may name; it stops where it calls one."""

_WATCHDOG_ACTIONS: Final = ("pause", "stop", "ignore")


Cycles = Generator[None, None, None]


class Functions:
    """The functions of one controller: every public method but ``table`` is one, by its own name."""

    def __init__(self, robot: Robot, protective_stop: Callable[[str], None]) -> None:
        self._robot = robot
        self._mover = robot.mover
        self._protective_stop = protective_stop

    def table(self) -> dict[str, Callable[..., Any]]:
        """By name; the mock's arm is where it is commanded to be, so actual and target agree."""
        robot, mover, inputs = self._robot, self._mover, self._robot.inputs
        return {
            **{
                name: getattr(self, name)
                for name in vars(Functions)
                if name != "table" and not name.startswith("_")
            },
            "get_steptime": lambda: CYCLE,
            "get_actual_tcp_pose": lambda: pose(mover.base_from_tcp),
            "get_actual_tool_flange_pose": lambda: pose(mover.base_from_flange),
            "get_target_tcp_speed": lambda: [*mover.twist[0], *mover.twist[1]],
            "get_target_waypoint": lambda: pose(mover.base_from_tcp),
            "get_tcp_offset": lambda: pose(mover.flange_from_tcp),
            "is_steady": lambda: mover.steady,
            "zero_ftsensor": robot.force.zero,
            "protective_stop": lambda: self._protective_stop("the program asked for it"),
            "get_target_payload": lambda: robot.payload.mass,
            "get_target_payload_cog": lambda: list(robot.payload.centre),
            "get_target_payload_inertia": lambda: list(robot.payload.inertia),
            "end_teach_mode": lambda: None,
            "end_freedrive_mode": lambda: None,
            "end_force_mode": lambda: None,
            "force_mode_set_gain_scaling": lambda scaling: _not_below(scaling, "scaling"),
            "read_input_integer_register": lambda address: inputs.ints[_address(address, NUMERIC)],
            "read_input_float_register": lambda address: inputs.doubles[_address(address, NUMERIC)],
            **{name: _unmodelled(name) for name in UNMODELLED},
        }

    # Motions

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
            return self._solved(matrix(value, what), self._mover.flange_from_tcp, self._mover.joints)
        return as_six(six(value, what))

    def _tcp(self, value: Any, what: str) -> Matrix:
        if isinstance(value, PoseValue):
            return matrix(value, what)
        flange = kinematics.forward(self._robot.arm, six(value, what))
        return poses.compose(flange, self._mover.flange_from_tcp)

    def _solved(self, base_from_tcp: Matrix, flange_from_tcp: Matrix, near: Six) -> Six:
        flange = poses.compose(base_from_tcp, poses.inverse(flange_from_tcp))
        found = kinematics.postures(self._robot.arm, flange, near)
        if not found:
            raise ScriptError("get_inverse_kin: unable to find an inverse kinematics solution")
        return found[0]

    # Numbers and poses

    @staticmethod
    def pose_trans(p_from: Any, p_from_to: Any) -> PoseValue:
        """``p_from`` carried on by ``p_from_to``, given in its frame."""
        return pose(poses.compose(matrix(p_from, "pose_trans"), matrix(p_from_to, "pose_trans")))

    @staticmethod
    def pose_sub(p_to: Any, p_from: Any) -> PoseValue:
        """Positions subtracted, and the turn from ``p_from`` to ``p_to`` in base."""
        to, start = matrix(p_to, "pose_sub"), matrix(p_from, "pose_sub")
        x, y, z = (a - b for a, b in zip(poses.translation(to), poses.translation(start), strict=True))
        return pose(poses.moved_to(poses.compose(to, poses.inverse(start)), (x, y, z)))

    @staticmethod
    def norm(a: Any) -> float:
        """Length of a vector, or absolute value of a number."""
        if isinstance(a, list):
            return math.hypot(*(number(part) for part in a))
        return abs(float(number(a)))

    # State of the arm

    def get_actual_joint_positions_history(self, steps: Any = 0) -> list[float]:
        """Joints some cycles ago."""
        back = number(steps)
        history = self._mover.history
        if not 0 <= back < HISTORY:
            raise ScriptError(f"the history goes back 0 to {HISTORY - 1} steps, not {back}")
        return list(history[max(0, len(history) - 1 - int(back))])

    def get_forward_kin(self, q: Any = None, tcp: Any = "active_tcp") -> PoseValue:
        """The tool's pose at joints."""
        joints = self._mover.joints if q is None else as_six(six(q, "get_forward_kin"))
        return pose(poses.compose(kinematics.forward(self._robot.arm, joints), self._offset(tcp)))

    def get_inverse_kin(
        self,
        x: Any,
        qnear: Any = None,
        maxPositionError: Any = 1e-10,  # noqa: N803 - UR's name
        maxOrientationError: Any = 1e-10,  # noqa: N803 - UR's name
        tcp: Any = "active_tcp",
    ) -> list[float]:
        """Joints that reach a pose; the program stops where there are none."""
        number(maxPositionError), number(maxOrientationError)
        near = self._mover.joints if qnear is None else as_six(six(qnear, "get_inverse_kin"))
        return list(self._solved(matrix(x, "get_inverse_kin"), self._offset(tcp), near))

    def get_inverse_kin_has_solution(
        self,
        pose: Any,
        qnear: Any = None,
        maxPositionError: Any = 1e-10,  # noqa: N803 - UR's name
        maxOrientationError: Any = 1e-10,  # noqa: N803 - UR's name
        tcp: Any = "active_tcp",
    ) -> bool:
        """Whether joints reach a pose."""
        try:
            self.get_inverse_kin(pose, qnear, maxPositionError, maxOrientationError, tcp)
        except ScriptError:
            return False
        return True

    def is_within_safety_limits(self, pose: Any) -> bool:
        """Whether a pose is in reach, or joints are in their range."""
        if isinstance(pose, PoseValue):
            return self.get_inverse_kin_has_solution(pose)
        return kinematics.within_limits(six(pose, "is_within_safety_limits"))

    def tool_contact(self, direction: Any = (0, 0, 0, 0, 0, 0)) -> int:
        """Cycles since something first resisted the motion along a direction in base; 0 without contact."""
        x, y, z = six(list(direction), "tool_contact")[:3]
        return self._robot.force.contact_cycles((x, y, z))

    def _offset(self, tcp: Any) -> Matrix:
        return self._mover.flange_from_tcp if tcp == "active_tcp" else matrix(tcp, "tcp")

    # Time, messages, registers, settings

    def sync(self) -> Cycles:
        """Until the next cycle."""
        yield

    def sleep(self, t: Any) -> Cycles:
        """Do nothing for a time."""
        end = self._robot.time + _not_below(t, "t")
        while True:
            yield
            if self._robot.time >= end - 1e-9:
                return

    def textmsg(self, s1: Any, s2: Any = "") -> None:
        """Write to the log."""
        self._robot.log.append(show(s1) + show(s2))

    def rtde_set_watchdog(self, variable_name: Any, min_frequency: Any, action: Any = "pause") -> None:
        """Watch an input that clients must keep writing."""
        frequency = _not_below(min_frequency, "min_frequency")
        if action not in _WATCHDOG_ACTIONS:
            raise ScriptError(
                f"a watchdog's action is one of {', '.join(_WATCHDOG_ACTIONS)}, not {show(action)}"
            )
        if frequency == 0.0 or action == "ignore":
            self._robot.watchdog = None
            return
        self._robot.watchdog = RegisterWatchdog(str(variable_name), 1.0 / frequency, action)
        self._robot.written[str(variable_name)] = self._robot.cycles

    def set_tcp(self, pose: Any, tcp_name: Any = "") -> None:
        """The tool centre point, in the flange's frame."""
        show(tcp_name)
        self._robot.mover.flange_from_tcp = matrix(pose, "set_tcp")

    def set_payload(self, m: Any, cog: Any = None) -> None:
        """Mass and its centre."""
        self.set_target_payload(m, self._robot.payload.centre if cog is None else cog)

    def set_target_payload(self, m: Any, cog: Any, inertia: Any = None) -> None:
        """Mass, its centre and its inertia; too much for the arm stops the program."""
        mass, limit = _not_below(m, "m"), self._robot.arm.payload
        if mass > limit:
            raise ScriptError(f"a payload of {mass:g} kg; this arm carries {limit:g} kg")
        payload = self._robot.payload
        payload.mass, payload.centre = mass, _finite(cog, 3, "cog")
        payload.inertia = [0.0] * 6 if inertia is None else _finite(inertia, 6, "inertia")

    def set_gravity(self, d: Any) -> None:
        """The acceleration that the base feels."""
        self._robot.gravity = _finite(d, 3, "d")

    def force_mode_set_damping(self, damping: Any) -> None:
        """A setting of a mode that this mock does not enter."""
        if not 0.0 <= number(damping) <= 1.0:
            raise ScriptError(f"damping is a number between 0 and 1, not {show(damping)}")

    def write_output_integer_register(self, address: Any, value: Any) -> None:
        """A 32-bit number for clients to read."""
        whole = int(number(value))
        if whole not in INT32:
            raise ScriptError(f"{whole} does not fit an integer register")
        self._robot.results.ints[_address(address, NUMERIC)] = whole

    def write_output_float_register(self, address: Any, value: Any) -> None:
        """A number for clients to read."""
        self._robot.results.doubles[_address(address, NUMERIC)] = float(number(value))


def matrix(value: Any, what: str) -> Matrix:
    """The transform of a pose."""
    return poses.matrix_from_pose(six(value, what))


def pose(value: Matrix) -> PoseValue:
    """The pose of a transform."""
    return PoseValue(poses.pose_from_matrix(value))


def _unmodelled(name: str) -> Callable[..., None]:
    def refuse(*_arguments: Any, **_keywords: Any) -> None:
        raise ScriptError(f"'{name}' is not modelled by this mock")

    return refuse


def _address(value: Any, count: int) -> int:
    address = number(value)
    if address != int(address) or not 0 <= address < count:
        raise ScriptError(f"there is no number {show(value)}; 0 to {count - 1} exist")
    return int(address)


def _above(value: Any, name: str) -> float:
    if not 0.0 < number(value) < math.inf:
        raise ScriptError(f"'{name}' must be above zero, not {value}")
    return float(value)


def _not_below(value: Any, name: str) -> float:
    if not 0.0 <= number(value) < math.inf:
        raise ScriptError(f"'{name}' must not be below zero, not {show(value)}")
    return float(value)


def _finite(value: Any, count: int, name: str) -> list[float]:
    if not isinstance(value, list) or len(value) != count or not all(math.isfinite(number(v)) for v in value):
        raise ScriptError(f"'{name}' needs {count} finite numbers, not {show(value)}")
    return [float(part) for part in value]
