"""URScript's functions that read the arm's state: poses, joints, forces, kinematics."""

from collections.abc import Callable
from typing import Any

from mocks.ur.arm import kinematics, poses
from mocks.ur.arm.motions import as_six
from mocks.ur.arm.mover import HISTORY
from mocks.ur.geometry_functions import matrix, pose
from mocks.ur.hooks import CYCLE, Matrix
from mocks.ur.move_functions import solved
from mocks.ur.robot import Robot
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.values import PoseValue, number, six


class StateFunctions:
    """The functions of one arm."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._mover = robot.mover

    def table(self) -> dict[str, Callable[..., Any]]:
        """By name; the mock's arm is where it is commanded to be, so actual and target agree."""
        mover = self._mover
        return {
            "get_steptime": lambda: CYCLE,
            "get_actual_tcp_pose": lambda: pose(mover.base_from_tcp),
            "get_actual_tool_flange_pose": lambda: pose(mover.base_from_flange),
            "get_target_tcp_speed": lambda: [*mover.twist[0], *mover.twist[1]],
            "get_actual_joint_positions_history": self.get_actual_joint_positions_history,
            "get_target_waypoint": lambda: pose(mover.base_from_tcp),
            "get_tcp_offset": lambda: pose(mover.flange_from_tcp),
            "get_forward_kin": self.get_forward_kin,
            "get_inverse_kin": self.get_inverse_kin,
            "get_inverse_kin_has_solution": self.get_inverse_kin_has_solution,
            "is_within_safety_limits": self.is_within_safety_limits,
            "is_steady": lambda: mover.steady,
            "tool_contact": self.tool_contact,
            "zero_ftsensor": self._robot.force.zero,
        }

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
        offset = self._offset(tcp)
        return pose(poses.compose(kinematics.forward(self._robot.arm, joints), offset))

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
        return list(solved(self._robot, self._flange(x, tcp), near))

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

    def _flange(self, value: Any, tcp: Any) -> Matrix:
        return poses.compose(matrix(value, "get_inverse_kin"), poses.inverse(self._offset(tcp)))
