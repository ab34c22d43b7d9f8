"""Calibrations as Taxim and ObjectFolder publish them: a folder of ``.npz`` files, read as one of ours.

``polycalib.npz`` holds the colour table, ``dataPack.npz`` the untouched gel's picture, ``shadowTable.npz``
the shadows, ``gelmap*.npy`` (Taxim) or ``depth_bg.npy`` (ObjectFolder) the untouched gel's surface. All but
the table may be missing. Their channels are named r, g, b and hold what ``cv2.imread`` gave, blue first; they
are turned to RGB here and nowhere else.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.basics.npz_file import read_array, read_arrays
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import R15_SKIRT, TAXIM_SKIRT, skirt_for
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.shadow_file import read_shadow_table
from harness.sim.optics.tactile_calibration import TABLE_TERMS, CalibrationHeader, TactileCalibration

TABLE = "polycalib.npz"
PRESSES = "dataPack.npz"
SHADOWS = ("shadowTable.npz", "shadowTable_plain.npz")

_TAXIM_PITCH = 0.0295e-3
_TAXIM_ROWS = 480
_SURFACE_BLUR = 5


@dataclass(frozen=True, eq=False)
class PublishedPack:
    """A published calibration."""

    calibration: TactileCalibration
    """the table over the untouched gel's picture. It claims nothing of its quality: 0 dB held out, an
    unbounded residual, every bin supported, no steepest slope."""
    rest: FloatArray | None
    """``(rows, columns)`` metres, the untouched gel's surface towards the camera; None for a flat one."""
    shadow: ShadowTable | None  #: of pins pressed into the gel; None where there is none.


def is_published(path: Path) -> bool:
    """Whether a path is a folder with a published colour table, or that table itself."""
    return (path / TABLE).is_file() or (path.name == TABLE and path.is_file())


def read_published(path: Path, pitch: float, background: ByteArray | None = None) -> PublishedPack:
    """Read a published calibration.

    Args:
        path: its folder, or ``polycalib.npz`` in it.
        pitch: metres a pixel, which the files do not hold.
        background: ``(rows, columns, 3)`` RGB of the untouched gel, in place of the one in ``dataPack.npz``.

    Raises:
        CalibrationRefused: a file that is missing, incomplete or of another camera.
    """
    folder = path if path.is_dir() else path.parent
    if not (np.isfinite(pitch) and pitch > 0.0):
        raise CalibrationRefused(f"a pitch of {pitch!r} m a pixel cannot be; give the sensor's own")
    table = read_table(folder / TABLE)
    seen = _background(folder) if background is None else background
    rows, columns = seen.shape[:2]
    sensor = TactileSensor("published", rows, columns, pitch, gel_thickness=np.inf)
    if rows >= _TAXIM_ROWS:
        skirt = skirt_for(sensor, TAXIM_SKIRT, _TAXIM_PITCH)
    else:
        skirt = skirt_for(sensor, R15_SKIRT)
    header = CalibrationHeader(
        sensor=folder.name,
        serial="published",
        date="",
        made_from=str(folder / TABLE),
        licence="see where it was published",
        pitch=pitch,
        ball_radius=0.0,
        slope_limit=1.0,
        held_out_db=0.0,
        held_out_table_db=0.0,
        residual_rms=float("inf"),
        condition=float("inf"),
        skirt=skirt,
    )
    bins = len(table)
    calibration = TactileCalibration(
        header, seen, table.astype(np.float32), np.ones((bins, bins), np.bool_), np.empty((0, 3))
    )
    shadow = next((folder / name for name in SHADOWS if (folder / name).is_file()), None)
    return PublishedPack(
        calibration,
        _rest(folder, rows, columns, pitch),
        None if shadow is None else read_shadow_table(shadow),
    )


def read_table(path: Path) -> FloatArray:
    """``(bins, bins, 6, 3)`` float64, RGB: the colour table of ``polycalib.npz``.

    Raises:
        CalibrationRefused: missing, incomplete, or numbers that are not finite.
    """
    found = read_arrays(path, "a published colour table", ("bins", "grad_r", "grad_g", "grad_b"))
    bins = int(found["bins"])
    parts = [found[f"grad_{named}"].astype(np.float64) for named in "bgr"]
    if any(part.shape != (bins, bins, TABLE_TERMS) for part in parts):
        shapes = ", ".join(str(part.shape) for part in parts)
        raise CalibrationRefused(
            f"{path}: tables of {shapes}; with {bins} bins each is {(bins, bins, TABLE_TERMS)}"
        )
    table = np.stack(parts, axis=-1)
    if not np.isfinite(table).all():
        raise CalibrationRefused(f"{path} holds numbers that are not finite; fit the calibration again")
    return table


def _background(folder: Path) -> ByteArray:
    path = folder / PRESSES
    if not path.is_file():
        raise CalibrationRefused(
            f"{folder} has no {PRESSES}, so nobody knows what the camera sees of the untouched gel; "
            "give such a picture with --background"
        )
    seen = read_arrays(path, "a pack of presses", ("f0",))["f0"]
    if seen.dtype != np.uint8 or seen.ndim != 3 or seen.shape[2] != 3:
        raise CalibrationRefused(f"{path}: f0 is {seen.dtype} {seen.shape}, not a colour picture of 8 bits")
    return read_only(np.ascontiguousarray(seen[..., ::-1]))


def _rest(folder: Path, rows: int, columns: int, pitch: float) -> FloatArray | None:
    """Both are in pixels. Taxim's grows away from the camera and is blurred first, ObjectFolder's towards."""
    maps = sorted(folder.glob("gelmap*.npy"))
    if maps:
        grown = _surface(maps[0], rows, columns)
        blurred = cv2.GaussianBlur(grown, (_SURFACE_BLUR, _SURFACE_BLUR), 0)
        return read_only(np.asarray(-blurred, dtype=np.float64) * pitch)
    if (folder / "depth_bg.npy").is_file():
        return read_only(_surface(folder / "depth_bg.npy", rows, columns) * pitch)
    return None


def _surface(path: Path, rows: int, columns: int) -> FloatArray:
    read = read_array(path, "a surface", CalibrationRefused)
    if read.dtype.kind not in "fiu":
        raise CalibrationRefused(f"{path} holds {read.dtype}, and a surface holds numbers")
    surface = read.astype(np.float64)
    if surface.shape != (rows, columns) or not np.isfinite(surface).all():
        raise CalibrationRefused(
            f"{path} is {surface.shape}, not finite or not the camera's {(rows, columns)}; remove it or give "
            "the right one"
        )
    checked: FloatArray = surface
    return checked
