"""What the bench is made of: ``station.toml`` as one model."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from harness.arrays import FloatArray, read_only
from harness.errors import WrongUse
from harness.geometry import rotation_from_vector, transform
from harness.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Force,
    Frequency,
    Length,
    Pixels,
    Positive,
    Speed,
    Time,
)
from harness.sensor import GELSIGHT_R15, MarkerGrid, TactileSensor
from harness.toml_file import StrictModel, load_toml, nearest, validate

SENSORS = {"gelsight-r1.5": GELSIGHT_R15}
"""The makes of gel a station may name."""

_TURN = 2 * np.pi
_SHIPPED = Path(__file__).parent.parent / "stations"

Three = tuple[Length, Length, Length]
SixAngles = tuple[Angle, Angle, Angle, Angle, Angle, Angle]


class Placement(StrictModel):
    """A frame in another.

    Attributes:
        position: m, of its origin.
        rotation: rad, the rotation vector: the axis times the angle.
    """

    position: Three = (0.0, 0.0, 0.0)
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)

    @property
    def matrix(self) -> FloatArray:
        """``(4, 4)``, the outer frame from this one."""
        return read_only(transform(rotation_from_vector(np.array(self.rotation)), np.array(self.position)))


class Safety(StrictModel):
    """What the arm may be asked to do; nothing outside is ever sent. SI, as ``drivers.safety`` names them.

    Attributes:
        workspace_low: m, in base: the corner of the box that every point of the tool stays in.
        workspace_high: m, in base: the opposite corner.
        joint_low: rad.
        joint_high: rad.
        joint_step: rad, the most that a joint may turn in one motion.
        joint_speed: rad/s.
        joint_acceleration: rad/s^2.
        speed: m/s of any point of the tool, away from contact.
        speed_near: m/s while seeking contact and within ``near`` of it.
        near: m of travel around the last contact.
        acceleration: m/s^2.
        travel: m, the longest search for contact.
        force_press: N; a press beyond this is stopped.
        force_any: N; beyond this the arm is stopped and stays stopped.
        patience: s that the controller's watchdog waits for this computer before it stops the arm.
    """

    workspace_low: Three
    workspace_high: Three
    joint_low: SixAngles = (-_TURN,) * 6
    joint_high: SixAngles = (_TURN,) * 6
    joint_step: Annotated[Angle, Positive] = np.pi
    joint_speed: Annotated[AngularSpeed, Positive] = 1.5
    joint_acceleration: Annotated[AngularAcceleration, Positive] = 2.0
    speed: Annotated[Speed, Positive] = 0.25
    speed_near: Annotated[Speed, Positive] = 0.05
    near: Annotated[Length, Positive] = 0.01
    acceleration: Annotated[Acceleration, Positive] = 1.5
    travel: Annotated[Length, Positive] = 0.2
    force_press: Annotated[Force, Positive] = 10.0
    force_any: Annotated[Force, Positive] = 25.0
    patience: Annotated[Time, Positive] = 0.1

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not all(low < high for low, high in zip(self.workspace_low, self.workspace_high, strict=True)):
            raise ValueError("workspace_low must lie below workspace_high on every axis")
        if not all(low < high for low, high in zip(self.joint_low, self.joint_high, strict=True)):
            raise ValueError("joint_low must lie below joint_high for every joint")
        return self


class ArmSection(StrictModel):
    """The arm.

    Attributes:
        kind: of driver.
        model: of arm.
        address: of its control box; None only in a mocked station.
        serial: of the arm, as its plate says.
        rate: Hz of the state stream.
        safety: limits.
    """

    kind: Literal["ur"] = "ur"
    model: Literal["ur3e", "ur5e", "ur10e"] = "ur5e"
    address: str | None = None
    serial: str = ""
    rate: Annotated[Frequency, Positive] = 500.0
    safety: Safety


class Markers(StrictModel):
    """Printed dots on the gel; see ``harness.sensor.MarkerGrid``."""

    rows: int = Field(gt=0)
    columns: int = Field(gt=0)
    spacing: Annotated[Length, Positive]
    radius: Annotated[Length, Positive]


class GelSection(StrictModel):
    """The tactile camera.

    Attributes:
        kind: of driver.
        url: of its stream; None only in a mocked station.
        make: a key of ``SENSORS``.
        serial: of the sensor.
        calibration: path (relative to the station file, absolute once read) or name of a
            calibration artefact.
        casts_shadow: whether its light grazes enough for shadows.
        markers: printed on its gel, None without.
        rate: Hz, as its maker states it.
    """

    kind: Literal["gelsight-http"] = "gelsight-http"
    url: str | None = None
    make: Literal["gelsight-r1.5"] = "gelsight-r1.5"
    serial: str = ""
    calibration: str
    casts_shadow: bool = False
    markers: Markers | None = None
    rate: Annotated[Frequency, Positive] = 25.0

    @property
    def sensor(self) -> TactileSensor:
        """The geometry of this very sensor."""
        grid = None if self.markers is None else MarkerGrid(**self.markers.model_dump())
        return replace(SENSORS[self.make], markers=grid, casts_shadow=self.casts_shadow)


class CameraSection(StrictModel):
    """The scene camera.

    Attributes:
        kind: of driver.
        url: of its stream; None only in a mocked station.
        serial: of the camera.
        rows: pixels.
        columns: pixels.
        focal_length: pixels.
        base_from_camera: where it looks from (OpenCV: x right, y down, z forward).
    """

    kind: Literal["camera-http"] = "camera-http"
    url: str | None = None
    serial: str = ""
    rows: int = Field(default=480, gt=0)
    columns: int = Field(default=640, gt=0)
    focal_length: Annotated[Pixels, Positive] = 600.0
    base_from_camera: Placement


class Frames(StrictModel):
    """What the flange carries, and where."""

    flange_from_gel: Placement


class MockSection(StrictModel):
    """The bench is mocked: the far ends of its cables are started with the station.

    Attributes:
        gap: reality gap, by name or path, where the run does not say another.
    """

    gap: str = "default"


class Station(StrictModel):
    """A bench.

    Attributes:
        schema_number: ``schema`` in the file.
        title: one line for reports.
        arm: of the bench.
        gel: on its flange.
        camera: that looks at the bench, None without.
        frames: what the flange carries.
        mock: present if the bench is a mocked one.
    """

    schema_number: Literal[1] = Field(alias="schema")
    title: str = ""
    arm: ArmSection
    gel: GelSection
    camera: CameraSection | None = None
    frames: Frames
    mock: MockSection | None = None

    @property
    def flange_from_gel(self) -> FloatArray:
        """``(4, 4)``."""
        return self.frames.flange_from_gel.matrix

    @model_validator(mode="after")
    def _has_addresses(self) -> Self:
        given = {"arm.address": self.arm.address, "gel.url": self.gel.url}
        if self.camera is not None:
            given["camera.url"] = self.camera.url
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
    if name.endswith(".toml") or "/" in name:
        if not Path(name).is_file():
            raise WrongUse(f"no station file {name!r}; name one, or one of {nearest(name, _stations())}")
        return Path(name).resolve()
    known = _stations()
    if name not in known:
        raise WrongUse(f"no station {name!r}; {nearest(name, known)}; or give the path of a station file")
    return known[name]


def load_station(path: Path) -> Station:
    """A station file, the path of its calibration made absolute; ``WrongUse`` naming each mistake."""
    station = load_toml(path, Station)
    beside = path.parent / station.gel.calibration
    if not beside.exists():
        return station
    gel = station.gel.model_copy(update={"calibration": str(beside.resolve())})
    return station.model_copy(update={"gel": gel})


def station_from_json(tree: Any, where: str) -> Station:
    """The station that ``model_dump(mode="json")`` wrote, for example into a recording."""
    return validate(tree, Station, where)


def _stations() -> dict[str, Path]:
    folders = (_SHIPPED, Path.cwd() / "stations")
    return {path.stem: path.resolve() for folder in folders for path in sorted(folder.glob("*.toml"))}
