"""A height map out of a file: checked for what it could not be before anything is drawn from it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain
from harness.basics.files.named_file import require_file
from harness.basics.npz_file import read_array
from harness.bench.sensor import TactileSensor

Heights = Literal["object", "gel"]
"""What a map is of: how deep the object reaches, or the surface of the gel around it."""

MOST_BEYOND = 4.0
"""Thicknesses of the gel; a map that claims more is in another unit than metres."""

_UNITS = (("millimetres", 1e-3), ("micrometres", 1e-6))

_NO_HEIGHT = 1e6
"""As large as no height in any unit is: what some programs write where a ray met nothing."""


@dataclass(frozen=True, eq=False)
class GivenHeights:
    """A height map, and where there was none."""

    heights: FloatArray  #: ``(rows, columns)`` metres, finite.
    missing: BoolArray
    """``(rows, columns)`` where no height came: of an object 0 stands there, and the gel's skirt hangs over
    it as over anything that does not reach it; a gel is spanned from its edge inwards."""


def read_heights(path: Path, sensor: TactileSensor, of: Heights = "object") -> GivenHeights:
    """Read a height map of metres of indentation, positive into the gel.

    Of an ``"object"`` map zero and less is where nothing reaches the gel. A ``"gel"`` map may be
    a little below zero where the gel bulges. NaN, infinities and numbers that no height can be (a million
    and more; of an object only upwards) are where no height came.

    Args:
        path: a ``.npy`` file.
        sensor: gives shape, pitch and thickness.
        of: what the map is of.

    Raises:
        WrongUse: there is no such file.
        DataRefused: the file does not read, or holds something else than numbers.
        OutOfDomain: another shape, no height at all, or heights in another unit or of another sign.
    """
    require_file(path, "height map")
    if path.suffix != ".npy":
        raise DataRefused(f"{path}: a height map is read from a .npy file; write it with numpy.save")
    found = read_array(path, "a height map")
    if found.dtype.kind != "f":
        raise DataRefused(
            f"{path} holds {found.dtype}; a height map holds floating-point metres. Is it a picture of one?"
        )
    return given_heights(np.ascontiguousarray(found, dtype=np.float64), sensor, of, path.name)


def given_heights(heights: FloatArray, sensor: TactileSensor, of: Heights, name: str) -> GivenHeights:
    """A height map with what is missing in it masked and filled; ``name`` is what errors call it.

    Raises:
        OutOfDomain: as ``read_heights``.
    """
    wanted = (sensor.rows, sensor.columns)
    if heights.shape != wanted:
        hint = "; transpose it" if heights.shape == wanted[::-1] else ""
        if heights.ndim == 3 and heights.shape[1:] == wanted:
            hint = "; write one contact of the batch"
        raise OutOfDomain(
            f"{name} is {heights.shape}; a height map of {sensor.name} has (rows, columns) = {wanted}{hint}"
        )
    missing = ~np.isfinite(heights) | (heights >= _NO_HEIGHT)
    if of == "gel":
        missing |= heights <= -_NO_HEIGHT
    if missing.all():
        raise OutOfDomain(
            f"{name}: none of its {heights.size} heights is a number of metres, the first is "
            f"{heights[0, 0]}; is it the map of a press at all? Write 0 where the gel is not reached"
        )
    _check_unit(heights[~missing], sensor, of, name)
    if of == "gel" and heights[~missing].any() and heights[~missing].max() <= 0.0:
        raise OutOfDomain(
            f"{name}: no height is above zero and the least is {heights[~missing].min() * 1e3:.3g} mm; "
            "indentation is positive into the gel: turn the sign, and subtract the untouched gel's own height"
        )
    known = np.where(missing, 0.0, heights)
    filled = spanned(known, missing) if of == "gel" and missing.any() else known
    return GivenHeights(read_only(filled), read_only(missing))


def spanned(heights: FloatArray, missing: BoolArray) -> FloatArray:
    """A surface with its holes spanned as by a membrane: Laplace's equation, the picture's border free.

    No height between those known at a hole's edge is left, and no wall stands there.

    Args:
        heights: ``(rows, columns)``; what stands where they are missing does not matter.
        missing: ``(rows, columns)``, not everywhere.
    """
    size, which = heights.size, np.flatnonzero(missing)
    place = np.arange(size).reshape(heights.shape)
    pairs = [(place[1:], place[:-1]), (place[:, 1:], place[:, :-1])]
    one, other = (np.concatenate([pair[k].ravel() for pair in pairs]) for k in (0, 1))
    beside = sparse.coo_array((np.ones(len(one)), (one, other)), shape=(size, size)).tocsr()
    beside = (beside + beside.T)[which]
    known = np.where(missing, 0.0, heights).ravel()
    pull = sparse.diags_array(np.asarray(beside.sum(axis=1)).ravel()) - beside[:, which]
    filled = known.copy()
    filled[which] = spsolve(pull.tocsc(), beside @ known)
    return filled.reshape(heights.shape)


def _check_unit(heights: FloatArray, sensor: TactileSensor, of: Heights, name: str) -> None:
    thick = sensor.gel_thickness
    # An object may stand far clear of the gel, and reach farther than the gel is thick.
    most = float(np.abs(heights).max()) if of == "gel" else float(heights.max())
    limit = thick if of == "gel" else MOST_BEYOND * thick
    if most <= limit:
        return
    scales = [*_UNITS, (f"pixels of {sensor.pitch * 1e3:g} mm", sensor.pitch)]
    span = float(heights.max() - heights.min())
    fits = [
        f"{unit} (times {scale:g})"
        for unit, scale in scales
        if (0.01 * thick <= span * scale <= thick and (most * scale <= thick or span < 0.5 * most))
    ]
    like = f"; the numbers look like {' or '.join(fits)}" if fits else ""
    raise OutOfDomain(
        f"{name}: heights reach {most:.4g} m and the gel is {thick * 1e3:g} mm thick{like}; write metres of "
        "indentation"
    )
