"""What the bench is made of: ``station.toml`` as one model."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, SerializeAsAny, model_validator

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply
from harness.basics.toml_file import StrictModel, load_toml, validate
from harness.bench.gap import USUAL, BenchErrors
from harness.bench.instruments.arm import ArmSection
from harness.bench.instruments.cameras import CameraSection, GelSection
from harness.bench.instruments.section import InstrumentSection, Placement, section_of_kind
from harness.bench.instruments.sound import HammerSection, MicrophoneSection
from harness.bench.named_files import named_file
from harness.bench.scene import Sensors


class Frames(StrictModel):
    """What the flange carries, and where."""

    flange_from_gel: Placement  #: the gel, z out of it.
    flange_from_hammer: Placement | None = None
    """the striker's tip at rest, z along the strike; None without a hammer."""


class MockSection(StrictModel):
    """The bench is mocked: the far ends of its cables are started with the station."""

    gap: str = "default"  #: reality gap, by name or path, where the run does not say another.


class Station(StrictModel):
    """A bench."""

    schema_number: Literal[1] = Field(alias="schema")  #: ``schema`` in the file.
    title: str = ""  #: one line for reports.
    arm: ArmSection  #: of the bench.
    gel: GelSection  #: on its flange.
    camera: CameraSection | None = None  #: that looks at the bench, None without.
    hammer: HammerSection | None = None  #: on its flange, None without.
    microphone: MicrophoneSection | None = None  #: that hears the strikes, None without.
    instruments: dict[str, Annotated[SerializeAsAny[InstrumentSection], BeforeValidator(section_of_kind)]] = (
        Field(default={}, exclude_if=lambda named: not named)
    )
    """further instruments by name, each with its ``kind``."""
    frames: Frames  #: what the flange carries.
    errors: BenchErrors = USUAL  #: how far the bench may be from what station and scene state.
    mock: MockSection | None = None  #: present if the bench is a mocked one.

    @property
    def flange_from_gel(self) -> FloatArray:
        """``(4, 4)``."""
        return self.frames.flange_from_gel.matrix

    @property
    def flange_from_hammer(self) -> FloatArray | None:
        """``(4, 4)``, None without a hammer."""
        placement = self.frames.flange_from_hammer
        return None if placement is None else placement.matrix

    @property
    def sections(self) -> Mapping[str, InstrumentSection]:
        """The table of each instrument by its name, in opening order."""
        tables = {**dict(self), **self.instruments}
        return {
            name: table
            for name, table in tables.items()
            if isinstance(table, InstrumentSection) and table.is_instrument
        }

    def require_section(self, name: str) -> InstrumentSection:
        """Return an instrument's table.

        Raises:
            WrongUse: the station has none of this name.
        """
        if name not in self.sections:
            raise WrongUse(f"the station {self.title!r} has no [{name}]; add one to its file")
        return self.sections[name]

    def sections_for(self, sensors: Sensors) -> Mapping[str, InstrumentSection]:
        """Return the tables of the instruments that a scene calls for, in opening order.

        Raises:
            WrongUse: the scene asks for sound, and the station has no hammer.
        """
        if sensors.sound:
            self.require_hammer()
        return {name: table for name, table in self.sections.items() if table.is_wanted(sensors)}

    def require_hammer(self) -> tuple[HammerSection, FloatArray]:
        """Return the hammer's table, and ``(4, 4)`` its tip's frame in the flange's.

        Raises:
            WrongUse: the station has none.
        """
        flange_from_hammer = self.flange_from_hammer
        if self.hammer is None or flange_from_hammer is None:
            raise WrongUse(
                f"the scene asks for sound, and the station {self.title!r} has no [hammer]; add one, or set "
                "sensors.sound = false in the scene"
            )
        return self.hammer, flange_from_hammer

    def with_addresses(self, addresses: Mapping[str, str]) -> Self:
        """Return the station with the addresses that a mocked lab took, by instrument."""
        tables = {name: self.sections[name].with_address(address) for name, address in addresses.items()}
        further = {name: tables.pop(name, table) for name, table in self.instruments.items()}
        return self.model_copy(update={**tables, "instruments": further})

    @property
    def own_microphone(self) -> MicrophoneSection | None:
        """The microphone that is an instrument of its own; None where the hammer's box hears the strikes."""
        section = self.microphone
        return section if section is not None and section.kind == "portaudio" else None

    @property
    def tool_points(self) -> FloatArray:
        """``(n, 3)`` m in the flange's frame: flange, corners of the gel's housing, the hammer's tip.

        The workspace and the speed limit hold for all of them.
        """
        width, height = (0.5 * side for side in self.gel.sensor.housing)
        corners = np.array([(x, y, 0.0) for x in (-width, width) for y in (-height, height)])
        hammer = self.flange_from_hammer
        tip = np.zeros((0, 3)) if hammer is None else hammer[None, :3, 3]
        return np.vstack([np.zeros((1, 3)), apply(self.flange_from_gel, corners), tip])

    @model_validator(mode="after")
    def _hammer_is_whole(self) -> Self:
        if self.hammer is None:
            if self.frames.flange_from_hammer is not None:
                raise ValueError("'frames.flange_from_hammer' without a [hammer]; add one or remove it")
            if self.microphone is not None:
                raise ValueError("a [microphone] without a [hammer]: nothing strikes what it would hear")
            return self
        if self.frames.flange_from_hammer is None:
            raise ValueError("'frames.flange_from_hammer' is missing; a [hammer] needs it")
        if self.microphone is None:
            raise ValueError("[microphone] is missing; a [hammer] without one is not heard")
        if self.hammer.strike == "arm" and self.arm.striker_output is None:
            raise ValueError(
                "'arm.striker_output' is missing; hammer.strike = 'arm' needs the tool output that "
                "fires the striker (or strike = 'operator')"
            )
        if self.mock is not None and self.hammer.strike == "operator":
            raise ValueError("'hammer.strike' = 'operator': nobody is at a mocked bench; use 'arm'")
        return self

    @model_validator(mode="after")
    def _has_addresses(self) -> Self:
        for name in self.instruments.keys() & type(self).model_fields.keys():
            raise ValueError(f"'instruments.{name}': [{name}] is a table of its own; use another name")
        for name, table in self.sections.items():
            key = f"{'instruments.' if name in self.instruments else ''}{name}.{table.address_key}"
            if self.mock is None and table.stated_address is None and table.needs_address:
                raise ValueError(f"{key!r} is missing; only a station with [mock] has none")
            if self.mock is not None and table.stated_address is not None:
                raise ValueError(
                    f"{key!r} = {table.stated_address!r}: a mocked bench takes an address of its own; "
                    "remove it"
                )
        return self


def station_path(name: str) -> Path:
    """The file of a station: a path, or a name in ``stations/``, here or shipped.

    Raises:
        WrongUse: there is none.
    """
    return named_file(name, "station")


def load_station(path: Path) -> Station:
    """A station file, the paths of its calibrations made absolute; ``WrongUse`` naming each mistake."""
    return load_toml(path, Station)


def station_from_json(tree: Any, where: str) -> Station:
    """The station that ``model_dump(mode="json")`` wrote, for example into a recording."""
    return validate(tree, Station, where)
