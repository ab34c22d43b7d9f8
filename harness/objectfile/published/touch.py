"""Touch of imported objects: maps of distance (version 2.0) or colours (1.0)."""

import math

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain
from harness.objectfile.published.entries import (
    Bounds,
    PublishedColoursEntry,
    PublishedDepthEntry,
    PublishedObject,
)
from harness.objectfile.published.query import coordinate_bounds, query, require_trained

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
