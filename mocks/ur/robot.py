"""Everything a program, a client or the dashboard can read or set of one arm."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from mocks.ur.arm.force_sensor import ForceSensor
from mocks.ur.arm.kinematics import arm_model
from mocks.ur.arm.mover import Mover
from mocks.ur.hooks import ControllerConfig
from mocks.ur.registers import Bank, Outputs, RegisterWatchdog
from mocks.ur.safety import Safety

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
    """The state of one controller; it does nothing by itself.

    Args:
        config: of the controller.

    Attributes:
        cycles: since power-on.
        inputs: registers written by clients.
        results: registers written by programs.
        written: cycle at which each input was last written by a client.
        thread: number of the program's thread that runs now; below zero for a secondary program.
        remote: whether the pendant is in remote control.
        log: newest lines of ``textmsg`` and of errors.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.config = config
        self.arm = arm_model(config.model)
        self.mover = Mover(self.arm, config.joints)
        self.force = ForceSensor(config)
        self.safety = Safety()
        self.inputs = Bank()
        self.results = Bank()
        self.outputs = Outputs()
        self.payload = Payload()
        self.gravity = [0.0, 0.0, 9.82]
        self.watchdog: RegisterWatchdog | None = None
        self.written: dict[str, int] = {}
        self.remote = config.remote
        self.thread = 0
        self.cycles = 0
        self.log: deque[str] = deque(maxlen=LOG_LENGTH)

    @property
    def time(self) -> float:
        """Seconds on the controller's clock; a sum of steps would drift."""
        return BOOTED + 0.002 * self.cycles
