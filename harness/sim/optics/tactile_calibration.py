"""The calibration artefact of a tactile camera: one ``.npz`` without pickles, hashed and dated."""

import hashlib
import json
from collections.abc import Set
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.basics.npz_file import read_arrays, write_arrays
from harness.sim.gel.gel import GelSkirt

SCHEMA = 1
CHANNEL_ORDER = "RGB"
NORMAL_DEGREE = 5
POSITION_DEGREE = 2
TABLE_TERMS = 6

Float32Array = npt.NDArray[np.float32]

_MISFIT = "misfit"
"""Key of the header, absent in files of calibrations whose misfit was not measured."""

_SHIPPED = Path(__file__).parent / "data"


@dataclass(frozen=True)
class ColourMisfit:
    """Colour error of a calibration on presses that it was not fitted to, without the camera's noise."""

    rms: float  #: grey levels, of one channel.
    alike: float  #: sine of the slope over which it is alike (a Gaussian's sigma).

    def __post_init__(self) -> None:
        if not (0.0 <= self.rms < np.inf and 0.0 < self.alike <= 1.0):
            raise CalibrationRefused(
                f"a misfit of {self.rms} grey levels over a sine of {self.alike} cannot be: 0 or more, "
                "and above 0 up to 1, are wanted; fit the calibration again"
            )


@dataclass(frozen=True)
class CalibrationHeader:
    """What a calibration says of itself."""

    sensor: str  #: make.
    serial: str  #: of the very sensor.
    date: str  #: ISO 8601, of the fit.
    made_from: str  #: the presses it was fitted to.
    licence: str  #: of those presses.
    pitch: float  #: metres a pixel.
    ball_radius: float  #: metres, of the ball that was pressed.
    slope_limit: float  #: sine of the steepest slope supported by the presses; steeper ones read as this.
    held_out_db: float  #: median PSNR in decibels over presses left out of the fit, smooth model.
    held_out_table_db: float  #: the same, table.
    residual_rms: float  #: grey levels, of the smooth model over the presses.
    condition: float  #: of the normalised least-squares problem.
    skirt: GelSkirt = field(default_factory=GelSkirt)  #: of the gel.
    misfit: ColourMisfit | None = None  #: on presses left out of the fit; None where it was not measured.
    schema: int = SCHEMA  #: of the file.
    channel_order: str = CHANNEL_ORDER  #: of every image and coefficient.


@dataclass(frozen=True, eq=False)
class TactileCalibration:
    """How a gel's slope becomes colour.

    Slope magnitude m in [0, pi/2) and direction d in (-pi, pi] of the gel surface, its height
    growing towards the camera, index the table (Si and Yuan, Taxim, 2022, section III):
    row ``floor(m / (pi/2 / (bins - 1)))``, column ``floor((d + pi) / (2 pi / (bins - 1)))``.
    """

    header: CalibrationHeader  #: provenance and quality.
    background: ByteArray  #: ``(rows, columns, 3)`` what the camera sees of the untouched gel.
    table: Float32Array  #: ``(bins, bins, 6, 3)`` grey levels per (x^2, y^2, xy, x, y, 1), x and y in pixels.
    support: BoolArray  #: ``(bins, bins)`` whether presses reached the bin.
    smooth: FloatArray
    """``(20 * 6, 3)`` coefficients of the polynomial of ``harness.sim.optics.shading``; ``(0, 3)`` where only
    a table is known."""

    def __post_init__(self) -> None:
        header, bins = self.header, len(self.table)
        wanted: list[tuple[str, AnyArray, tuple[int, ...], str]] = [
            ("background", self.background, (self.rows, self.columns, 3), "uint8"),
            ("table", self.table, (bins, bins, TABLE_TERMS, 3), "float32"),
            ("support", self.support, (bins, bins), "bool"),
            ("smooth", self.smooth, (len(self.smooth), 3), "float64"),
        ]
        for name, array, shape, kind in wanted:
            if array.shape != shape or array.dtype.name != kind:
                raise CalibrationRefused(
                    f"{name} is {array.dtype} {array.shape}; a calibration holds {kind} {shape}"
                )
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise CalibrationRefused(
                    f"{name} holds numbers that are not finite; fit the calibration again"
                )
        if len(self.smooth) not in (0, smooth_terms()):
            raise CalibrationRefused(
                f"smooth has {len(self.smooth)} terms; there are {smooth_terms()}, or none"
            )
        if header.channel_order != CHANNEL_ORDER:
            raise CalibrationRefused(f"channel order {header.channel_order!r} was declared; only RGB is read")
        if not (header.pitch > 0.0 and 0.0 < header.slope_limit <= 1.0):
            raise CalibrationRefused(f"pitch {header.pitch} m and slope limit {header.slope_limit} cannot be")
        for name, array in self.arrays.items():
            object.__setattr__(self, name, read_only(np.ascontiguousarray(array)))

    @property
    def arrays(self) -> dict[str, AnyArray]:
        """Every array by its name in the file."""
        return {
            "background": self.background,
            "table": self.table,
            "support": self.support,
            "smooth": self.smooth,
        }

    @property
    def rows(self) -> int:
        """Pixels."""
        return int(self.background.shape[0])

    @property
    def columns(self) -> int:
        """Pixels."""
        return int(self.background.shape[1])

    @property
    def bins(self) -> int:
        """Rows and columns of the table."""
        return int(self.table.shape[0])

    @cached_property
    def sha256(self) -> str:
        """Hash of header and arrays: the identity of this calibration in a recording."""
        digest = hashlib.sha256(json.dumps(_written(self.header), sort_keys=True).encode())
        for name, array in sorted(self.arrays.items()):
            digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
            digest.update(array.tobytes())
        return digest.hexdigest()


