"""Touch of an imported ObjectFile: maps of distance (version 2.0) or colours (1.0)."""

import math
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain, WrongUse
from harness.objectfile.published.entries import Bounds, PublishedColoursEntry, PublishedDepthEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.published.query import query, require_in_box
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network

TILT = math.radians(15.0)
"""rad: the greatest tilt of a press; with the depths and distances below it is in the published program
(``OF_render.py``) and not in its files."""

PRESS_DEPTH = (0.5e-3, 2.0e-3)
"""m: least and greatest depth of a press."""

SEEN_DEPTH = (33.9e-3, 40.0e-3)
"""m from camera to gel: what the network's 0 and 1 stand for."""

DEPTH_PIXELS = (120, 160)
"""Rows and columns of a map of 2.0."""

_ROUNDING = 1e-9
"""Relative, of an angle or depth at its limit."""


@dataclass(frozen=True, eq=False)
class PublishedDepths:
    """The network of an imported touch of version 2.0."""

    entry: PublishedDepthEntry  #: what is said of it.
    network: Network  #: nine numbers of a pixel to metres.

    def maps(self, vertices: FloatArray, gel: FloatArray) -> FloatArray:
        """``(n, rows, columns)`` m from the gel's camera to its surface.

        Args:
            vertices: ``(n, 3)`` m, where the gel is pressed on, in the mesh's frame.
            gel: ``(n, 3)``: tilt from the vertex's normal and its azimuth in rad, depth in m.

        Raises:
            OutOfDomain: a vertex, tilt or depth that the network was not trained at.
            DataRefused: distances that are not finite.
        """
        entry = self.entry
        require_in_box(vertices, np.array(entry.low_m), np.array(entry.high_m), "press")
        _require(gel[:, 0], (0.0, entry.most_tilt_rad), math.degrees(1.0), "tilt", "deg")
        _require(gel[:, 2], entry.depth_m, 1e3, "depth", "mm")
        maps = np.empty((len(vertices), entry.rows, entry.columns))
        for number, (vertex, (tilt, azimuth, depth)) in enumerate(zip(vertices, gel, strict=True)):
            pixels = np.empty((entry.rows, entry.columns, 9))
            pixels[..., :7] = (*vertex, tilt, math.cos(azimuth), math.sin(azimuth), depth)
            pixels[..., 7], pixels[..., 8] = np.arange(entry.rows)[:, None], np.arange(entry.columns)
            depths = query(self.network, {"pixel": pixels.reshape(-1, 9)})["depth"]
            maps[number] = depths.reshape(entry.rows, entry.columns)
        return read_only(maps)


@dataclass(frozen=True, eq=False)
class PublishedColours:
    """The network of an imported touch of version 1.0."""

    entry: PublishedColoursEntry  #: what is said of it.
    network: Network  #: normalised place and pixel to colour.

    def bounds_of(self, vertices: FloatArray, of_query: bool) -> Bounds:
        """m: the least and greatest coordinate that places are normalised by.

        Args:
            vertices: ``(n, 3)`` m, of the query.
            of_query: whether to take the query's own, as the published program does.

        Raises:
            WrongUse: nobody gave any.
            OutOfDomain: a vertex beyond those that were given.
        """
        if of_query:
            return float(vertices.min()), float(vertices.max())
        if self.entry.bounds_m is None:
            raise WrongUse(
                "the touch was imported without the bounds of its vertices, which ObjectFolder 1.0 does not "
                "publish: import the file again with --touch-bounds LOW HIGH in metres, or say "
                "--objectfolder-compat to take the query's own, as its program does"
            )
        low, high = self.entry.bounds_m
        require_in_box(vertices, np.full(3, low), np.full(3, high), "press")
        return low, high

    def images(self, vertices: FloatArray, of_query: bool = False) -> ByteArray:
        """``(n, rows, columns, 3)`` RGB of presses along the normal at ``(n, 3)`` vertices in metres.

        Raises:
            WrongUse: as ``bounds_of``.
            OutOfDomain: as ``bounds_of``; or bounds that nothing can be divided by.
            DataRefused: colours that are not finite.
        """
        low, high = self.bounds_of(vertices, of_query)
        if high == 0.0:
            raise OutOfDomain(
                "the greatest coordinate is 0 m, and ObjectFolder 1.0 divides by it; its network cannot have "
                "been trained so: give the bounds that it was trained in"
            )
        entry = self.entry
        places = np.empty((len(vertices), entry.rows, entry.columns, 5))
        places[..., :3] = normalised_coordinates(vertices, (low, high))[:, None, None]
        places[..., 3] = np.linspace(-1.0, 1.0, entry.rows)[:, None]
        places[..., 4] = np.linspace(-1.0, 1.0, entry.columns)
        flat = query(self.network, {"place": places.reshape(-1, 5)})["colours"]
        grey = np.clip(np.rint((flat + 1.0) / 2.0 * 255.0), 0, 255).astype(np.uint8)
        return read_only(grey.reshape(*places.shape[:3], 3))


def normalised_coordinates(coordinates: FloatArray, bounds: Bounds) -> FloatArray:
    """Coordinates in m as 1.0's touch takes them: the range is divided by the greatest, not by itself."""
    low, high = bounds
    found: FloatArray = 2.0 * ((coordinates - low) / high) - 1.0
    return found


def open_depths(of: PublishedObject, entry: PublishedDepthEntry) -> PublishedDepths:
    """The touch of an imported object of 2.0; ``DataRefused`` where its file is not the one described."""
    return PublishedDepths(entry, open_network(of.read(entry.network), entry.network))


def open_colours(of: PublishedObject, entry: PublishedColoursEntry) -> PublishedColours:
    """The touch of an imported object of 1.0; ``DataRefused`` where its file is not the one described."""
    return PublishedColours(entry, open_network(of.read(entry.network), entry.network))


def _require(values: FloatArray, limits: tuple[float, float], unit: float, what: str, named: str) -> None:
    low, high = limits
    slack = _ROUNDING * high
    outside = np.flatnonzero((values < low - slack) | (values > high + slack))
    if len(outside):
        raise OutOfDomain(
            f"press {outside[0]} has a {what} of {values[outside[0]] * unit:.6g} {named}, and the network "
            "was trained "
            f"from {low * unit:g} to {high * unit:g} {named}; press within that"
        )
