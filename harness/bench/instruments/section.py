"""The literal table of the kinds of instruments, and what every instrument's table of a station file does.

Drivers and mocks are named by import strings, loaded on use: nothing in the core imports what lies above it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, ValidationInfo

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest, real_path
from harness.basics.geometry import rotation_from_vector, transform
from harness.basics.quantities import Angle, Length
from harness.basics.toml_file import StrictModel, validate
from harness.bench.device import Instrument
from harness.bench.experiments import loaded
from harness.bench.scene import Sensors

if TYPE_CHECKING:  # a station is made of sections, and a bench is opened from a station
    from harness.bench.station import Bench
    from harness.bench.station_file import Station


@dataclass(frozen=True)
class InstrumentKind:
    """One kind of instrument, by import strings."""

    section: str  #: model of its table in a station file, an ``InstrumentSection``.
    driver: str  #: its driver, called with the section's ``options``.
    mock: str
    """starts its far end in a mocked lab (``python -m mocks.lab``): a ``mocks.far_ends.StartFarEnd``."""
    in_process: str | None = None
    """builds it on a bench in process, a ``mocks.in_process.bench.BuildInstrument``; None where only the lab
    has it."""


KINDS: dict[str, InstrumentKind] = {
    "ur": InstrumentKind(
        section="harness.bench.instruments.arm:ArmSection",
        driver="drivers.ur.arm:UrArm",
        mock="mocks.far_ends:start_arm",
        in_process="mocks.in_process.bench:build_arm",
    ),
    "gelsight-http": InstrumentKind(
        section="harness.bench.instruments.cameras:GelSection",
        driver="drivers.camera.http_camera:gelsight",
        mock="mocks.far_ends:start_gel",
        in_process="mocks.in_process.bench:build_gel",
    ),
    "camera-http": InstrumentKind(
        section="harness.bench.instruments.cameras:CameraSection",
        driver="drivers.camera.http_camera:scene_camera",
        mock="mocks.far_ends:start_camera",
        in_process="mocks.in_process.bench:build_camera",
    ),
    "dataq": InstrumentKind(
        section="harness.bench.instruments.sound:HammerSection",
        driver="drivers.dataq.hammer:DataqHammer",
        mock="mocks.far_ends:start_hammer",
        in_process="mocks.in_process.bench:build_hammer",
    ),
    "portaudio": InstrumentKind(
        section="harness.bench.instruments.sound:MicrophoneSection",
        driver="drivers.microphone.microphone:PortAudioMicrophone",
        mock="mocks.sound_card.card:start_microphone",
        in_process="mocks.in_process.bench:build_microphone",
    ),
}
"""By the ``kind`` that a station file gives."""


Three = tuple[Length, Length, Length]


class Placement(StrictModel):
    """A frame in another."""

    position: Three = (0.0, 0.0, 0.0)  #: m, of its origin.
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """rad, the rotation vector: the axis times the angle."""

    @property
    def matrix(self) -> FloatArray:
        """``(4, 4)``, the outer frame from this one."""
        return read_only(transform(rotation_from_vector(np.array(self.rotation)), np.array(self.position)))


def _beside_station(named: str, info: ValidationInfo) -> str:
    folder: Path | None = (info.context or {}).get("folder")
    return str(real_path(folder / named)) if folder is not None and (folder / named).exists() else named


CalibrationName = Annotated[str, AfterValidator(_beside_station)]
"""Path (relative to the station file, absolute once read) or name of a calibration artefact."""


@dataclass(frozen=True)
class AtRest:
    """Readings of an instrument while nothing is touched or struck."""

    levels: Mapping[str, float] = field(default_factory=dict)  #: by a key with the unit, for ``--json``.
    remarks: Mapping[str, str] = field(default_factory=dict)  #: by instrument, for the operator.


class InstrumentSection(StrictModel):
    """A station file's table of one instrument: builds its driver and states what it needs."""

    address_key: ClassVar[str]
    """the key of this table with the instrument's address; a mocked lab fills it in."""
    guards_motion: ClassVar[bool] = (
        False  #: whether a failure of this instrument ends every motion of the arm.
    )

    kind: str  #: of instrument.

    @property
    def stated_address(self) -> str | None:
        """Where the instrument is; None where nothing is stated."""
        stated: str | None = vars(self)[self.address_key]
        return stated

    def with_address(self, address: str) -> Self:
        """Return this table with the address of its instrument."""
        return self.model_copy(update={self.address_key: address})

    @property
    def needs_address(self) -> bool:
        """Return whether a real instrument needs an address in the station file."""
        return True

    @property
    def is_instrument(self) -> bool:
        """Return whether it has a driver of its own; False for a channel of another instrument's box."""
        return True

    @property
    def nominal_rate(self) -> float | None:
        """Nominal rate in Hz; None where the station states none."""
        return None

    def is_wanted(self, _sensors: Sensors) -> bool:
        """Return whether a scene calls for this instrument."""
        return True

    def options(self, station: "Station", alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver.

        Args:
            station: that the instrument belongs to.
            alarm: states why a motion must end; empty while all is well.
        """
        raise NotImplementedError(f"{type(self).__name__}.options")

    def build(self, station: "Station", alarm: Callable[[], str] = lambda: "") -> Instrument:
        """Build the driver, not yet open; arguments as of ``options``."""
        driver: Instrument = loaded(KINDS[self.kind].driver)(**self.options(station, alarm))
        return driver

    def probe(self, _name: str, _bench: "Bench") -> AtRest:
        """Read the instrument for ``touchstone check``.

        Args:
            _name: of the instrument.
            _bench: open; nothing moves.

        Raises:
            BenchFault: nothing comes from the instrument.
        """
        return AtRest()


def section_of_kind(tree: Any, info: ValidationInfo) -> InstrumentSection:
    """Read the table of an instrument by its ``kind``.

    Raises:
        ValueError: there is no such kind, or a mistake in the table.
    """
    if isinstance(tree, InstrumentSection):
        return tree
    kind = tree.get("kind") if isinstance(tree, dict) else None
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValueError(f"no kind of instrument {kind!r}; {nearest(str(kind), KINDS)}")
    model: type[InstrumentSection] = loaded(KINDS[kind].section)
    try:
        return validate(tree, model, f"kind {kind!r}", (info.context or {}).get("folder"))
    except WrongUse as mistake:
        raise ValueError(str(mistake)) from mistake
