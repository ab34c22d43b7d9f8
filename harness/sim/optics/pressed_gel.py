"""A gel that can be pressed: its sensor, and all that is known of it."""

from dataclasses import dataclass, replace

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.bench.sensor import TactileSensor
from harness.picture.square_pixels import aspect_stated
from harness.sim.gel.elastic import NOT_MEASURED, GelElastic
from harness.sim.gel.force_table import ForceTable
from harness.sim.gel.marker_file import MarkerFile
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import TactileCalibration


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


def require_own(calibration: TactileCalibration, sensor: TactileSensor) -> None:
    """``DataRefused`` for a calibration of a camera of another size."""
    if (calibration.rows, calibration.columns) != (sensor.rows, sensor.columns):
        raise DataRefused(
            f"the calibration is of {calibration.rows} x {calibration.columns} pixels and {sensor.name} has "
            f"{sensor.rows} x {sensor.columns}; give the sensor's own calibration: {how_to_calibrate(sensor)}"
        )


def how_to_calibrate(sensor: TactileSensor) -> str:
    """What to run for a calibration of a sensor that has none."""
    return (
        f"press a ball all over it and say `touchstone calibrate taxim PRESSES/ --ball-radius 2mm --pitch "
        f"{1e3 * sensor.pitch:g}mm`, which writes one of {sensor.rows} x {sensor.columns} pixels"
    )
