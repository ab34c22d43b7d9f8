"""Power, protective and emergency stops, as the controller reports them (Universal Robots, RTDE guide)."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

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
    """The safety system's state.

    Attributes:
        mode: what it does.
        power: of the arm.
        button: whether an emergency stop button is pressed.
        cause: of the last stop, in words.
        stopped_at: s on the controller's clock.
    """

    mode: SafetyMode = SafetyMode.NORMAL
    power: RobotMode = RobotMode.RUNNING
    button: bool = False
    cause: str = ""
    stopped_at: float = 0.0

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
