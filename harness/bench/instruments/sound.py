"""The tables of a station file for strikes: the impact hammer, and a microphone of its own."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from harness.basics.errors import BenchFault, CalibrationRefused, WrongUse
from harness.basics.quantities import Force, Frequency, Length, Positive, Time
from harness.bench.acquisition import AcquisitionCalibration, shipped_acquisition, strike_from_readings
from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.device import HAMMER, MICROPHONE, ImpactHammer, Microphone, Reading
from harness.bench.instruments.section import AtRest, CalibrationName, InstrumentSection
from harness.bench.scene import Sensors

if TYPE_CHECKING:
    from harness.bench.station import Bench
    from harness.bench.station_file import Station

MARGIN = 0.05
"""Duration in s of sound stored before and after the force: longer than a sound card's latency."""


class _SoundSection(InstrumentSection):
    """An instrument that a scene with sound calls for."""

    def is_wanted(self, sensors: Sensors) -> bool:
        """Return whether the scene calls for sound."""
        return sensors.sound


class HammerSection(_SoundSection):
    """The impact hammer: a force cell on a striker, read by a data-acquisition box."""

    address_key: ClassVar[str] = "port"

    kind: Literal["dataq"] = "dataq"  #: of driver.
    port: str | None = None
    """the box's serial port; None to find the box by its serial number, and in a mocked station."""
    serial: str = ""  #: of the box.
    model: Literal["DI-1110", "DI-2108"] = "DI-2108"
    """of the box; it decides resolution and the fastest rate."""
    rate: Annotated[Frequency, Positive] = 50e3  #: Hz, samples of each channel.
    calibration: CalibrationName
    """path (relative to the station file, absolute once read) or name of a calibration artefact: what a count
    of each channel means."""
    threshold: Annotated[Force, Positive] = 2.0  #: N at which a strike is noticed.
    strike: Literal["arm", "operator"] = "arm"
    """who fires it: the arm's ``striker_output``, or the operator."""
    stand_off: Annotated[Length, Positive] = 6e-3
    """m between the tip at rest and the surface when the striker is fired."""

    @property
    def acquisition(self) -> AcquisitionCalibration:
        """The calibration, read.

        Raises:
            CalibrationRefused: it is missing, damaged, or not one.
        """
        named = self.calibration
        return (
            AcquisitionCalibration.load(Path(named))
            if named.endswith(".json")
            else shipped_acquisition(named)
        )

    @property
    def needs_address(self) -> bool:
        """False where the box is found by its serial number."""
        return not self.serial

    @property
    def nominal_rate(self) -> float:
        """Sampling rate of each channel in Hz."""
        return self.rate

    def options(self, station: "Station", _alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver; ``CalibrationRefused`` for that of the box."""
        calibration = self.acquisition
        return {
            "calibration": calibration if station.own_microphone is None else calibration.without_microphone,
            "port": self.port or "",
            "serial": self.serial,
            "model": self.model,
            "rate": self.rate,
            "threshold_counts": round(self.threshold / calibration.newtons_per_count),
        }

    def probe(self, _name: str, bench: "Bench") -> AtRest:
        """Read force and sound at rest; nothing where a microphone of its own did not open."""
        microphone = bench.find(MICROPHONE)
        if microphone is None and bench.station.own_microphone is not None:
            return AtRest()
        levels = rest_levels(bench.get(HAMMER), microphone, self.acquisition)
        force, sound = f"rest {levels.force_rms_n:.3f} N rms", f"{levels.sound_level_db:.0f} dB SPL"
        remarks: dict[str, str] = {HAMMER: f"{force}, {sound}"}
        if microphone is not None:
            remarks = {HAMMER: force, MICROPHONE: f"rest {sound}"}
        return AtRest(asdict(levels), remarks)


class MicrophoneSection(_SoundSection):
    """The measurement microphone, fixed to the bench."""

    address_key: ClassVar[str] = "device"

    kind: Literal["dataq", "portaudio"] = "dataq"
    """``"dataq"``, a channel of the hammer's box, on its clock; ``"portaudio"``, a sound card's input, on a
    clock of its own. All keys below but ``serial`` are for the latter."""
    serial: str = ""  #: of the microphone.
    device: str | None = None  #: name of the sound card's input; None for the box, and in a mocked station.
    rate: Annotated[Frequency, Positive] | None = None  #: Hz, whole; one that the card has itself.
    channels: int | None = Field(default=None, gt=0)  #: inputs that the device has, exactly; None for one.
    channel: int | None = Field(default=None, ge=0)
    """which of them is the microphone, from 0; None for the first."""
    bits: Literal[24, 32] | None = None  #: of a count; None for 24.
    latency: Time | None = None
    """s by which the card's times are late, as measured; the same for all strikes."""

    @property
    def full_scale(self) -> int:
        """Greatest count of a sound card's converter."""
        return (1 << ((self.bits or 24) - 1)) - 1

    @model_validator(mode="after")
    def _belongs_to_its_kind(self) -> Self:
        own = {name: value for name, value in self if name not in ("kind", "serial")}
        for key, value in own.items():
            if self.kind == "dataq" and value is not None:
                raise ValueError(f"{key!r} belongs to kind = 'portaudio'; the box has its own: remove it")
        if self.kind == "portaudio" and self.rate is None:
            raise ValueError("'rate' is missing; kind = 'portaudio' needs it")
        if self.rate is not None and self.rate != round(self.rate):
            raise ValueError(f"'rate' is {self.rate:g} Hz; a sound card takes whole numbers of Hz")
        if (self.channel or 0) >= (self.channels or 1):
            raise ValueError(
                f"'channel' is {self.channel}, counted from 0, and the device has {self.channels or 1}"
            )
        return self

    @property
    def is_instrument(self) -> bool:
        """False on the hammer's box."""
        return self.kind == "portaudio"

    @property
    def nominal_rate(self) -> float | None:
        """Sampling rate in Hz; None on the hammer's box."""
        return self.rate

    def options(self, station: "Station", _alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver.

        Raises:
            WrongUse: the station has no hammer.
            CalibrationRefused: for the hammer's box, or for a microphone on another converter.
        """
        hammer = station.hammer
        if hammer is None:
            raise WrongUse(
                f"the station {station.title!r} has no [hammer], whose strikes would be heard; add one"
            )
        calibrated = hammer.acquisition.microphone_full_scale_counts
        if calibrated != self.full_scale:
            raise CalibrationRefused(
                f"the calibration {hammer.calibration!r} is of a microphone whose converter has full "
                f"scale {calibrated}, the station's [microphone] has {self.full_scale}: set its bits, or "
                "calibrate it"
            )
        return {
            "device": self.device,
            "rate": round(self.rate or 0.0),
            "channels": self.channels or 1,
            "channel": self.channel or 0,
            "bits": self.bits or 24,
            "serial": self.serial,
            "latency": self.latency or 0.0,
        }


_LISTEN = 0.5
"""s."""

_ATTEMPTS = 3
"""Times that is listened where samples of the sound were lost: a computer may be busy for a moment."""

_HEARING = 20e-6
"""Pa, the reference of sound pressure levels (ISO 1683)."""


@dataclass(frozen=True)
class RestLevels:
    """What the hammer's box reads while nothing is struck."""

    force_rms_n: float  #: N, about its mean.
    pressure_rms_pa: float  #: Pa, about its mean.
    sound_level_db: float  #: of the pressure, over 20 uPa.


def rest_levels(
    hammer: ImpactHammer, microphone: Microphone | None, calibration: AcquisitionCalibration
) -> RestLevels:
    """Listen for a moment with nothing fired.

    Args:
        hammer: open.
        microphone: with a clock of its own; None where the hammer's box reads it.
        calibration: of the hammer's box.

    Raises:
        BenchFault: the box failed.
        DataRefused: a channel rests where its calibration says that it cannot.
    """
    for _ in range(_ATTEMPTS):
        readings = capture(hammer, microphone, lambda: None, 0.0, _LISTEN, 0.0)
        rest = strike_from_readings({reading.channel.name: reading for reading in readings}, calibration)
        if not rest.lost:
            break
    else:
        raise BenchFault(f"the microphone cannot be used: {rest.lost}; close what else runs, or try again")
    pressure = float(rest.pressure.std())
    # A converter that reads one count for ever is broken, not silent.
    level = 20.0 * math.log10(pressure / _HEARING) if pressure > 0.0 else -math.inf
    if not math.isfinite(level):
        raise BenchFault("the microphone reads the same count for ever; check its cable and its supply")
    return RestLevels(float(rest.force.std()), pressure, level)


def capture(
    hammer: ImpactHammer,
    microphone: Microphone | None,
    fire: Callable[[], None],
    before: float,
    after: float,
    timeout: float,
) -> tuple[Reading, ...]:
    """Call ``fire()`` and return what was read around the strike, by whatever hears it.

    The force triggers; a microphone of its own listens all the time and is asked afterwards for the
    same stretch of the bench clock.

    Args:
        hammer: its box reads the force.
        microphone: on a clock of its own; None where the hammer's box reads it too.
        fire: strikes, or asks a person to.
        before: s kept from before the trigger.
        after: s kept from the trigger on.
        timeout: s from ``fire()``'s return to the trigger.

    Returns:
        The channels of ``ImpactHammer.capture``. From a microphone of its own ``microphone.pressure``
        is that microphone's, with its flags, callback times and clock (``harness.bench.microphone_take``).

    Raises:
        BenchFault: samples of the force were lost, or an instrument went away. Lost sound is flagged.
    """
    read = hammer.capture(fire, before, after, timeout)
    if microphone is None:
        return read
    force = next(reading for reading in read if reading.channel.name == FORCE)
    # Block times are those of the first samples: one block more lies behind the last of them.
    longest = before + after + 2.0 * MARGIN
    start = float(force.times[0]) - MARGIN
    heard = microphone.between(start, start + longest)
    return (*(reading for reading in read if reading.channel.name != PRESSURE), *heard)
