"""What an experiment may ask of an instrument. Drivers are plain classes and inherit nothing.

Every method states an intention and may be called twice. Poses are of the flange in the
robot's base; what the flange carries is the station's business.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only


@dataclass(frozen=True)
class Channel:
    """Name, unit, shape and frame of the values of a reading."""

    name: str  #: for example ``"gel.image"`` or ``"arm.joints"``.
    unit: str  #: SI symbol, ``"count"`` for pixels, ``"1"`` for pure numbers.
    shape: tuple[int, ...]  #: of one sample.
    dtype: str  #: of one sample, as numpy writes it.
    frame: str = ""  #: the frame the numbers are in, or ``""``.
    nominal_rate: float | None = None
    """Rate in Hz according to the manufacturer; never used to compute time stamps."""


@dataclass(frozen=True, eq=False)
class Reading:
    """A block of samples of one channel, each with its measured time."""

    channel: Channel  #: what was read.
    times: FloatArray  #: ``(n,)`` s on the bench clock, measured on arrival, increasing.
    values: AnyArray  #: ``(n, *channel.shape)``, read-only.
    encoded: tuple[bytes, ...] = field(default=())
    """the bytes each sample arrived as (JPEG), where there are such; what is recorded."""

    def __post_init__(self) -> None:
        times = read_only(np.array(self.times, dtype=np.float64))
        values = read_only(np.array(self.values, dtype=self.channel.dtype))
        if values.shape != (len(times), *self.channel.shape):
            raise ValueError(
                f"{self.channel.name}: {len(times)} times and values of shape {values.shape}; "
                f"each sample must have shape {self.channel.shape}"
            )
        if self.encoded and len(self.encoded) != len(times):
            raise ValueError(f"{self.channel.name}: {len(self.encoded)} encoded samples, {len(times)} times")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)


@dataclass(frozen=True, eq=False)
class ArmState:
    """One packet of the arm's stream."""

    time: float  #: s on the bench clock, at arrival.
    joints: FloatArray  #: ``(6,)`` rad, measured.
    joint_speeds: FloatArray  #: ``(6,)`` rad/s, measured.
    base_from_flange: FloatArray  #: ``(4, 4)``, the controller's own.
    wrench: FloatArray  #: ``(6,)`` N and N m at the flange, in base.
    safety: str  #: ``"normal"``, ``"protective stop"``, ``"emergency stop"`` and so on, in words.
    moving: bool  #: whether the arm is executing a motion.


@dataclass(frozen=True)
class Health:
    """How an instrument is doing, for ``touchstone check`` and the report."""

    name: str  #: of the instrument.
    identity: str  #: model and serial number, as the instrument states them.
    rate: float  #: samples a second, measured.
    drops: int  #: samples lost since opening.
    latency: float | None  #: s, median age of a sample on arrival; None where it cannot be known.
    detail: str = ""  #: anything worth a sentence.
    failure: str = ""  #: why nothing comes from it at present; empty while something does.


class Instrument(Protocol):
    """An instrument that is opened, closed and states its health."""

    def open(self) -> None:
        """Connect and begin to sample; raises ``BenchFault`` naming the cable or the switch to look at."""

    def close(self) -> None:
        """Stop, disconnect, release."""

    def health(self) -> Health:
        """Rate, drops and latency since opening."""


@runtime_checkable
class MovingInstrument(Protocol):
    """An instrument that is stopped before any other is closed."""

    def stop(self) -> None:
        """Stop now, from any thread and in any state."""


class Arm(Instrument, Protocol):
    """A six-joint arm that moves only within the station's limits."""

    def state(self) -> ArmState:
        """The newest state; raises ``BenchFault`` where it is stale."""

    def history(self, seconds: float) -> tuple[Reading, ...]:
        """Every packet of the last ``seconds``: joints, flange poses, wrenches."""

    def move_joints(self, joints: FloatArray, speed: float, acceleration: float) -> None:
        """Move to ``(6,)`` rad at rad/s and rad/s^2; returns at rest."""

    def move_line(self, base_from_flange: FloatArray, speed: float, acceleration: float) -> None:
        """Move the flange in a straight line at m/s and m/s^2; returns at rest."""

    def move_until_contact(self, direction: FloatArray, speed: float, force: float, travel: float) -> bool:
        """Move along a unit direction in base until ``force`` N resist; False after ``travel`` m without."""

    def zero_force(self) -> None:
        """Take the present reading of the force sensor as zero; only at rest and out of contact."""

    def set_digital_output(self, index: int, on: bool) -> None:
        """Switch a tool digital output."""

    def stop(self) -> None:
        """Stop now, from any thread and in any state."""


class TactileCamera(Instrument, Protocol):
    """A gel seen from behind, or any camera."""

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames that arrive from now on, or ``BenchFault`` after ``timeout`` s."""


class ImpactHammer(Instrument, Protocol):
    """A hammer's force cell and, where one clock serves both, the microphone that hears it."""

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Listen, call ``fire()``, and return what was read around the strike.

        Args:
            fire: strikes, or asks a person to; called once, when samples are arriving.
            before: s kept from before the trigger.
            after: s kept from the trigger on.
            timeout: s from ``fire()``'s return to the trigger.

        Returns:
            Channels ``hammer.force`` and ``microphone.pressure`` (raw counts in blocks, each with the
            time of its first sample), ``hammer.clock`` and ``hammer.flags``
            (``harness.bench.acquisition_channels``). Without a trigger within ``timeout`` they are of the
            last ``before + after`` s, and flagged silent.

        Raises:
            BenchFault: samples were lost, their order was lost, or the link went away.
        """


class Microphone(Instrument, Protocol):
    """What hears the object ring; readings are blocks of counts on ``microphone.pressure``."""

    def record(self, seconds: float) -> tuple[Reading, ...]:
        """The next ``seconds`` of sound: counts, flags, callback times and the fitted clock."""

    def between(self, start: float, end: float) -> tuple[Reading, ...]:
        """The sound from ``start`` to ``end`` s on the bench clock, as ``record`` returns it.

        Raises:
            BenchFault: it is no longer remembered, or was before the opening.
        """

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Call ``fire()``; the sound from ``before`` s before it is heard to ``after`` s after.

        Flagged, not raised, where nothing is heard for ``timeout`` s.
        """


_D = TypeVar("_D", bound=Instrument)


class InstrumentName(str, Generic[_D]):
    """The name of an instrument in a station, with the protocol of the instrument that it names."""


ARM: InstrumentName[Arm] = InstrumentName("arm")
GEL: InstrumentName[TactileCamera] = InstrumentName("gel")
CAMERA: InstrumentName[TactileCamera] = InstrumentName("camera")
HAMMER: InstrumentName[ImpactHammer] = InstrumentName("hammer")
MICROPHONE: InstrumentName[Microphone] = InstrumentName("microphone")
