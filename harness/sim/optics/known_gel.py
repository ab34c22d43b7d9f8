"""The gel that a press is drawn on: a make by its name, a calibration of ours or a published one."""

from dataclasses import dataclass, replace
from pathlib import Path

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import CalibrationRefused, DataRefused, WrongUse
from harness.bench.sensor import (
    DEFAULT_MAKE,
    SensorDescription,
    TactileSensor,
    described_sensor,
    shipped_sensors,
)
from harness.picture.square_pixels import aspect_stated, made_square
from harness.sim.gel.contact_force import ForceTable
from harness.sim.gel.elastic import NOT_MEASURED, GelElastic
from harness.sim.gel.markers import MarkerFile
from harness.sim.optics.lit_calibration import named_calibration, shadow_of
from harness.sim.optics.published_pack import SHADOWS, TABLE, PublishedPack, is_published, read_published
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import TactileCalibration, with_background


@dataclass(frozen=True, eq=False)
class Gel:
    """A sensor and all that is known of its gel."""

    sensor: TactileSensor  #: its geometry; whether it casts shadows is said by ``shadow``.
    calibration: TactileCalibration  #: of its colours.
    rest: FloatArray | None = None
    """``(rows, columns)`` metres, the untouched surface towards the camera; None for the sensor's."""
    shadow: ShadowTable | None = None  #: of its light; None for one that casts none.
    noise: float = 0.0  #: grey levels, sigma of the camera's; 0 for none.
    seed: int = 0  #: of the noise.
    dots: MarkerFile | None = None
    """printed on it, as they were measured; None for the sensor's own grid, if it has one."""
    elastic: GelElastic = NOT_MEASURED  #: how stiff it is.
    forces: ForceTable | None = None  #: measured on it; None where nobody did.

    def __post_init__(self) -> None:
        require_own(self.calibration, self.sensor)
        if self.dots is not None:
            self._require_own_dots(self.dots)

    @property
    def aspect(self) -> float:
        """A pixel's height over its width in what the camera gives: live pictures are made square by it."""
        return aspect_stated(self.calibration.header.made_from)

    def with_dots(self, dots: MarkerFile) -> "Gel":
        """The same gel with the dots measured on it; ``DataRefused`` for those of another picture."""
        return replace(self, sensor=replace(self.sensor, markers=dots.grid(self.sensor.pitch)), dots=dots)

    def _require_own_dots(self, dots: MarkerFile) -> None:
        seen, own = (dots.picture_rows, dots.picture_columns), (self.sensor.rows, self.sensor.columns)
        if seen != own:
            raise DataRefused(
                f"the dots were measured in a picture of {seen[0]} x {seen[1]} pixels and {self.sensor.name} "
                f"has {own[0]} x {own[1]}; measure them at the sensor's own resolution"
            )


_SAME_PITCH = 0.01
"""Relative: pitches this near are of the same make."""


def known_gel(
    make: str | None,
    calibration: str | None,
    *,
    pitch: float | None = None,
    thickness: float | None = None,
    background: ByteArray | None = None,
    shadow: bool | None = None,
) -> Gel:
    """Put a gel together from what an operator says of it.

    Args:
        make: the shipped name of a sensor or the path of a sensor's file; None to go by the calibration, or
            for the default one.
        calibration: a file of ours, a published folder or the name of a shipped one; None for the make's.
        pitch: metres a pixel, where neither the make nor the calibration says it.
        thickness: metres of the gel, in place of the make's.
        background: ``(rows, columns, 3)`` RGB of the untouched gel as its camera gives it, in place of the
            calibration's; made square as the calibration's presses were.
        shadow: whether it casts shadows; None to go by whether a table of them comes with the calibration.

    Raises:
        WrongUse: an unknown make, or numbers that are missing or contradict each other.
        CalibrationRefused: a calibration that is missing, damaged or of another camera.
    """
    known = None
    if make is not None or calibration is None:
        known = described_sensor(DEFAULT_MAKE if make is None else make)
    pack = _pack(known, calibration, pitch, background)
    sensor = _sensor(known, pack.calibration, pitch, thickness)
    if shadow and pack.shadow is None:
        raise WrongUse(
            "--shadow needs a table of shadows: a calibration whose presses showed some, or "
            f"{SHADOWS[0]} beside {TABLE} in --calibration FOLDER"
        )
    table = None if shadow is False else pack.shadow
    return Gel(replace(sensor, casts_shadow=table is not None), pack.calibration, pack.rest, table)


