"""Port 30004: recipes, claims on inputs, and one packet for each due cycle to each client.

Recipe numbers are handed out in order for each connection, as ur_rtde takes for granted.

Names and types: Universal Robots, RTDE guide. Currents, voltages, temperatures and moments are
not modelled and read as constants.
"""

import asyncio
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

from mocks.ur.arm import poses
from mocks.ur.controller import Controller, RuntimeState
from mocks.ur.ports import Connection
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
    """Create the outputs of motion and force."""
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
    """Create the outputs of the controller's modes and status."""
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
    """Create the outputs that are constant because they are not modelled."""
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


HEADER: Final = struct.Struct(">HB")
TYPES: Final = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
}
SCALARS: Final = frozenset(("BOOL", "UINT8", "UINT32", "UINT64", "INT32", "DOUBLE"))
NOT_FOUND: Final = "NOT_FOUND"
IN_USE: Final = "IN_USE"


class Kind(IntEnum):
    """Packet types: the ASCII codes of V, v, M, U, O, I, S and P."""

    PROTOCOL_VERSION = 86
    CONTROL_VERSION = 118
    TEXT = 77
    DATA = 85
    SETUP_OUTPUTS = 79
    SETUP_INPUTS = 73
    START = 83
    PAUSE = 80


class BadPacket(Exception):
    """Bytes that cannot be a packet; what follows cannot be told apart."""


class Packets:
    """Cuts a stream into packets."""

    def __init__(self) -> None:
        self._waiting = b""

    def feed(self, data: bytes) -> Iterator[tuple[int, bytes]]:
        """(type, payload) of each whole packet.

        Raises:
            BadPacket: a size below that of the header.
        """
        self._waiting += data
        while len(self._waiting) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._waiting)
            if size < HEADER.size:
                raise BadPacket(f"a packet of {size} bytes")
            if len(self._waiting) < size:
                return
            payload, self._waiting = self._waiting[HEADER.size : size], self._waiting[size:]
            yield kind, payload


def packet(kind: Kind, payload: bytes = b"") -> bytes:
    """One packet."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def text_message(message: str, level: int = 1) -> bytes:
    """A text for the client; level 0 exception, 1 error, 2 warning, 3 info."""
    text, source = message.encode()[:255], b"controller"
    return packet(Kind.TEXT, bytes((len(text),)) + text + bytes((len(source),)) + source + bytes((level,)))


def layout(types: list[str]) -> struct.Struct:
    """The bytes of values of these types."""
    return struct.Struct(">" + "".join(TYPES[name] for name in types))


CYCLES_PER_SECOND: Final = 500
PROTOCOL: Final = 2
SLOWEST: Final = 1 << 22
"""Bytes that a client may leave unread before it is dropped: some ten seconds of everything."""

LARGEST_RECIPE: Final = 16 << 10
"""Bytes of one packet's values, and of the names and of the types of a recipe: all the variables of the
guide at once need some 8,000 of names. Where a real controller ends is not documented."""

_FIRST_RECIPE: Final = b"\x01"
_FREQUENCY: Final = struct.Struct(">d")
_VERSION: Final = struct.Struct(">H")


class OutputRecipe:
    """What one client is sent, and how often."""

    def __init__(self, names: list[str], frequency: float) -> None:
        self.types = [OUTPUTS[name].type if name in OUTPUTS else NOT_FOUND for name in names]
        self.frequency = frequency
        self.valid = bool(names) and NOT_FOUND not in self.types
        self._reads: list[tuple[Read, bool]] = [
            (OUTPUTS[name].read, OUTPUTS[name].type in SCALARS) for name in names if name in OUTPUTS
        ]
        self._layout = layout([name for name in self.types if name != NOT_FOUND])
        if self._layout.size > LARGEST_RECIPE:
            raise BadPacket(f"a recipe of {self._layout.size} bytes; {LARGEST_RECIPE} fit a packet")

    def due(self, cycle: int) -> bool:
        """Whether a packet belongs to this cycle."""
        return int(cycle * self.frequency / CYCLES_PER_SECOND) > int(
            (cycle - 1) * self.frequency / CYCLES_PER_SECOND
        )

    def packed(self, controller: Controller) -> bytes:
        """One packet."""
        values: list[Any] = []
        for read, scalar in self._reads:
            value = read(controller)
            if scalar:
                values.append(value)
            else:
                values.extend(value)
        return packet(Kind.DATA, _FIRST_RECIPE + self._layout.pack(*values))


class InputRecipe:
    """What one client writes."""

    def __init__(self, names: list[str], inputs: list[InputVariable]) -> None:
        self._fields = list(zip(names, inputs, strict=True))
        self._layout = layout([field.type for field in inputs])

    def apply(self, controller: Controller, payload: bytes) -> None:
        """Write the values of one packet; ``BadPacket`` where it has another length."""
        if len(payload) != self._layout.size:
            raise BadPacket(f"{len(payload)} bytes of data, where its recipe has {self._layout.size}")
        values = iter(self._layout.unpack(payload))
        robot = controller.robot
        masked: dict[str, Any] = {}
        for name, field in self._fields:
            value = next(values) if field.type in SCALARS else [next(values) for _ in range(6)]
            if field.write is None:
                masked[name] = value
            else:
                field.write(controller, value)
            robot.written[name] = robot.cycles
        if masked:
            robot.outputs.apply(masked)


class RtdeServer:
    """All clients of the port."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.claims: dict[str, RtdeConnection] = {}
        self.refusing = False  #: whether new connections are dropped at once.
        self.connections: set[RtdeConnection] = set()
        self.frozen = False  #: whether nothing is sent or read, as where a cable hangs loose.

    def freeze(self, frozen: bool) -> None:
        """Send and read nothing, or go on."""
        self.frozen = frozen
        for connection in self.connections:
            connection.set_reading(not frozen)

    def publish(self) -> None:
        """Send what this cycle owes."""
        if not self.frozen:
            for connection in self.connections:
                connection.publish()

    def drop(self) -> None:
        """Close every connection."""
        for connection in list(self.connections):
            connection.abort()


