"""A calibration that also knows what a press does to the light, whatever the slope.

Beside what every calibration holds it has a second smooth model, of the surface's normal *and* of how far
the gel was pushed in:

    dI = slopes(normal, position) + height * light(normal, position)

with the terms of ``harness.sim.optics.shading`` for the slopes, and for the light a constant and the
normal's terms to degree 2, by the same terms of the position. It is zero where the gel is untouched, and
fitted to the skirt of the presses too (``calibration.taxim.light_fit``): pushed in, the gel is nearer to the
lights' plane, and darker even where it is flat; they graze it, and one side of a bump is in the other's way.
Without it the file is one of ``harness.sim.optics.tactile_calibration``. Presses that showed shadows besides
give a ``ShadowedCalibration``: the same with a table of them.
"""

from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import CalibrationRefused
from harness.basics.files.named_file import require_file
from harness.sim.optics.shading import POSITION_TERMS
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import (
    POSITION_DEGREE,
    Float32Array,
    TactileCalibration,
    arrays_of_file,
    calibration_of_arrays,
    shipped_calibration,
    smooth_terms,
)

LIT = "lit"
"""Of the array in the file."""

SHADOW = ("shadow_directions", "shadow_lengths", "shadow_values", "shadow_rays")
"""Of the arrays of a shadow in the file."""

UNCERTAINTY = "uncertainty"
"""Of the array in the file."""

LIGHT_DEGREE = 2
LIGHT_POWERS = tuple((a, b) for a in range(LIGHT_DEGREE + 1) for b in range(LIGHT_DEGREE + 1 - a))
"""Of the normal's x and y, in the light's terms; the first is the constant one."""


@dataclass(frozen=True, eq=False)
class LitCalibration(TactileCalibration):
    """A calibration with the light of a press."""

    lit: FloatArray
    """``(156, 3)``: 120 coefficients of slopes as in ``smooth``, then six of the position for each of
    ``LIGHT_POWERS``, in grey levels a metre of indentation."""
    uncertainty: Float32Array = field(default_factory=lambda: np.empty((0, 0, 3), np.float32), kw_only=True)
    """``(bins, bins, 3)`` grey levels, the standard error of each colour of ``table``
    (``calibration.taxim.table``); ``(0, 0, 3)`` in files that do not say it."""

    def __post_init__(self) -> None:
        errors, bins = self.uncertainty, self.bins
        fits = errors.shape in ((bins, bins, 3), (0, 0, 3)) and errors.dtype == np.float32
        if not fits or not np.isfinite(errors).all() or (errors < 0.0).any():
            raise CalibrationRefused(
                f"uncertainty is {errors.dtype} {errors.shape}, below zero or not finite; finite float32 "
                f"{(bins, bins, 3)} of 0 or more are wanted: fit the calibration again"
            )
        wanted = (smooth_terms() + len(LIGHT_POWERS) * POSITION_TERMS, 3)
        found = self.lit
        if found.shape != wanted or found.dtype != np.float64 or not np.isfinite(found).all():
            raise CalibrationRefused(
                f"lit is {found.dtype} {found.shape}, or not finite; finite float64 {wanted} is wanted: "
                "fit the calibration again"
            )
        super().__post_init__()

    @property
    def arrays(self) -> dict[str, AnyArray]:
        """Every array by its name in the file."""
        said = {UNCERTAINTY: self.uncertainty} if self.uncertainty.size else {}
        return {**super().arrays, LIT: self.lit, **said}

    @property
    def slopes(self) -> FloatArray:
        """``(120, 3)`` the coefficients of the slopes."""
        return self.lit[: smooth_terms()]

    @property
    def light(self) -> FloatArray:
        """``(36, 3)`` the coefficients of the light, grey levels a metre of indentation."""
        return self.lit[smooth_terms() :]


