"""Registers, outputs and the watchdog: what clients and programs share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

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
    """Digital and analog outputs, and the speed slider.

    Attributes:
        digital: bits 0 to 7 standard, 8 to 15 configurable, 16 and 17 at the tool.
        analog: two shares of full scale.
        analog_types: bit of each: volts rather than current.
        slider: share of the programmed speed, 0 to 1.
    """

    digital: int = 0
    analog: list[float] = field(default_factory=lambda: [0.0, 0.0])
    analog_types: int = 0
    slider: float = 1.0

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
    """An input that a client must keep writing.

    Attributes:
        variable: name of the input.
        period: s, the longest between two writes.
        action: ``"pause"``, ``"stop"`` or ``"ignore"``.
    """

    variable: str
    period: float
    action: str