class RtdeConnection(Connection):
    """One client."""

    def __init__(self, server: RtdeServer) -> None:
        super().__init__(server.connections)
        self._server = server
        self._packets = Packets()
        self._output: OutputRecipe | None = None
        self._inputs: dict[int, InputRecipe] = {}
        self._next_input = 1
        self._protocol = 1
        self._started = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        super().connection_made(transport)
        if self._server.refusing:
            self.abort()
        self.set_reading(not self._server.frozen)

    def connection_lost(self, error: Exception | None) -> None:
        """It has gone; its inputs keep their values and are free again."""
        super().connection_lost(error)
        claims = self._server.claims
        self._server.claims = {name: owner for name, owner in claims.items() if owner is not self}

    def set_reading(self, reading: bool) -> None:
        """Take in what the client sends, or leave it in the cable."""
        if self._transport is not None and self._transport.is_reading() != reading:
            (self._transport.resume_reading if reading else self._transport.pause_reading)()

    def data_received(self, data: bytes) -> None:
        """Answer every whole packet; bytes that cannot be packets end the connection."""
        try:
            for kind, payload in self._packets.feed(data):
                self._answer(kind, payload)
        except BadPacket as error:
            self.send(text_message(f"{error}; the connection is closed"))
            self.close()

    def publish(self) -> None:
        """Send this cycle's packet, if one is due; drop a client that does not read."""
        recipe, transport = self._output, self._transport
        if not self._started or recipe is None or transport is None:
            return
        if recipe.due(self._server.controller.robot.cycles):
            transport.write(recipe.packed(self._server.controller))
            if transport.get_write_buffer_size() > SLOWEST:
                transport.abort()

    def _answer(self, kind: int, payload: bytes) -> None:
        match kind:
            case Kind.PROTOCOL_VERSION:
                accepted = payload == _VERSION.pack(PROTOCOL)
                self._protocol = PROTOCOL if accepted else self._protocol
                self.send(packet(Kind.PROTOCOL_VERSION, bytes((accepted,))))
            case Kind.CONTROL_VERSION:
                version = struct.pack(">4I", *self._server.controller.robot.config.polyscope)
                self.send(packet(Kind.CONTROL_VERSION, version))
            case Kind.SETUP_OUTPUTS:
                self._set_up_outputs(payload)
            case Kind.SETUP_INPUTS:
                self._set_up_inputs(payload)
            case Kind.START:
                self._started = self._output is not None and self._output.valid
                self.send(packet(Kind.START, bytes((self._started,))))
            case Kind.PAUSE:
                self._started = False
                self.send(packet(Kind.PAUSE, b"\x01"))
            case Kind.DATA:
                self._take(payload)
            case Kind.TEXT:
                pass
            case _:
                self.send(text_message(f"packet type {kind} is not known"))

    def _set_up_outputs(self, payload: bytes) -> None:
        if self._protocol != PROTOCOL or len(payload) < _FREQUENCY.size:
            raise BadPacket("outputs are set up in protocol version 2 only, with a frequency")
        (frequency,) = _FREQUENCY.unpack_from(payload)
        names = _names(payload[_FREQUENCY.size :])
        if not 1.0 <= frequency <= CYCLES_PER_SECOND:
            self.send(text_message(f"frequency {frequency} Hz is not between 1 and {CYCLES_PER_SECOND}"))
            frequency = 0.0
        recipe = OutputRecipe(names, frequency)
        recipe.valid = recipe.valid and frequency > 0.0
        if recipe.valid:
            self._output = recipe
        self.send(packet(Kind.SETUP_OUTPUTS, bytes((recipe.valid,)) + ",".join(recipe.types).encode()))

    def _set_up_inputs(self, payload: bytes) -> None:
        names = _names(payload)
        claims = self._server.claims
        types = []
        for name in names:
            if name not in INPUTS:
                types.append(NOT_FOUND)
            elif claims.get(name, self) is not self:
                types.append(IN_USE)
            else:
                types.append(INPUTS[name].type)
        number = 0
        if names and NOT_FOUND not in types and IN_USE not in types and self._next_input < 256:
            number, self._next_input = self._next_input, self._next_input + 1
            claims.update(dict.fromkeys(names, self))
            self._inputs[number] = InputRecipe(names, [INPUTS[name] for name in names])
        self.send(packet(Kind.SETUP_INPUTS, bytes((number,)) + ",".join(types).encode()))

    def _take(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if number not in self._inputs:
            self.send(text_message(f"there is no input recipe {number}"))
            return
        self._inputs[number].apply(self._server.controller, payload[1:])


def _names(payload: bytes) -> list[str]:
    """Variable names; ``BadPacket`` where the answer with their types would not fit a packet."""
    names = [name.strip() for name in payload.decode("ascii", "replace").split(",") if name.strip()]
    longest = len(names) * (1 + len(NOT_FOUND))
    if max(len(payload), longest) > LARGEST_RECIPE:
        raise BadPacket(
            f"a recipe of {len(names)} names; its types, up to {longest} bytes, do not fit a packet"
        )
    return names
