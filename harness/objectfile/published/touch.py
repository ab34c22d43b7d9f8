"""Touch of imported objects: maps of distance (version 2.0) and their pictures, or colours (1.0).

``TaximPicture`` is ObjectFolder 2.0's own use of Taxim, with its calibration. The published program takes
the pixel size of the real sensor and distances of a virtual camera with another one. Slopes are therefore
a quarter too steep near the axis, and the colours were fitted to these slopes.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.objectfile.published.entries import (
    Bounds,
    PublishedColoursEntry,
    PublishedDepthEntry,
    PublishedObject,
)
from harness.objectfile.published.query import coordinate_bounds, query, require_trained
from harness.sim.optics.kernels import change_exactly
from harness.sim.optics.published_pack import PRESSES, TABLE, read_published, read_table

TILT = math.radians(15.0)
"""rad: the greatest tilt of a press; with the depths and distances below it is in the published program
(``OF_render.py``) and not in its files."""

PRESS_DEPTH = (0.5e-3, 2.0e-3)
"""m: least and greatest depth of a press."""

SEEN_DEPTH = (33.9e-3, 40.0e-3)
"""m from camera to gel: what the network's 0 and 1 stand for."""

DEPTH_PIXELS = (120, 160)
"""Rows and columns of a map of 2.0."""

_SLACK = 1e-9
"""Fraction of the range by which an angle or a depth may exceed its limit."""


def touch_maps(
    of: PublishedObject, entry: PublishedDepthEntry, vertices: FloatArray, gel: FloatArray
) -> FloatArray:
    """Compute ``(n, rows, columns)`` distances in m from the gel's camera to its surface.

    Args:
        of: imported object.
        entry: its touch.
        vertices: ``(n, 3)`` m, where the gel is pressed on, in the mesh's frame.
        gel: ``(n, 3)``: tilt from the vertex's normal and its azimuth in rad, depth in m.

    Raises:
        OutOfDomain: a vertex, tilt or depth that the network was not trained at.
        DataRefused: a damaged network, or distances that are not finite.
    """
    least, most = entry.depth_m
    require_trained(vertices, entry.low_m, entry.high_m, "press", "m")
    require_trained(np.degrees(gel[:, :1]), 0.0, math.degrees(entry.most_tilt_rad), "tilt", "deg", _SLACK)
    require_trained(1e3 * gel[:, 2:], 1e3 * least, 1e3 * most, "depth", "mm", _SLACK)
    network = of.network(entry.network)
    maps = np.empty((len(vertices), entry.rows, entry.columns))
    for number, (vertex, (tilt, azimuth, depth)) in enumerate(zip(vertices, gel, strict=True)):
        pixels = np.empty((entry.rows, entry.columns, 9))
        pixels[..., :7] = (*vertex, tilt, math.cos(azimuth), math.sin(azimuth), depth)
        pixels[..., 7], pixels[..., 8] = np.arange(entry.rows)[:, None], np.arange(entry.columns)
        maps[number] = query(network, {"pixel": pixels.reshape(-1, 9)})["depth"].reshape(maps[number].shape)
    return read_only(maps)


def touch_images(
    of: PublishedObject, entry: PublishedColoursEntry, vertices: FloatArray, of_query: bool = False
) -> ByteArray:
    """Compute ``(n, rows, columns, 3)`` RGB of presses along the normal at ``(n, 3)`` vertices in metres.

    Args:
        of: imported object.
        entry: its touch.
        vertices: ``(n, 3)`` m, in the mesh's frame.
        of_query: whether to normalise by the bounds of the query, as the published program does.

    Raises:
        WrongUse: no bounds were given at the import.
        OutOfDomain: a vertex outside of the bounds; or bounds that nothing can be divided by.
        DataRefused: a damaged network, or colours that are not finite.
    """
    low, high = coordinate_bounds(
        entry.bounds_m, vertices, of_query=of_query, option="--touch-bounds", what="press", unit="metres"
    )
    if high == 0.0:
        raise OutOfDomain(
            "the greatest coordinate is 0 m, and ObjectFolder 1.0 divides by it; its network cannot have "
            "been trained so: give the bounds that it was trained in"
        )
    places = np.empty((len(vertices), entry.rows, entry.columns, 5))
    places[..., :3] = normalised_coordinates(vertices, (low, high))[:, None, None]
    places[..., 3] = np.linspace(-1.0, 1.0, entry.rows)[:, None]
    places[..., 4] = np.linspace(-1.0, 1.0, entry.columns)
    colours = query(of.network(entry.network), {"place": places.reshape(-1, 5)})["colours"]
    grey = np.clip(np.rint((colours + 1.0) / 2.0 * 255.0), 0, 255).astype(np.uint8)
    return read_only(grey.reshape(*places.shape[:3], 3))


