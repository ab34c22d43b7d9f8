"""What the camera behind the gel sees: colour from slope, at three levels.

``exact`` is Taxim's table in double precision; ``fast`` the same table in single precision
with a polynomial for the arctangent (a pixel differs where its slope lies on the edge of a bin,
and then by the table's own step); ``smooth`` the polynomial of ``harness.sim.optics.shading``, without bins,
and with the light of a press where the calibration has it (``harness.sim.optics.lit_calibration``).
All of them add to the background the change against the untouched gel, so that no contact
gives the background bit for bit. All see the same surface, held to a grid far below any sensor's noise
(``harness.sim.optics.kernels.GRID``), so that rounding chooses no colour.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from harness.basics.arrays import AnyArray, ByteArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.sim.optics.kernels import (
    PADDED,
    change_exactly,
    change_fast,
    change_smoothly,
    draw_exactly,
    draw_fast,
    draw_smoothly,
    padded,
    to_pixels,
)
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration

OpticsLevel = Literal["exact", "fast", "smooth"]


@dataclass(frozen=True, eq=False)
class TactileImages:
    """Pictures and what they cannot show."""

    images: ByteArray  #: ``(n, rows, columns, 3)`` RGB.
    saturated: IntArray  #: ``(n,)`` values clipped to 0 or 255.
    extrapolated: IntArray
    """``(n,)`` pixels steeper than any press of the calibration, drawn as the steepest it knows."""


class Optics:
    """A calibration made ready to draw at one level; read-only and safe to share by threads.

    Args:
        calibration: of the sensor.
        level: how exactly.
        rest: ``(rows, columns)`` metres, the untouched gel's height towards the camera; flat if None.

    Raises:
        CalibrationRefused: ``smooth`` was asked of a calibration that has only a table.
        OutOfDomain: a rest surface of another shape, or not finite.
    """

    calibration: TactileCalibration
    level: OpticsLevel

    def __init__(
        self, calibration: TactileCalibration, level: OpticsLevel, rest: FloatArray | None = None
    ) -> None:
        shape = calibration.background.shape[:2]
        if level not in ("exact", "fast", "smooth"):
            raise OutOfDomain(f"no optics level {level!r}; there are exact, fast, smooth")
        if level == "smooth" and len(calibration.smooth) == 0:
            raise CalibrationRefused(
                "this calibration has no smooth model; ask for exact or fast, or fit it again"
            )
        if rest is not None and (rest.shape != shape or not np.isfinite(rest).all()):
            raise OutOfDomain(f"the rest surface is {rest.shape}, not finite or not the camera's {shape}")
        self.calibration = calibration
        self.level = level
        self._rest = np.zeros(shape) if rest is None else np.asarray(rest, dtype=np.float64)

    def render(self, indentation: FloatArray) -> TactileImages:
        """Pictures of pressed gels.

        Args:
            indentation: ``(n, rows, columns)`` metres of the gel's surface towards the camera,
                as ``gel.deform`` gives it.

        Raises:
            OutOfDomain: another shape than the camera's, or a height that is not finite.
        """
        shape = self.calibration.background.shape[:2]
        if indentation.ndim != 3 or indentation.shape[1:] != shape:
            raise OutOfDomain(
                f"heights are {indentation.shape}; this camera's are (n, {shape[0]}, {shape[1]})"
            )
        bad = ~np.isfinite(indentation).all(axis=(1, 2))
        if bad.any():
            raise OutOfDomain(
                f"the heights of contact {int(np.argmax(bad))} are not finite; there is no such gel"
            )
        images = np.empty((*indentation.shape, 3), np.uint8)
        counts = np.empty((len(indentation), 2), np.int64)
        for n, pressed in enumerate(indentation):
            counts[n] = self._draw(self._surface(pressed), images[n])
        return TactileImages(read_only(images), read_only(counts[:, 0]), read_only(counts[:, 1]))

    def _surface(self, pressed: FloatArray) -> FloatArray:
        surface = np.empty(self._rest.shape)
        to_pixels(self._rest, pressed, 1.0 / self.calibration.header.pitch, surface)
        return surface

    def _draw(self, z: FloatArray, image: ByteArray) -> tuple[int, int]:
        known = self.calibration
        if self.level == "exact":
            return draw_exactly(z, self._table, self._base, self._steepest, image)
        if self.level == "fast":
            return draw_fast(z, known.bins, self._padded, self._base_fast, self._steepest, image)
        light = known.light * known.header.pitch if isinstance(known, LitCalibration) else np.empty((0, 3))
        limit, pressed = known.header.slope_limit, z - self._untouched
        return draw_smoothly(z, pressed, self._slopes, light, self._base, limit, image)

    @property
    def _steepest(self) -> float:
        limit = self.calibration.header.slope_limit
        return limit / np.sqrt(1.0 - limit * limit) if limit < 1.0 else np.inf

    @cached_property
    def _table(self) -> FloatArray:
        return self.calibration.table.astype(np.float64)

    @cached_property
    def _padded(self) -> Float32Array:
        return padded(self.calibration.table)

    @property
    def _slopes(self) -> FloatArray:
        known = self.calibration
        return known.slopes if isinstance(known, LitCalibration) else known.smooth

    @cached_property
    def _untouched(self) -> FloatArray:
        return self._surface(np.zeros_like(self._rest))

    @cached_property
    def _base(self) -> FloatArray:
        # Background less what the untouched gel's own slope would add: no contact adds it back.
        change = np.empty(self.calibration.background.shape)
        z = self._untouched
        if self.level == "exact":
            change_exactly(z, self._table, change)
        else:
            change_smoothly(z, self._slopes, self.calibration.header.slope_limit, change)
        base: FloatArray = self.calibration.background - change
        return base

    @cached_property
    def _base_fast(self) -> Float32Array:
        rows, columns = self._rest.shape
        change = np.empty((rows, columns, PADDED), np.float32)
        change_fast(self._untouched, self.calibration.bins, self._padded, change)
        base = np.zeros_like(change)
        base[..., :3] = self.calibration.background - change[..., :3]
        return base


def with_camera_noise(images: AnyArray, sigma: float, seed: int) -> FloatArray:
    """Pictures with independent normal noise on every value.

    A picture's noise depends on the seed and its place in the batch, not on the size of the batch.

    Args:
        images: ``(n, rows, columns, 3)`` grey levels.
        sigma: grey levels, zero or more.
        seed: of the noise.

    Returns:
        The same shape, float64, not clipped.

    Raises:
        OutOfDomain: a sigma that is negative or not finite.
    """
    if not (np.isfinite(sigma) and sigma >= 0.0):
        raise OutOfDomain(f"camera noise of {sigma!r} grey levels; give a finite number, zero or more")
    noisy = np.array(images, dtype=np.float64)
    for index, image in enumerate(noisy):
        image += sigma * np.random.default_rng((seed, index)).standard_normal(image.shape)
    return noisy


def filled_share(surface: FloatArray, calibration: TactileCalibration) -> float | None:
    """Return the fraction of sloped pixels whose table bin no press reached, though others as steep did.

    Such bins hold what the fit's smooth model says (``calibration.taxim.table``). Pixels steeper than any
    press are another matter: they are drawn as the steepest, and ``TactileImages.extrapolated`` counts them.

    Args:
        surface: ``(rows, columns)`` metres towards the camera, the untouched gel's own shape included.
        calibration: whose ``support`` is asked.

    Returns:
        0 to 1; 0 where nothing slopes. None where the calibration does not say what was pressed.
    """
    if calibration.header.slope_limit >= 1.0:
        return None
    row, column = _bins(surface, calibration)
    return float(np.mean(~calibration.support[row, column])) if len(row) else 0.0


def colour_error(surface: FloatArray, calibration: TactileCalibration) -> float | None:
    """Grey levels by which the table's colours in a picture are uncertain: a standard error.

    It is what other presses of the same gel would have changed; how well the table's *form* fits a sensor is
    said by presses left out, ``held_out_table_db`` of the header.

    Args:
        surface: as ``filled_share``.
        calibration: whose ``uncertainty`` is asked.

    Returns:
        Root mean square over the sloped pixels that are no steeper than the presses, and over the channels; 0
        where nothing slopes. None where the calibration does not say.
    """
    if not (isinstance(calibration, LitCalibration) and calibration.uncertainty.size):
        return None
    row, column = _bins(surface, calibration)
    errors = calibration.uncertainty[row, column].astype(np.float64)
    return float(np.sqrt(np.mean(errors**2))) if len(row) else 0.0


def _bins(surface: FloatArray, calibration: TactileCalibration) -> tuple[IntArray, IntArray]:
    """Rows and columns of the table of the pixels that slope, none steeper than the steepest press."""
    limit, bins = calibration.header.slope_limit, calibration.bins
    inner = surface / calibration.header.pitch
    down = 0.5 * (inner[2:, 1:-1] - inner[:-2, 1:-1])
    right = 0.5 * (inner[1:-1, 2:] - inner[1:-1, :-2])
    steep = np.hypot(down, right)
    # A millionth of a pixel is rounding, as it is to the optics.
    sloped = steep > 2.0**-20
    if limit < 1.0:
        sloped &= steep <= limit / np.sqrt(1.0 - limit * limit)
    row = np.floor(np.arctan(steep[sloped]) / (0.5 * np.pi / (bins - 1))).astype(np.int64)
    turn = np.arctan2(down[sloped] + 0.0, right[sloped] + 0.0) + np.pi
    column = np.floor(turn / (2.0 * np.pi / (bins - 1))).astype(np.int64)
    return row, column
