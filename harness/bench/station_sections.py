"""The instruments of a station file, one model for each."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.geometry import rotation_from_vector, transform
from harness.basics.quantities import (
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
from harness.basics.toml_file import StrictModel
from harness.bench.acquisition import AcquisitionCalibration, shipped_acquisition
from harness.bench.sensor import (
    DEFAULT_MAKE,
    MarkerGrid,
    SensorDescription,
    TactileSensor,
    described_sensor,
    sensor_path,
    shipped_sensors,
)

_TURN = 2 * np.pi

USB_CAMERA = (
    "a USB camera is served as MJPEG over HTTP by a program such as ustreamer (ustreamer "
    "--device=/dev/video0 --format=MJPEG --host=127.0.0.1 --port=8080 serves http://127.0.0.1:8080/stream)"
)
"""Advice to an operator of a USB camera, which no driver reads."""


def _require_http(url: str | None) -> str | None:
    """Return the address of a stream, or refuse one that no HTTP camera has."""
    if url is not None and not url.startswith(("http://", "https://")):
        raise ValueError(f"{url!r} is not the address of a stream (http://...); {USB_CAMERA}")
    return url


def _require_http_kind(kind: object) -> object:
    """Refuse a kind of camera without a driver, saying how to use a USB camera."""
    if kind not in ("gelsight-http", "camera-http"):
        raise ValueError(f"no driver reads a camera of the kind {kind!r}; {USB_CAMERA}")
    return kind


_KIND = BeforeValidator(_require_http_kind)
HttpAddress = Annotated[str | None, AfterValidator(_require_http)]

Three = tuple[Length, Length, Length]
SixAngles = tuple[Angle, Angle, Angle, Angle, Angle, Angle]


class Placement(StrictModel):
    """A frame in another."""

    position: Three = (0.0, 0.0, 0.0)  #: m, of its origin.
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """rad, the rotation vector: the axis times the angle."""

    @property
    def matrix(self) -> FloatArray:
        """``(4, 4)``, the outer frame from this one."""
        return read_only(transform(rotation_from_vector(np.array(self.rotation)), np.array(self.position)))


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


class ArmSection(StrictModel):
    """The arm."""

    kind: Literal["ur"] = "ur"  #: of driver.
    model: Literal["ur3e", "ur5e", "ur10e"] = "ur5e"  #: of arm.
    address: str | None = None  #: of its control box; None only in a mocked station.
    serial: str = ""  #: of the arm, as its plate says.
    rate: Annotated[Frequency, Positive] = 500.0  #: Hz of the state stream.
    striker_output: Literal[0, 1] | None = None
    """the tool digital output (0 or 1) that fires the hammer's striker; None without one."""
    safety: SafetySection  #: limits.


class Markers(StrictModel):
    """Printed dots on the gel; see ``harness.bench.sensor.MarkerGrid``."""

    rows: int = Field(gt=0)
    columns: int = Field(gt=0)
    spacing: Annotated[Length, Positive]
    radius: Annotated[Length, Positive]


class GelSection(StrictModel):
    """The tactile camera."""

    kind: Annotated[Literal["gelsight-http"], _KIND] = "gelsight-http"  #: of driver.
    url: HttpAddress = None  #: of its stream; None only in a mocked station.
    make: str = DEFAULT_MAKE
    """the shipped name of a sensor, or the path of a sensor's file (relative to the station file, absolute
    once read)."""
    serial: str = ""  #: of the sensor.
    calibration: str
    """path (relative to the station file, absolute once read) or name of a calibration artefact."""
    casts_shadow: bool = False  #: whether its light grazes enough for shadows.
    markers: Markers | None = None  #: printed on its gel; None for those of its make, if it has any.
    rate: Annotated[Frequency, Positive] = 25.0  #: Hz, as its maker states it.

    @property
    def described(self) -> SensorDescription:
        """The make, as its file says."""
        return described_sensor(self.make)

    @property
    def sensor(self) -> TactileSensor:
        """The geometry of this very sensor."""
        made = self.described.sensor
        grid = made.markers if self.markers is None else MarkerGrid(**self.markers.model_dump())
        return replace(made, markers=grid, casts_shadow=self.casts_shadow)

    @field_validator("make")
    @classmethod
    def _is_described(cls, make: str, info: ValidationInfo) -> str:
        try:
            path = str(sensor_path(make, (info.context or {}).get("folder")))
            described_sensor(path)
            return make if make in shipped_sensors() else path  # one that holds wherever it is read from
        except WrongUse as error:
            raise ValueError(str(error)) from error


class HammerSection(StrictModel):
    """The impact hammer: a force cell on a striker, read by a data-acquisition box."""

    kind: Literal["dataq"] = "dataq"  #: of driver.
    port: str | None = None
    """the box's serial port; None to find the box by its serial number, and in a mocked station."""
    serial: str = ""  #: of the box.
    model: Literal["DI-1110", "DI-2108"] = "DI-2108"
    """of the box; it decides resolution and the fastest rate."""
    rate: Annotated[Frequency, Positive] = 50e3  #: Hz, samples of each channel.
    calibration: str
    """path (relative to the station file, absolute once read) or name of a calibration artefact: what a count
    of each channel means."""
    threshold: Annotated[Force, Positive] = 2.0  #: N at which a strike is noticed.
    strike: Literal["arm", "operator"] = "arm"
    """who fires it: the arm's ``striker_output``, or a person who is asked to."""
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


class MicrophoneSection(StrictModel):
    """The measurement microphone, fixed to the bench."""

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


class CameraSection(StrictModel):
    """The scene camera."""

    kind: Annotated[Literal["camera-http"], _KIND] = "camera-http"  #: of driver.
    url: HttpAddress = None  #: of its stream; None only in a mocked station.
    serial: str = ""  #: of the camera.
    rows: int = Field(default=480, gt=0)  #: pixels.
    columns: int = Field(default=640, gt=0)  #: pixels.
    focal_length: Annotated[Pixels, Positive] = 600.0  #: pixels.
    base_from_camera: Placement  #: where it looks from (OpenCV: x right, y down, z forward).
