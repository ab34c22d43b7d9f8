"""Pictures whose pixels are not square, made square.

A camera that looks at the gel from the side, or a driver that scales a frame, shows other lengths of gel from
row to row than from column to column. Everything here draws, fits and measures in square pixels. So such
pictures are made square first, once, by the same function wherever they come from: presses of a calibration
and live pictures alike. A calibration says in ``made_from`` by how much its presses were.
"""

import re

import numpy as np
from scipy.ndimage import affine_transform

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain

LEAST_ASPECT, MOST_ASPECT = 0.5, 2.0
"""Of a pixel's height over its width: beyond, rows or columns would be made up of too few."""


MADE_SQUARE = "made square by"
"""What a calibration's ``made_from`` says before its presses' aspect, where pixels were not square."""


def aspect_stated(made_from: str) -> float:
    """Read a pixel's height over its width from ``made_from`` of a calibration's header, by default 1.

    Live pictures of that sensor are resampled to square pixels with it.

    Raises:
        OutOfDomain: an aspect that is none of a camera.
    """
    found = re.search(rf"{MADE_SQUARE} ([0-9.]+)", made_from)
    if found is None:
        return 1.0
    aspect = float(found.group(1))
    check_aspect(aspect)
    return aspect


def made_square(pictures: ByteArray, aspect: float) -> ByteArray:
    """Pictures as a camera of square pixels with the same area would take them, about the same middle.

    Cubic splines; as many rows and columns as before. Along one axis the picture then reaches past what was
    seen, by ``|sqrt(aspect) - 1| / 2`` of its length to either side: there its border is repeated.

    Args:
        pictures: ``(..., rows, columns, 3)`` grey levels.
        aspect: a pixel's height over its width; 1 hands the pictures back to the bit, its inverse undoes it.

    Raises:
        OutOfDomain: an aspect that is none of a camera.
    """
    check_aspect(aspect)
    if aspect == 1.0:
        return pictures
    rows, columns = pictures.shape[-3:-1]
    step: FloatArray = np.array([1.0 / np.sqrt(aspect), np.sqrt(aspect)])
    first: FloatArray = 0.5 * (np.array([rows, columns]) - 1.0) * (1.0 - step)
    made = np.empty(pictures.shape, dtype=np.uint8)
    for at in np.ndindex(pictures.shape[:-3]):
        for channel in range(pictures.shape[-1]):
            seen = pictures[(*at, ..., channel)].astype(np.float64)
            drawn = affine_transform(seen, step, first, order=3, mode="nearest")
            made[(*at, ..., channel)] = np.clip(np.round(drawn), 0.0, 255.0)
    return read_only(made)


def square_places(places: FloatArray, rows: int, columns: int, aspect: float) -> FloatArray:
    """Where pixels ``(..., 2)`` (column, row) of a picture lie once it is made square."""
    check_aspect(aspect)
    middle = 0.5 * np.array([columns - 1.0, rows - 1.0])
    moved: FloatArray = middle + (places - middle) * np.array([1.0 / np.sqrt(aspect), np.sqrt(aspect)])
    return moved


def check_aspect(aspect: float) -> None:
    """Refuse what is no aspect of a pixel: ``OutOfDomain``."""
    if not LEAST_ASPECT <= aspect <= MOST_ASPECT:
        raise OutOfDomain(
            f"pixels {aspect:g} times as high as wide; {LEAST_ASPECT:g} to {MOST_ASPECT:g} is taken: give "
            "the height over the width, or set the camera to its own resolution"
        )
