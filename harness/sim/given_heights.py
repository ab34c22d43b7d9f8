"""A height map out of a file: checked for what it could not be before anything is drawn from it."""

from pathlib import Path
from typing import Literal

import numpy as np

from harness.arrays import AnyArray, FloatArray, read_only
from harness.errors import DataRefused, OutOfDomain
from harness.sensor import TactileSensor

Heights = Literal["object", "gel"]
"""What a map is of: how deep the object reaches, or the surface of the gel around it."""

MOST_BEYOND = 4.0
"""Thicknesses of the gel; a map that claims more is in another unit than metres."""

_UNITS = (("millimetres", 1e-3), ("micrometres", 1e-6))


def read_heights(path: Path, sensor: TactileSensor, of: Heights = "object") -> FloatArray:
    """Read a height map of metres of indentation, positive into the gel.

    Of an ``"object"`` map zero and less is where nothing reaches the gel. A ``"gel"`` map may be
    a little below zero where the gel bulges.

    Args:
        path: a ``.npy`` file.
        sensor: gives shape, pitch and thickness.
        of: what the map is of.

    Returns:
        ``(rows, columns)`` metres, float64.

    Raises:
        DataRefused: the file does not read, or holds something else than numbers.
        OutOfDomain: another shape, heights that are not finite, in another unit or of another sign.
    """
    if path.suffix != ".npy":
        raise DataRefused(f"{path}: a height map is read from a .npy file; write it with numpy.save")
    try:
        found: AnyArray = np.load(path, allow_pickle=False)
    except (OSError, EOFError, ValueError) as error:
        raise DataRefused(f"{path} does not read as an array: {error}") from error
    if found.dtype.kind != "f":
        raise DataRefused(
            f"{path} holds {found.dtype}; a height map holds floating-point metres. Is it a picture of one?"
        )
    heights = np.ascontiguousarray(found, dtype=np.float64)
    check_heights(heights, sensor, of, path.name)
    return read_only(heights)


def check_heights(heights: FloatArray, sensor: TactileSensor, of: Heights, name: str) -> None:
    """Refuse a height map that cannot be one of this sensor.

    Raises:
        OutOfDomain: as ``read_heights``.
    """
    _check_shape(heights, sensor, name)
    bad = np.argwhere(~np.isfinite(heights))
    if len(bad):
        i, j = bad[0]
        raise OutOfDomain(
            f"{name}: {len(bad)} of {heights.size} heights are not finite, the first {heights[i, j]} at row "
            f"{i}, column {j}; write 0 where the gel is not reached"
        )
    _check_unit(heights, sensor, of, name)
    if of == "gel" and heights.any() and heights.max() <= 0.0:
        raise OutOfDomain(
            f"{name}: no height is above zero and the least is {heights.min() * 1e3:.3g} mm; indentation is "
            "positive into the gel: turn the sign, and subtract the untouched gel's own height"
        )


def _check_shape(heights: FloatArray, sensor: TactileSensor, name: str) -> None:
    wanted = (sensor.rows, sensor.columns)
    if heights.shape == wanted:
        return
    hint = "; transpose it" if heights.shape == wanted[::-1] else ""
    if heights.ndim == 3 and heights.shape[1:] == wanted:
        hint = "; write one contact of the batch"
    raise OutOfDomain(
        f"{name} is {heights.shape}; a height map of {sensor.name} has (rows, columns) = {wanted}{hint}"
    )


def _check_unit(heights: FloatArray, sensor: TactileSensor, of: Heights, name: str) -> None:
    thick = sensor.gel_thickness
    # An object may stand far clear of the gel, and reach farther than the gel is thick.
    most = float(np.abs(heights).max()) if of == "gel" else float(heights.max())
    limit = thick if of == "gel" else MOST_BEYOND * thick
    if most <= limit:
        return
    scales = [*_UNITS, (f"pixels of {sensor.pitch * 1e3:g} mm", sensor.pitch)]
    span = float(heights.max() - heights.min())
    fits = [f"{unit} (times {scale:g})" for unit, scale in scales if _fits(most, span, scale, thick)]
    like = f"; the numbers look like {' or '.join(fits)}" if fits else ""
    raise OutOfDomain(
        f"{name}: heights reach {most:.4g} m and the gel is {thick * 1e3:g} mm thick{like}; write metres of "
        "indentation"
    )


def _fits(most: float, span: float, scale: float, thick: float) -> bool:
    """Whether a map would be one in another unit, if only against a level of its own."""
    return 0.01 * thick <= span * scale <= thick and (most * scale <= thick or span < 0.5 * most)
