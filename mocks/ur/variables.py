"""The variables of the real-time data exchange: type, and where each is read or written.

Names and types: Universal Robots, RTDE guide. Currents, voltages, temperatures and moments are
not modelled and read as constants.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from mocks.ur.arm import poses
from mocks.ur.controller import Controller, RuntimeState
from mocks.ur.robot import BITS, NUMERIC, RobotMode

Read = Callable[[Controller], Any]
Write = Callable[[Controller, Any], None]

_ZEROS: Final[dict[str, Any]] = {"VECTOR6D": (0.0,) * 6, "DOUBLE": 0.0}
_JOINT_RUNNING, _JOINT_POWER_OFF = 253, 239
_LAST_WORD: Final = BITS - 64


@dataclass(frozen=True)
class Output:
    """A variable that clients may ask for."""

    type: str
    read: Read


@dataclass(frozen=True)
class InputVariable:
    """A variable that one client may write; ``write`` is None where the outputs take it by its mask."""

    type: str
    write: Write | None


def _constant(kind: str, value: Any) -> Output:
    return Output(kind, lambda _: value)


def _tcp_force(c: Controller) -> Any:
    mover = c.robot.mover
    return c.robot.force.at_tcp(mover.base_from_flange, mover.flange_from_tcp)


def _elbow(c: Controller) -> Any:
    """Position of the elbow, m in base: the end of the upper arm."""
    mover, arm = c.robot.mover, c.robot.arm
    turned = poses.matrix_from_pose((0.0, 0.0, arm.d1, 0.0, 0.0, mover.joints[0]))
    lifted = poses.matrix_from_pose((0.0, 0.0, 0.0, 0.0, -mover.joints[1], 0.0))
    return poses.translation(
        poses.compose(poses.compose(turned, lifted), poses.matrix_from_pose((arm.a2, 0, 0, 0, 0, 0)))
    )


def _state() -> dict[str, Output]:
    """What moves and what is felt."""
    joints = Output("VECTOR6D", lambda c: c.robot.mover.joints)
    speeds = Output("VECTOR6D", lambda c: c.robot.mover.speeds)
    pose = Output("VECTOR6D", lambda c: poses.pose_from_matrix(c.robot.mover.base_from_tcp))
    twist = Output("VECTOR6D", lambda c: (*c.robot.mover.twist[0], *c.robot.mover.twist[1]))
    return {
        "timestamp": Output("DOUBLE", lambda c: c.robot.time),
        "target_q": joints,
        "actual_q": joints,
        "target_qd": speeds,
        "actual_qd": speeds,
        "target_qdd": Output("VECTOR6D", lambda c: c.robot.mover.accelerations),
        "actual_TCP_pose": pose,
        "target_TCP_pose": pose,
        "actual_TCP_speed": twist,
        "target_TCP_speed": twist,
        "actual_TCP_force": Output("VECTOR6D", _tcp_force),
        "ft_raw_wrench": Output("VECTOR6D", lambda c: c.robot.force.raw),
        "tcp_force_scalar": Output("DOUBLE", lambda c: sum(f * f for f in _tcp_force(c)[:3]) ** 0.5),
        "tcp_offset": Output("VECTOR6D", lambda c: poses.pose_from_matrix(c.robot.mover.flange_from_tcp)),
        "elbow_position": Output("VECTOR3D", _elbow),
        "payload": Output("DOUBLE", lambda c: c.robot.payload.mass),
        "payload_cog": Output("VECTOR3D", lambda c: c.robot.payload.centre),
        "payload_inertia": Output("VECTOR6D", lambda c: c.robot.payload.inertia),
    }


def _modes() -> dict[str, Output]:
    """What the controller says of itself."""
    return {
        "robot_mode": Output("INT32", lambda c: int(c.robot.safety.power)),
        "joint_mode": Output(
            "VECTOR6INT32",
            lambda c: (
                (_JOINT_RUNNING if c.robot.safety.power is RobotMode.RUNNING else _JOINT_POWER_OFF,) * 6
            ),
        ),
        "safety_mode": Output("INT32", lambda c: int(c.robot.safety.mode)),
        "safety_status": Output("INT32", lambda c: int(c.robot.safety.mode)),
        "runtime_state": Output("UINT32", lambda c: int(c.player.state)),
        "robot_status_bits": Output("UINT32", lambda c: c.status_bits),
        "safety_status_bits": Output("UINT32", lambda c: c.robot.safety.bits),
        "speed_scaling": Output("DOUBLE", lambda c: float(c.player.state is RuntimeState.PLAYING)),
        "target_speed_fraction": Output("DOUBLE", lambda c: c.robot.outputs.slider),
        "actual_digital_input_bits": _constant("UINT64", 0),
        "actual_digital_output_bits": Output("UINT64", lambda c: c.robot.outputs.digital),
        "standard_analog_output0": Output("DOUBLE", lambda c: c.robot.outputs.analog[0]),
        "standard_analog_output1": Output("DOUBLE", lambda c: c.robot.outputs.analog[1]),
        "output_bit_registers0_to_31": Output("UINT32", lambda c: c.robot.results.word(0)),
        "output_bit_registers32_to_63": Output("UINT32", lambda c: c.robot.results.word(32)),
        "input_bit_registers0_to_31": Output("UINT32", lambda c: c.robot.inputs.word(0)),
        "input_bit_registers32_to_63": Output("UINT32", lambda c: c.robot.inputs.word(32)),
    }


def _constants() -> dict[str, Output]:
    """What is not modelled."""
    zeros = {
        "VECTOR6D": "target_current target_moment actual_current joint_control_output actual_current_window",
        "DOUBLE": "actual_execution_time actual_momentum standard_analog_input0 standard_analog_input1 "
        "io_current tool_analog_input0 tool_analog_input1 tool_output_current collision_detection_ratio "
        "time_scale_source euromap67_24V_voltage euromap67_24V_current",
        "UINT32": "tool_analog_input_types analog_io_types euromap67_input_bits euromap67_output_bits "
        "script_control_line",
        "UINT8": "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
        "INT32": "tool_output_voltage",
    }
    return {
        **{name: _constant(kind, _ZEROS.get(kind, 0)) for kind in zeros for name in zeros[kind].split()},
        "actual_main_voltage": _constant("DOUBLE", 48.0),
        "actual_robot_voltage": _constant("DOUBLE", 48.0),
        "actual_robot_current": _constant("DOUBLE", 0.5),
        "tool_temperature": _constant("DOUBLE", 30.0),
        "tool_mode": _constant("UINT32", 253),
        "joint_temperatures": _constant("VECTOR6D", (30.0,) * 6),
        "actual_joint_voltage": _constant("VECTOR6D", (48.0,) * 6),
        "actual_tool_accelerometer": _constant("VECTOR3D", (0.0, 0.0, 9.82)),
    }


def _output_registers() -> dict[str, Output]:
    found: dict[str, Output] = {}
    for i in range(NUMERIC):
        found[f"output_int_register_{i}"] = Output("INT32", _item(lambda c: c.robot.results.ints, i))
        found[f"output_double_register_{i}"] = Output("DOUBLE", _item(lambda c: c.robot.results.doubles, i))
        found[f"input_int_register_{i}"] = Output("INT32", _item(lambda c: c.robot.inputs.ints, i))
        found[f"input_double_register_{i}"] = Output("DOUBLE", _item(lambda c: c.robot.inputs.doubles, i))
    for i in range(_LAST_WORD, BITS):
        found[f"output_bit_register_{i}"] = Output("BOOL", _item(lambda c: c.robot.results.bits, i))
        found[f"input_bit_register_{i}"] = Output("BOOL", _item(lambda c: c.robot.inputs.bits, i))
    return found


def _item(registers: Callable[[Controller], list[Any]], index: int) -> Read:
    return lambda controller: registers(controller)[index]


def _setter(registers: Callable[[Controller], list[Any]], index: int) -> Write:
    def write(controller: Controller, value: Any) -> None:
        registers(controller)[index] = value

    return write


def _inputs() -> dict[str, InputVariable]:
    masked = {
        "UINT32": "speed_slider_mask",
        "DOUBLE": "speed_slider_fraction standard_analog_output_0 standard_analog_output_1",
        "UINT8": "standard_digital_output_mask standard_digital_output configurable_digital_output_mask "
        "configurable_digital_output tool_digital_output_mask tool_digital_output "
        "standard_analog_output_mask standard_analog_output_type",
    }
    return {
        **{name: InputVariable(kind, None) for kind in masked for name in masked[kind].split()},
        **{
            f"input_int_register_{i}": InputVariable("INT32", _setter(lambda c: c.robot.inputs.ints, i))
            for i in range(NUMERIC)
        },
        **{
            f"input_double_register_{i}": InputVariable(
                "DOUBLE", _setter(lambda c: c.robot.inputs.doubles, i)
            )
            for i in range(NUMERIC)
        },
        **{
            f"input_bit_register_{i}": InputVariable("BOOL", _setter(lambda c: c.robot.inputs.bits, i))
            for i in range(_LAST_WORD, BITS)
        },
        "input_bit_registers0_to_31": InputVariable(
            "UINT32", lambda c, value: c.robot.inputs.set_word(0, value)
        ),
        "input_bit_registers32_to_63": InputVariable(
            "UINT32", lambda c, value: c.robot.inputs.set_word(32, value)
        ),
        "external_force_torque": InputVariable("VECTOR6D", lambda _c, _value: None),
    }


OUTPUTS: Final = {**_state(), **_modes(), **_constants(), **_output_registers()}
INPUTS: Final = _inputs()
