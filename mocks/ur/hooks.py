"""What a mocked controller is told at its start, and what it asks of the bench around it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from mocks.loopback import require_own_address

Six = tuple[float, float, float, float, float, float]
Matrix = tuple[tuple[float, float, float, float], ...]
"""A homogeneous transform, four rows of four."""

CYCLE: Final = 0.002
"""s, of an e-Series controller."""

_QUARTER: Final = 1.5707963267948966
HOME: Final[Six] = (0.0, -_QUARTER, _QUARTER, -_QUARTER, -_QUARTER, 0.0)
"""rad; the arm reaches along -x of its base, the tool points down."""

LEFT_ABOVE: Final[Six] = (_QUARTER / 6.0, -1.05 * _QUARTER, _QUARTER / 1.8, -_QUARTER / 1.8, -_QUARTER, 0.0)
"""rad; where somebody left a bench's arm: the tool points down from 0.65 m, above a tall object."""


class ContactModel(Protocol):
    """What the tool feels."""

    def wrench(self, base_from_flange: Sequence[Sequence[float]], time: float) -> Sequence[float]:
        """``(6,)`` N and N m that act on the flange, in base; called once a cycle.

        Args:
            base_from_flange: ``(4, 4)``, nested.
            time: s on the controller's clock.
        """


OnCycle = Callable[[float, Six, Matrix], None]
"""Is told where the arm is, once a cycle of 2 ms: time on the controller's clock in s, joints, and
``base_from_flange``."""

OnOutputs = Callable[[int], None]
"""Is told of every change of the digital outputs: all of them, as RTDE numbers them, standard 0 to 7,
configurable 8 to 15, tool 16 and 17."""


class Cue(Protocol):
    """A fault to begin; ``mocks.ur.serve`` lists the kinds."""

    @property
    def kind(self) -> str:
        """What goes wrong."""

    @property
    def seconds(self) -> float | None:
        """How long; None until it is cleared."""


@dataclass(frozen=True)
class ControllerConfig:
    """One mocked controller.

    Raises:
        WrongUse: ``host`` is not a loopback address.
    """

    host: str  #: the loopback address that its ports are bound to.
    model: str = "ur5e"  #: ``"ur3e"``, ``"ur5e"`` or ``"ur10e"``.
    joints: Six = HOME  #: rad at power-on.
    serial: str = "00005500001"
    """of the arm, digits; a real arm's begins with its year of making, a mock's with 0000."""
    polyscope: tuple[int, int, int, int] = (5, 12, 4, 1101661)
    """the software version it reports, (major, minor, bugfix, build)."""
    seed: int = 0  #: of the force sensor's bias and noise.
    force_noise: float = 0.05  #: N, standard deviation of each force reading.
    torque_noise: float = 0.002  #: N m, standard deviation of each torque reading.
    force_bias: float = 1.0
    """N, standard deviation from which each axis' constant offset is drawn; torques have a tenth of it, in N
    m."""
    contact_force: float = 3.0  #: N against the direction of motion at which ``tool_contact`` says contact.
    remote: bool = True  #: whether the pendant is in remote control.

    def __post_init__(self) -> None:
        require_own_address(self.host)