def sensor_like(calibration: TactileCalibration) -> TactileSensor | None:
    """The shipped sensor of a calibration's pixels and pitch; None where there is none."""
    for name in shipped_sensors():
        sensor, pitch = described_sensor(name).sensor, calibration.header.pitch
        same_shape = (sensor.rows, sensor.columns) == (calibration.rows, calibration.columns)
        if same_shape and abs(sensor.pitch / pitch - 1.0) <= _SAME_PITCH:
            return sensor
    return None


def _pack(
    make: SensorDescription | None, calibration: str | None, pitch: float | None, background: ByteArray | None
) -> PublishedPack:
    if calibration is not None and is_published(Path(calibration)):
        stated = pitch if make is None else (pitch or make.sensor.pitch)
        if stated is None:
            raise WrongUse(
                f"{calibration} does not say how large a pixel is; say --pitch 0.0295mm, or the make with "
                "--sensor"
            )
        return read_published(Path(calibration), stated, background)
    if calibration is None:
        assert make is not None
        if make.calibration is None:
            raise WrongUse(
                f"no calibration comes with {make.sensor.name}; give one with --calibration FILE_OR_FOLDER, "
                f'or name it in the sensor\'s file, calibration = "FILE.npz". For one, '
                f"{how_to_calibrate(make.sensor)}"
            )
        own = named_calibration(make.calibration)
    else:
        path = Path(calibration)
        if path.is_dir():
            raise CalibrationRefused(
                f"{path} has no {TABLE}; a published calibration is a folder that has one"
            )
        own = named_calibration(calibration)
    if background is None:
        return PublishedPack(own, None, shadow_of(own))
    if background.shape != own.background.shape:
        raise CalibrationRefused(
            f"the background is {background.shape[0]} x {background.shape[1]} pixels and the calibration "
            f"{own.rows} x {own.columns}; give the camera's own picture, not cropped"
        )
    square = made_square(background, aspect_stated(own.header.made_from))
    return PublishedPack(with_background(own, square), None, shadow_of(own))


def _sensor(
    make: SensorDescription | None,
    calibration: TactileCalibration,
    pitch: float | None,
    thickness: float | None,
) -> TactileSensor:
    found = calibration.header.pitch
    if pitch is not None and abs(pitch / found - 1.0) > _SAME_PITCH:
        raise WrongUse(
            f"--pitch {pitch * 1e3:g} mm contradicts the calibration, which was made at {found * 1e3:g} mm; "
            "leave --pitch out"
        )
    sensor = sensor_like(calibration) if make is None else make.sensor
    if sensor is None:
        if thickness is None:
            raise WrongUse(
                f"no known sensor has {calibration.rows} x {calibration.columns} pixels of {found * 1e3:g} "
                "mm; say how thick the gel is, --thickness 2.5mm"
            )
        name = calibration.header.sensor
        return TactileSensor(name, calibration.rows, calibration.columns, found, thickness)
    if abs(sensor.pitch / found - 1.0) > _SAME_PITCH:
        raise WrongUse(
            f"{sensor.name} has pixels of {sensor.pitch * 1e3:g} mm and the calibration was made at "
            f"{found * 1e3:g} mm; give the sensor's own, or leave --sensor out"
        )
    return sensor if thickness is None else replace(sensor, gel_thickness=thickness)


def require_own(calibration: TactileCalibration, sensor: TactileSensor) -> None:
    """``DataRefused`` for a calibration of a camera of another size."""
    if (calibration.rows, calibration.columns) != (sensor.rows, sensor.columns):
        raise DataRefused(
            f"the calibration is of {calibration.rows} x {calibration.columns} pixels and {sensor.name} has "
            f"{sensor.rows} x {sensor.columns}; give the sensor's own calibration: {how_to_calibrate(sensor)}"
        )


def how_to_calibrate(sensor: TactileSensor) -> str:
    """Return the command that calibrates a sensor without a calibration."""
    return (
        f"press a ball all over it and say `touchstone calibrate taxim PRESSES/ --ball-radius 2mm --pitch "
        f"{1e3 * sensor.pitch:g}mm`, which writes one of {sensor.rows} x {sensor.columns} pixels"
    )