def normalised_coordinates(coordinates: FloatArray, bounds: Bounds) -> FloatArray:
    """Normalise coordinates in m as 1.0's touch does: the range is divided by the greatest, not by itself."""
    low, high = bounds
    normalised: FloatArray = 2.0 * ((coordinates - low) / high) - 1.0
    return normalised


PITCH = 0.1245e-3
"""Size of a pixel in the published program, m."""

_CORE = 0.2
"""Fraction of the press's depth; the gel touches where it is pushed in more than that."""

_KERNELS = (11, 5)
"""Widths in pixels of the blurs outside of the contact."""


@dataclass(frozen=True, eq=False)
class TaximPicture:
    """A published calibration, ready for pictures."""

    table: FloatArray  #: ``(bins, bins, 6, 3)`` RGB.
    rest: FloatArray  #: ``(rows, columns)`` pixels, the untouched gel towards the camera.
    base: FloatArray
    """``(rows, columns, 3)`` RGB: the untouched gel's picture less the table's colours of its dome."""

    @classmethod
    def open(cls, folder: Path, shape: tuple[int, int]) -> "TaximPicture":
        """Open the calibration of a folder, for maps of a shape.

        Raises:
            CalibrationRefused: no published calibration, one without the untouched gel's shape, or one
                of another camera.
        """
        pack = read_published(folder, PITCH)
        if pack.rest is None or pack.rest.shape != shape:
            raise CalibrationRefused(
                f"{folder} has no shape of the untouched gel with {shape[0]} x {shape[1]} pixels "
                f"(depth_bg.npy); use the folder that ObjectFolder 2.0 publishes, with {TABLE} and {PRESSES}"
            )
        table, rest = read_table(folder / TABLE), pack.rest / PITCH
        return cls(table, rest, pack.calibration.background.astype(np.float64) - table_colours(rest, table))

    def colours(self, depth: FloatArray, pressed: float) -> FloatArray:
        """Compute ``(rows, columns, 3)`` RGB of 0 to 255, not rounded.

        Args:
            depth: ``(rows, columns)`` distance from the camera in m.
            pressed: depth of the press in m.
        """
        height = (SEEN_DEPTH[1] - depth) / PITCH
        contact = height - self.rest > _CORE * pressed / PITCH
        # Blurred where nothing touches, in single precision as published.
        soft = height.astype(np.float32)
        for width in _KERNELS:
            soft = np.asarray(cv2.GaussianBlur(soft, (width, width), 0), np.float32)
            soft[contact] = height[contact]
        coloured = table_colours(soft.astype(np.float64), self.table) + self.base
        found: FloatArray = np.clip(coloured, 0.0, 255.0)
        return found

    def image(self, depth: FloatArray, pressed: float) -> ByteArray:
        """Compute the picture, rounded to integers; arguments as ``colours``."""
        return np.rint(self.colours(depth, pressed)).astype(np.uint8)

    def compat_image(self, depth: FloatArray, pressed: float) -> ByteArray:
        """Compute the picture as the published program does: clipped at 0, with red and blue exchanged."""
        return np.ascontiguousarray(self.colours(depth, pressed)[..., ::-1]).astype(np.uint8)


def table_colours(height: FloatArray, table: FloatArray) -> FloatArray:
    """Look up ``(rows, columns, 3)`` colours of a surface's slopes.

    Args:
        height: ``(rows, columns)`` pixels.
        table: ``(bins, bins, 6, 3)``: a polynomial of the position for each steepness and direction.
    """
    colours = np.empty((*height.shape, 3))
    change_exactly(height, table, colours)
    return colours