C = TypeVar("C", bound=TactileCalibration)


def shipped_calibration(name: str) -> TactileCalibration:
    """A calibration that comes with the package.

    Args:
        name: ``"gelsight_r15_bench"`` or ``"gelsight_r15_world"``: one sensor, disjoint presses.

    Raises:
        CalibrationRefused: no such name.
    """
    names = sorted(path.stem for path in _SHIPPED.glob("*.npz"))
    if name not in names:
        raise CalibrationRefused(f"no shipped calibration {name!r}; there are {', '.join(names)}")
    return load_calibration(_SHIPPED / f"{name}.npz")


def save_calibration(calibration: TactileCalibration, path: Path) -> None:
    """Write a calibration; the same one gives the same bytes.

    Args:
        calibration: what to write.
        path: ending in ``.npz``.
    """
    text = json.dumps({"header": _written(calibration.header), "sha256": calibration.sha256}, sort_keys=True)
    write_arrays(path, {"header": np.array(text), **calibration.arrays}, compressed=True)


def load_calibration(path: Path) -> TactileCalibration:
    """Read a calibration, strictly.

    Raises:
        CalibrationRefused: missing, of another schema, incomplete, or not what was written.
    """
    return calibration_of_arrays(arrays_of_file(path), path, TactileCalibration)


def arrays_of_file(path: Path) -> dict[str, AnyArray]:
    """What a calibration's file holds, by name; ``CalibrationRefused`` where it is none."""
    return read_arrays(path, "a calibration", advice="; give what touchstone calibrate taxim wrote")


def calibration_of_arrays(
    found: dict[str, AnyArray], path: Path, kind: type[C], own: Set[str] = frozenset()
) -> C:
    """A calibration from what its file holds, strictly.

    Args:
        found: by name, the header among them.
        path: of the file, for people.
        kind: of calibration.
        own: arrays that this kind has beside every calibration's.

    Raises:
        CalibrationRefused: of another schema, incomplete, or not what was written.
    """
    wanted = {"header", "background", "table", "support", "smooth", *own}
    if set(found) != wanted:
        raise CalibrationRefused(f"{path} holds {sorted(found)} where a calibration holds {sorted(wanted)}")
    header, sha256 = _parse(str(found["header"]), path)
    arrays: dict[str, Any] = {name: array for name, array in found.items() if name != "header"}
    calibration = kind(header, **arrays)
    if calibration.sha256 != sha256:
        raise CalibrationRefused(
            f"{path} is not what was written: its contents hash to {calibration.sha256[:12]}"
        )
    return calibration


def with_background(calibration: TactileCalibration, background: ByteArray) -> TactileCalibration:
    """The same colours over another picture of the untouched gel, ``(rows, columns, 3)`` RGB."""
    return replace(calibration, background=background)


def _written(header: CalibrationHeader) -> dict[str, Any]:
    """The header as its file has it: what was not measured is left out, so that its hash is as it was."""
    return {name: value for name, value in asdict(header).items() if name != _MISFIT or value is not None}


def _parse(text: str, path: Path) -> tuple[CalibrationHeader, str]:
    try:
        outer = json.loads(text)
        inner = dict(outer["header"])
        if inner["schema"] != SCHEMA:
            raise CalibrationRefused(
                f"{path} has schema {inner['schema']}; this version reads {SCHEMA}: fit it again"
            )
        if set(inner) | {_MISFIT} != {item.name for item in fields(CalibrationHeader)}:
            raise CalibrationRefused(f"{path} has header keys {sorted(inner)}; fit it again")
        skirt = inner.pop("skirt")
        inner["skirt"] = GelSkirt(tuple(skirt["kernels"]), skirt["final"], skirt["core"])
        if _MISFIT in inner:
            inner[_MISFIT] = ColourMisfit(**inner[_MISFIT])
        return CalibrationHeader(**inner), str(outer["sha256"])
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise CalibrationRefused(f"{path} has no readable header; fit the calibration again") from error


def smooth_terms() -> int:
    """How many coefficients a channel of the smooth model has."""
    normals = (NORMAL_DEGREE + 1) * (NORMAL_DEGREE + 2) // 2 - 1
    return normals * (POSITION_DEGREE + 1) * (POSITION_DEGREE + 2) // 2
