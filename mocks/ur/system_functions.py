"""URScript's functions of the controller: time, messages, registers, outputs, settings, safety."""

import math
from collections.abc import Callable, Generator
from typing import Any, Final

from mocks.ur.geometry_functions import matrix
from mocks.ur.registers import INT32, NUMERIC, RegisterWatchdog
from mocks.ur.robot import Robot
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.values import number, show

UNMODELLED: Final = (
    *("movec", "movep", "servoc", "servoj", "speedj"),
    *("force_mode", "teach_mode", "freedrive_mode", "get_freedrive_status"),
    *("get_joint_torques", "ft_rtde_input_enable", "enable_external_ft_sensor", "direct_torque"),
    *("get_mass_matrix", "get_coriolis_and_centrifugal_torques", "get_target_joint_accelerations"),
    *("get_jacobian", "get_jacobian_time_derivative"),
)
"""Functions that a program may name; it stops where it calls one."""

_WATCHDOG_ACTIONS: Final = ("pause", "stop", "ignore")


class SystemFunctions:
    """The functions of one controller.

    Args:
        robot: whose.
        protective_stop: stops the arm.
    """

    def __init__(self, robot: Robot, protective_stop: Callable[[str], None]) -> None:
        self._robot = robot
        self._protective_stop = protective_stop

    def table(self) -> dict[str, Callable[..., Any]]:
        """By name."""
        robot = self._robot
        return {
            "sync": _sync,
            "sleep": self.sleep,
            "textmsg": self.textmsg,
            "rtde_set_watchdog": self.rtde_set_watchdog,
            "protective_stop": lambda: self._protective_stop("the program asked for it"),
            "set_tcp": self.set_tcp,
            "set_payload": self.set_payload,
            "set_target_payload": self.set_target_payload,
            "set_gravity": self.set_gravity,
            "get_target_payload": lambda: robot.payload.mass,
            "get_target_payload_cog": lambda: list(robot.payload.centre),
            "get_target_payload_inertia": lambda: list(robot.payload.inertia),
            "end_teach_mode": lambda: None,
            "end_freedrive_mode": lambda: None,
            "end_force_mode": lambda: None,
            "force_mode_set_damping": lambda damping: _share(damping),
            "force_mode_set_gain_scaling": lambda scaling: _not_negative(scaling, "scaling"),
            **self._registers(),
            **{name: _unmodelled(name) for name in UNMODELLED},
        }

    def sleep(self, t: Any) -> Generator[None, None, None]:
        """Do nothing for a time."""
        end = self._robot.time + _not_negative(t, "t")
        while True:
            yield
            if self._robot.time >= end - 1e-9:
                return

    def textmsg(self, s1: Any, s2: Any = "") -> None:
        """Write to the log."""
        self._robot.log.append(show(s1) + show(s2))

    def rtde_set_watchdog(self, variable_name: Any, min_frequency: Any, action: Any = "pause") -> None:
        """Watch an input that clients must keep writing."""
        frequency = _not_negative(min_frequency, "min_frequency")
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
        mass, limit = _not_negative(m, "m"), self._robot.arm.payload
        if mass > limit:
            raise ScriptError(f"a payload of {mass:g} kg; this arm carries {limit:g} kg")
        payload = self._robot.payload
        payload.mass, payload.centre = mass, _finite(cog, 3, "cog")
        payload.inertia = [0.0] * 6 if inertia is None else _finite(inertia, 6, "inertia")

    def set_gravity(self, d: Any) -> None:
        """The acceleration that the base feels."""
        self._robot.gravity = _finite(d, 3, "d")

    def _registers(self) -> dict[str, Callable[..., Any]]:
        inputs, results = self._robot.inputs, self._robot.results

        def set_int(address: Any, value: Any) -> None:
            whole = int(number(value))
            if whole not in INT32:
                raise ScriptError(f"{whole} does not fit an integer register")
            results.ints[_address(address, NUMERIC)] = whole

        def set_double(address: Any, value: Any) -> None:
            results.doubles[_address(address, NUMERIC)] = float(number(value))

        return {
            "read_input_integer_register": lambda address: inputs.ints[_address(address, NUMERIC)],
            "read_input_float_register": lambda address: inputs.doubles[_address(address, NUMERIC)],
            "write_output_integer_register": set_int,
            "write_output_float_register": set_double,
        }


def _sync() -> Generator[None, None, None]:
    yield


def _unmodelled(name: str) -> Callable[..., None]:
    def refuse(*_arguments: Any, **_keywords: Any) -> None:
        raise ScriptError(f"'{name}' is not modelled by this mock")

    return refuse


def _address(value: Any, count: int) -> int:
    address = number(value)
    if address != int(address) or not 0 <= address < count:
        raise ScriptError(f"there is no number {show(value)}; 0 to {count - 1} exist")
    return int(address)


def _not_negative(value: Any, name: str) -> float:
    if not 0.0 <= number(value) < math.inf:
        raise ScriptError(f"'{name}' must not be below zero, not {show(value)}")
    return float(value)


def _share(value: Any) -> None:
    if not 0.0 <= number(value) <= 1.0:
        raise ScriptError(f"damping is a number between 0 and 1, not {show(value)}")


def _finite(value: Any, count: int, name: str) -> list[float]:
    if not isinstance(value, list) or len(value) != count or not all(math.isfinite(number(v)) for v in value):
        raise ScriptError(f"'{name}' needs {count} finite numbers, not {show(value)}")
    return [float(part) for part in value]
