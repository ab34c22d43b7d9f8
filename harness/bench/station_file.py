"""What the bench is made of: ``station.toml`` as one model."""

from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from harness.basics.arrays import FloatArray
from harness.basics.files.named_file import real_path
from harness.basics.geometry import apply
from harness.basics.toml_file import StrictModel, load_toml, validate
from harness.bench.bench_errors import USUAL, BenchErrors
from harness.bench.named_files import named_file
from harness.bench.station_sections import (
    ArmSection,
    CameraSection,
    GelSection,
    HammerSection,
    MicrophoneSection,
    Placement,
)


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
        given = {"arm.address": self.arm.address, "gel.url": self.gel.url}
        if self.camera is not None:
            given["camera.url"] = self.camera.url
        if self.hammer is not None and not (self.mock is None and self.hammer.serial):
            given["hammer.port"] = self.hammer.port
        if self.own_microphone is not None:
            given["microphone.device"] = self.own_microphone.device
        for key, value in given.items():
            if self.mock is None and value is None:
                raise ValueError(f"{key!r} is missing; only a station with [mock] has none")
            if self.mock is not None and value is not None:
                raise ValueError(
                    f"{key!r} = {value!r}: a mocked bench takes an address of its own; remove it"
                )
        return self


def station_path(name: str) -> Path:
    """The file of a station: a path, or a name found in ``stations/`` here or in the checkout.

    Raises:
        WrongUse: there is none.
    """
    return named_file(name, "station")


def load_station(path: Path) -> Station:
    """A station file, the paths of its calibrations made absolute; ``WrongUse`` naming each mistake."""
    station = load_toml(path, Station)
    gel = station.gel.model_copy(update={"calibration": _found(path, station.gel.calibration)})
    hammer = station.hammer
    if hammer is not None:
        hammer = hammer.model_copy(update={"calibration": _found(path, hammer.calibration)})
    return station.model_copy(update={"gel": gel, "hammer": hammer})


def _found(station: Path, calibration: str) -> str:
    """The absolute path of a calibration beside the station file; else the name it is given by."""
    beside = station.parent / calibration
    return str(real_path(beside)) if beside.exists() else calibration


def station_from_json(tree: Any, where: str) -> Station:
    """The station that ``model_dump(mode="json")`` wrote, for example into a recording."""
    return validate(tree, Station, where)
