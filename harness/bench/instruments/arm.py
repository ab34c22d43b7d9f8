"""The arm's table of a station file, with the limits of its motion."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from harness.basics.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Force,
    Frequency,
    Length,
    Positive,
    Speed,
    Time,
)
from harness.basics.toml_file import StrictModel
from harness.bench.experiments import loaded
from harness.bench.instruments.section import InstrumentSection, Three

if TYPE_CHECKING:
    from harness.bench.station_file import Station

LIMITS = "drivers.ur.safety:SafetyLimits"
"""Import string of the form in which the driver takes the station's limits."""

_TURN = 2 * np.pi

SixAngles = tuple[Angle, Angle, Angle, Angle, Angle, Angle]


class SafetySection(StrictModel):
    """Limits of the arm; a command outside them is never sent. SI, as ``drivers.ur.safety`` names them."""

    workspace_low: Three  #: m, in base: the corner of the box that every point of the tool stays in.
    workspace_high: Three  #: m, in base: the opposite corner.
    joint_low: SixAngles = (-_TURN,) * 6  #: rad.
    joint_high: SixAngles = (_TURN,) * 6  #: rad.
    joint_step: Annotated[Angle, Positive] = np.pi  #: rad, the most that a joint may turn in one motion.
    joint_speed: Annotated[AngularSpeed, Positive] = 1.5  #: rad/s.
    joint_acceleration: Annotated[AngularAcceleration, Positive] = 2.0  #: rad/s^2.
    speed: Annotated[Speed, Positive] = 0.25  #: m/s of any point of the tool, away from contact.
    speed_near: Annotated[Speed, Positive] = 0.05  #: m/s while seeking contact and within ``near`` of it.
    near: Annotated[Length, Positive] = 0.01  #: m of travel around the last contact.
    acceleration: Annotated[Acceleration, Positive] = 1.5  #: m/s^2.
    travel: Annotated[Length, Positive] = 0.2  #: m, the longest search for contact.
    force_press: Annotated[Force, Positive] = 10.0  #: N; a press beyond this is stopped.
    force_any: Annotated[Force, Positive] = 25.0  #: N; beyond this the arm is stopped and stays stopped.
    patience: Annotated[Time, Positive] = 0.1
    """s that the controller's watchdog waits for this computer before it stops the arm."""

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not all(low < high for low, high in zip(self.workspace_low, self.workspace_high, strict=True)):
            raise ValueError("workspace_low must lie below workspace_high on every axis")
        if not all(low < high for low, high in zip(self.joint_low, self.joint_high, strict=True)):
            raise ValueError("joint_low must lie below joint_high for every joint")
        return self


class ArmSection(InstrumentSection):
    """The arm."""

    address_key: ClassVar[str] = "address"

    kind: Literal["ur"] = "ur"  #: of driver.
    model: Literal["ur3e", "ur5e", "ur10e"] = "ur5e"  #: of arm.
    address: str | None = None  #: of its control box; None only in a mocked station.
    serial: str = ""  #: number on the arm's plate.
    rate: Annotated[Frequency, Positive] = 500.0  #: Hz of the state stream.
    striker_output: Literal[0, 1] | None = None
    """the tool digital output (0 or 1) that fires the hammer's striker; None without one."""
    safety: SafetySection  #: limits.

    @property
    def nominal_rate(self) -> float:
        """Rate of the state stream in Hz."""
        return self.rate

    def options(self, station: "Station", alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver; the limits hold for flange, gel housing and hammer."""
        return {
            "address": self.address,
            "model": self.model,
            "limits": loaded(LIMITS)(**self.safety.model_dump()),
            "rate": self.rate,
            "tool_points": station.tool_points.tolist(),
            "alarm": alarm,
        }
