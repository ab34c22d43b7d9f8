"""The cameras' tables of a station file: the tactile camera on the flange, and the scene camera."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator

from harness.basics.errors import WrongUse
from harness.basics.quantities import Frequency, Length, Pixels, Positive
from harness.basics.toml_file import StrictModel
from harness.bench.device import InstrumentName, TactileCamera
from harness.bench.instruments.section import AtRest, CalibrationName, InstrumentSection, Placement
from harness.bench.scene import Sensors
from harness.bench.sensor import (
    DEFAULT_MAKE,
    MarkerGrid,
    SensorDescription,
    TactileSensor,
    described_sensor,
    sensor_path,
    shipped_sensors,
)

if TYPE_CHECKING:
    from harness.bench.station import Bench
    from harness.bench.station_file import Station

_FRAME_WITHIN = 3.0
"""s for a frame to arrive."""

USB_CAMERA = (
    "a USB camera is served as MJPEG over HTTP by a program such as ustreamer (ustreamer "
    "--device=/dev/video0 --format=MJPEG --host=127.0.0.1 --port=8080 serves http://127.0.0.1:8080/stream)"
)
"""Advice to an operator of a USB camera, which no driver reads."""


def _require_http(url: str | None) -> str | None:
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


class _HttpCameraSection(InstrumentSection):
    """A camera that streams over HTTP."""

    address_key: ClassVar[str] = "url"

    def probe(self, name: str, bench: "Bench") -> AtRest:
        """Wait for a frame."""
        bench.get(InstrumentName[TactileCamera](name)).read(1, timeout=_FRAME_WITHIN)
        return AtRest()


class Markers(StrictModel):
    """Printed dots on the gel; see ``harness.bench.sensor.MarkerGrid``."""

    rows: int = Field(gt=0)
    columns: int = Field(gt=0)
    spacing: Annotated[Length, Positive]
    radius: Annotated[Length, Positive]


class GelSection(_HttpCameraSection):
    """The tactile camera."""

    guards_motion: ClassVar[bool] = True

    kind: Annotated[Literal["gelsight-http"], _KIND] = "gelsight-http"  #: of driver.
    url: HttpAddress = None  #: of its stream; None only in a mocked station.
    make: str = DEFAULT_MAKE
    """the shipped name of a sensor, or the path of a sensor's file (relative to the station file, absolute
    once read)."""
    serial: str = ""  #: of the sensor.
    calibration: CalibrationName
    """path (relative to the station file, absolute once read) or name of a calibration artefact."""
    casts_shadow: bool = False  #: whether its light grazes enough for shadows.
    markers: Markers | None = None  #: printed on its gel; None for those of its make, if it has any.
    rate: Annotated[Frequency, Positive] = 25.0  #: Hz, as its maker states it.

    @property
    def described(self) -> SensorDescription:
        """Description of the make, from its file."""
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

    @property
    def nominal_rate(self) -> float:
        """Frame rate in Hz, as the maker states it."""
        return self.rate

    def options(self, _station: "Station", _alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver."""
        return {"url": self.url, "sensor": self.sensor, "serial": self.serial, "nominal_rate": self.rate}


class CameraSection(_HttpCameraSection):
    """The scene camera."""

    kind: Annotated[Literal["camera-http"], _KIND] = "camera-http"  #: of driver.
    url: HttpAddress = None  #: of its stream; None only in a mocked station.
    serial: str = ""  #: of the camera.
    rows: int = Field(default=480, gt=0)  #: pixels.
    columns: int = Field(default=640, gt=0)  #: pixels.
    focal_length: Annotated[Pixels, Positive] = 600.0  #: pixels.
    base_from_camera: Placement  #: where it looks from (OpenCV: x right, y down, z forward).

    def is_wanted(self, sensors: Sensors) -> bool:
        """Return whether the scene is photographed."""
        return sensors.camera

    def options(self, _station: "Station", _alarm: Callable[[], str]) -> dict[str, object]:
        """Return the arguments of the driver."""
        return {"url": self.url, "rows": self.rows, "columns": self.columns, "serial": self.serial}