@dataclass(frozen=True, eq=False)
class ShadowedCalibration(LitCalibration):
    """A calibration with the light of a press and the shadows that presses throw."""

    shadow_directions: FloatArray
    """``(d,)`` rad; this and the next two as ``harness.sim.optics.shadow.ShadowTable`` has them."""
    shadow_lengths: IntArray  #: ``(3, d, k)``.
    shadow_values: FloatArray  #: grey levels.
    shadow_rays: FloatArray
    """``(6,)`` metres where the first row of depths begins; metres from row to row; pixels from sample to
    sample; rad of a fan to either side, and between its rays; metres, the depth of the rims that were seen,
    which rows of other depths are derived from."""

    def __post_init__(self) -> None:
        if self.shadow_rays.shape != (6,) or not (np.isfinite(self.shadow_rays).all()):
            raise CalibrationRefused(
                f"shadow_rays is {self.shadow_rays.shape}, or not finite; six finite numbers are wanted: fit "
                "the calibration again"
            )
        super().__post_init__()
        # A table that does not hold together is refused here, not when it is first drawn with.
        _ = self.shadow

    @property
    def arrays(self) -> dict[str, AnyArray]:
        """Every array by its name in the file."""
        shadow: dict[str, AnyArray] = {
            "shadow_directions": self.shadow_directions,
            "shadow_lengths": self.shadow_lengths,
            "shadow_values": self.shadow_values,
            "shadow_rays": self.shadow_rays,
        }
        return {**super().arrays, **shadow}

    @property
    def shadow(self) -> ShadowTable:
        """The shadows as simulators throw them; ``CalibrationRefused`` where they do not hold together."""
        lists = (self.shadow_directions, self.shadow_lengths, self.shadow_values)
        return ShadowTable(*lists, *(float(value) for value in self.shadow_rays[:5]))


def with_shadow(calibration: LitCalibration, table: ShadowTable, seen: float) -> ShadowedCalibration:
    """The same calibration with the shadows of rims of ``seen`` metres."""
    rays = (table.shallowest, table.depth_step, table.sample_step, table.fan, table.fan_step, seen)
    parts = {item.name: vars(calibration)[item.name] for item in fields(LitCalibration)}
    return ShadowedCalibration(
        **parts,
        shadow_directions=table.directions,
        shadow_lengths=table.lengths,
        shadow_values=table.values,
        shadow_rays=np.array(rays),
    )


def shadow_of(calibration: TactileCalibration) -> ShadowTable | None:
    """The shadows of a calibration; None where it has none."""
    return calibration.shadow if isinstance(calibration, ShadowedCalibration) else None


def place_terms(where: FloatArray) -> FloatArray:
    """``(n, 6)`` the powers of ``(n, 2)`` scaled positions, in the order of ``sim.optics.shading``."""
    u, v = (np.vander(where[:, k], POSITION_DEGREE + 1, increasing=True) for k in range(2))
    places = [(c, d) for c in range(POSITION_DEGREE + 1) for d in range(POSITION_DEGREE + 1 - c)]
    return np.stack([u[:, c] * v[:, d] for c, d in places], axis=1)


def named_calibration(named: str) -> TactileCalibration:
    """A calibration by its path, or by the name of one that comes with the package.

    Raises:
        WrongUse: there is no such file.
        CalibrationRefused: no such name, or as ``read_calibration``.
    """
    path = Path(named)
    return read_calibration(path) if path.exists() or path.suffix else shipped_calibration(named)


def read_calibration(path: Path) -> TactileCalibration:
    """Read a calibration, with its light where it has one; strictly.

    Raises:
        WrongUse: there is no such file.
        CalibrationRefused: of another schema, incomplete, or not what was written.
    """
    require_file(path, "calibration", "give the file that touchstone calibrate taxim wrote")
    found = arrays_of_file(path)
    if LIT not in found:
        return calibration_of_arrays(found, path, TactileCalibration)
    # Files of before it was measured do not say their uncertainty.
    own = {LIT} | {UNCERTAINTY} & set(found)
    if set(SHADOW).isdisjoint(found):
        return calibration_of_arrays(found, path, LitCalibration, own)
    return calibration_of_arrays(found, path, ShadowedCalibration, own | set(SHADOW))
