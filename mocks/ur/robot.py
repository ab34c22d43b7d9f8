"""Everything a program, a client or the dashboard can read or set of one arm."""

import math
import random
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

from mocks.ur.arm import poses
from mocks.ur.arm.kinematics import arm_model
from mocks.ur.arm.mover import Mover
from mocks.ur.arm.poses import Vector
from mocks.ur.hooks import ControllerConfig, Matrix, Six

RECENT = 64
"""Cycles that ``tool_contact`` looks back."""

NO_WRENCH: Six = (0.0,) * 6


class ForceSensor:
    """Readings of one cycle after another.

    Noise is a function of (seed, step of the run, cycles since the motion began), and of nothing else.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        drawn = random.Random(f"bias {config.seed}")
        spread = config.force_bias
        self._bias = [drawn.gauss(0.0, spread) for _ in range(3)]
        self._bias += [drawn.gauss(0.0, 0.1 * spread) for _ in range(3)]
        self._zero = [0.0] * 6
        self._noise = random.Random()
        self._recent: deque[Vector] = deque(maxlen=RECENT)
        self.broken = False  #: whether ``at_tcp`` reads no numbers.
        self.raw: Six = NO_WRENCH  #: ``(6,)`` N and N m in the flange's frame, bias included.
        self.base: Six = NO_WRENCH
        """``(6,)`` N and N m at the flange, in base, as exerted plus noise: no bias."""
        self.begin_motion(0)

    def begin_motion(self, step: int) -> None:
        """Start the sequence of noise of a step of the run."""
        self._noise.seed(f"noise {self._config.seed} {step}")

    def read(self, wrench: Sequence[float], base_from_flange: Matrix) -> None:
        """One cycle: ``(6,)`` N and N m act on the flange, in base."""
        fx, fy, fz, tx, ty, tz = wrench
        gauss, force, torque = self._noise.gauss, self._config.force_noise, self._config.torque_noise
        f = poses.rotated_back(base_from_flange, (fx, fy, fz))
        t = poses.rotated_back(base_from_flange, (tx, ty, tz))
        felt = (
            *(part + gauss(0.0, force) for part in f),
            *(part + gauss(0.0, torque) for part in t),
        )
        self.base = _turned(base_from_flange, felt)
        self._recent.append(self.base[:3])
        a, b, c, d, e, g = (part + bias for part, bias in zip(felt, self._bias, strict=True))
        self.raw = a, b, c, d, e, g

    def zero(self) -> None:
        """Take the present reading as zero."""
        self._zero = list(self.raw)

    def at_tcp(self, base_from_flange: Matrix, flange_from_tcp: Matrix) -> Six:
        """``actual_TCP_force``: N and N m at the tool centre point, in base."""
        if self.broken:
            return (math.nan,) * 6
        a, b, c, d, e, g = (part - zero for part, zero in zip(self.raw, self._zero, strict=True))
        turned = _turned(base_from_flange, (a, b, c, d, e, g))
        x, y, z = poses.rotated(base_from_flange, poses.translation(flange_from_tcp))
        fx, fy, fz, tx, ty, tz = turned
        return fx, fy, fz, tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx)

    def contact_cycles(self, direction: Vector) -> int:
        """Cycles since something first resisted motion along ``direction``; 0 where nothing does.

        All directions count where ``direction`` is zero. Contact is said at the configured force, and
        dated back to where the force left the noise.
        """
        floor = 4.0 * self._config.force_noise
        cycles = 0
        for force in reversed(self._recent):
            resistance = _resistance(force, direction)
            if cycles == 0 and resistance < self._config.contact_force:
                return 0
            if resistance <= floor:
                break
            cycles += 1
        return cycles


UNLOCK_AFTER: Final = 5.0
"""s from a protective stop to when it may be unlocked."""

FORCE_LIMIT: Final = 150.0
"""N at the tool; a setting of the safety configuration on a real controller."""


class RobotMode(IntEnum):
    """Power and brakes."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


class SafetyMode(IntEnum):
    """What the safety system does."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7


_BITS: Final = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
}


@dataclass
class Safety:
    """The safety system's state."""

    mode: SafetyMode = SafetyMode.NORMAL  #: what it does.
    power: RobotMode = RobotMode.RUNNING  #: of the arm.
    button: bool = False  #: whether an emergency stop button is pressed.
    cause: str = ""  #: of the last stop, in words.
    stopped_at: float = 0.0  #: s on the controller's clock.

    @property
    def bits(self) -> int:
        """``safety_status_bits``."""
        return _BITS[self.mode]

    @property
    def may_move(self) -> bool:
        """Whether a program may move the arm."""
        return self.mode is SafetyMode.NORMAL and self.power is RobotMode.RUNNING

    def protective_stop(self, cause: str, time: float) -> bool:
        """Latch one; False where the arm is stopped already."""
        if self.mode is not SafetyMode.NORMAL:
            return False
        self.mode, self.cause, self.stopped_at = SafetyMode.PROTECTIVE_STOP, cause, time
        return True

    def emergency_stop(self, time: float) -> None:
        """The button is pressed: power goes."""
        self.mode, self.cause, self.stopped_at = SafetyMode.ROBOT_EMERGENCY_STOP, "emergency stop", time
        self.power, self.button = RobotMode.POWER_OFF, True

    def release_button(self) -> None:
        """The button is turned back; the arm stays without power."""
        if self.button:
            self.button = False
            self.mode = SafetyMode.NORMAL

    def may_unlock(self, time: float) -> bool:
        """Whether the protective stop is old enough."""
        return time - self.stopped_at >= UNLOCK_AFTER

    def unlock(self) -> None:
        """End the protective stop."""
        if self.mode is SafetyMode.PROTECTIVE_STOP:
            self.mode = SafetyMode.NORMAL


NUMERIC: Final = 48
BITS: Final = 128
INT32: Final = range(-(2**31), 2**31)


@dataclass
class Bank:
    """Registers of one direction."""

    ints: list[int] = field(default_factory=lambda: [0] * NUMERIC)
    doubles: list[float] = field(default_factory=lambda: [0.0] * NUMERIC)
    bits: list[bool] = field(default_factory=lambda: [False] * BITS)

    def word(self, start: int) -> int:
        """32 bits as one number, the first lowest."""
        return sum(1 << i for i, bit in enumerate(self.bits[start : start + 32]) if bit)

    def set_word(self, start: int, value: int) -> None:
        """Set 32 bits from one number."""
        self.bits[start : start + 32] = [bool(value >> i & 1) for i in range(32)]


@dataclass
class Outputs:
    """Digital and analog outputs, and the speed slider."""

    digital: int = 0  #: bits 0 to 7 standard, 8 to 15 configurable, 16 and 17 at the tool.
    analog: list[float] = field(default_factory=lambda: [0.0, 0.0])  #: two shares of full scale.
    analog_types: int = 0  #: bit of each: volts rather than current.
    slider: float = 1.0  #: share of the programmed speed, 0 to 1.

    def apply(self, sent: Mapping[str, Any]) -> None:
        """What a client sent: of each value, only what its mask names; the rest may be garbage."""
        for group, shift in _DIGITAL.items():
            mask = sent.get(f"{group}_mask", 0) << shift
            self.digital = self.digital & ~mask | sent.get(group, 0) << shift & mask
        if sent.get("speed_slider_mask", 0):
            fraction = sent.get("speed_slider_fraction", self.slider)
            if 0.0 <= fraction <= 1.0:
                self.slider = fraction
        mask = sent.get("standard_analog_output_mask", 0)
        kinds = sent.get("standard_analog_output_type", 0)
        self.analog_types = self.analog_types & ~mask | kinds & mask
        for index in (0, 1):
            if mask >> index & 1:
                self.analog[index] = sent.get(f"standard_analog_output_{index}", 0.0)


_DIGITAL: Final = {
    "standard_digital_output": 0,
    "configurable_digital_output": 8,
    "tool_digital_output": 16,
}


@dataclass(frozen=True)
class RegisterWatchdog:
    """An input that a client must keep writing."""

    variable: str  #: name of the input.
    period: float  #: s, the longest between two writes.
    action: str  #: ``"pause"``, ``"stop"`` or ``"ignore"``.


BOOTED: Final = 100.0
"""s on the controller's clock at the start; clients take a clock below 40 s for a booting controller."""

LOG_LENGTH: Final = 1000


@dataclass
class Payload:
    """What the program says that the tool weighs: kg, m in the flange, kg m^2."""

    mass: float = 0.0
    centre: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    inertia: list[float] = field(default_factory=lambda: [0.0] * 6)


class Robot:
    """The state of one controller; it does nothing by itself."""

    def __init__(self, config: ControllerConfig) -> None:
        self.config = config
        self.arm = arm_model(config.model)
        self.mover = Mover(self.arm, config.joints)
        self.force = ForceSensor(config)
        self.safety = Safety()
        self.inputs = Bank()  #: registers written by clients.
        self.results = Bank()  #: registers written by programs.
        self.outputs = Outputs()
        self.payload = Payload()
        self.gravity = [0.0, 0.0, 9.82]
        self.watchdog: RegisterWatchdog | None = None
        self.written: dict[str, int] = {}  #: cycle at which each input was last written by a client.
        self.remote = config.remote  #: whether the pendant is in remote control.
        self.thread = 0  #: number of the program's thread that runs now; below zero for a secondary program.
        self.cycles = 0  #: since power-on.
        self.log: deque[str] = deque(maxlen=LOG_LENGTH)  #: newest lines of ``textmsg`` and of errors.

    @property
    def time(self) -> float:
        """Seconds on the controller's clock; a sum of steps would drift."""
        return BOOTED + 0.002 * self.cycles


def _resistance(force: Vector, direction: Vector) -> float:
    length = math.hypot(*direction)
    if length == 0.0:
        return math.hypot(*force)
    return -sum(f * d for f, d in zip(force, direction, strict=True)) / length


def _turned(frame: Matrix, wrench: Sequence[float]) -> Six:
    """Both vectors of a wrench into the outer frame; its point stays."""
    fx, fy, fz, tx, ty, tz = wrench
    return (*poses.rotated(frame, (fx, fy, fz)), *poses.rotated(frame, (tx, ty, tz)))
