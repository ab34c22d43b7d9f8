"""The touch of an ObjectFile: from presses on the object to the surface of the gel.

Two levels of one quantity: ``codes`` (``touch.onnx``) and ``reference``, the rasteriser on ``mesh.ply``,
which codes are measured against. Both refuse what they were not made for.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.geometry import inverse
from harness.objectfile.file import ObjectFile
from harness.objectfile.surface_search import SurfaceSearch, require_own
from harness.objectfile.touch.nodes import NodeSearch, SurfaceNodes, nodes_from
from harness.objectfile.touch_entries import CodesEntry, GelEntry, TouchEntry
from harness.sim.gel.gel import deform, over_range, require_within_gel
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration
from harness.sim.gel.press_pose import Presses

if TYPE_CHECKING:
    from harness.objectfile.runtime import Network

TouchLevel = Literal["codes", "reference"]

CHUNK = 16
"""Maps to a run: more are no faster, and take memory."""

_EDGE = 1e-9
"""Relative: what is at the very limit counts as within it."""


class Maps(Protocol):
    """A way from presses to maps."""

    def __call__(self, presses: Presses) -> AnyArray:
        """``(n, rows, columns)`` m."""


@dataclass(frozen=True, eq=False)
class CodeMaps:
    """Maps from codes of the surface."""

    network: "Network"  #: the graph of codes.
    nodes: NodeSearch  #: where the codes belong.

    def __call__(self, presses: Presses) -> AnyArray:
        """``(n, rows, columns)`` m; refuses a press that no code is near."""
        return self.network(self.nodes.queries(presses))["maps"]


@dataclass(frozen=True, eq=False)
class ReferenceMaps:
    """Maps from the rasteriser and the skirt."""

    raster: RasterMesh
    gel: GelEntry

    def __call__(self, presses: Presses) -> AnyArray:
        """Return ``(n, rows, columns)`` m; parts beside the contact are held at the gel's thickness."""
        return deform(over_range(self._penetration(presses), self.gel.sensor)[0], self.gel.skirt)

    def require_clear(self, presses: Presses) -> None:
        """Raise ``OutOfDomain`` where a part of the object reaches deeper than the gel is thick."""
        require_within_gel(self._penetration(presses), self.gel.sensor)

    def _penetration(self, presses: Presses) -> FloatArray:
        gap = height_maps(self.raster, inverse(presses.object_from_gel), self.gel.sensor)
        return penetration(gap, self.gel.sensor)


@dataclass(frozen=True, eq=False)
class ObjectTouch:
    """What a gel shows when it is pressed onto one object."""

    level: TouchLevel  #: where the maps come from.
    entry: TouchEntry  #: what ``object.json`` says: the gel, and what may be asked.
    surface: SurfaceSearch  #: the object's; presses are to be on it.
    maps: Maps  #: of presses that were looked at.

    @property
    def measured(self) -> Mapping[str, float]:
        """Errors of the level, by names with units; none of the reference."""
        if self.level == "codes" and self.entry.codes is not None:
            return self.entry.codes.network.measured
        return {}

    def at(self, presses: Presses) -> FloatArray:
        """``(n, rows, columns)`` m of indentation of the gel, positive into it.

        Raises:
            OutOfDomain: a depth, tilt or place that the level was not made for; the worst is named.
            DataRefused: a map that is not finite.
        """
        low, high = self.entry.depth_m
        most, codes = self.entry.most_tilt_rad, self.entry.codes
        # The mesh answers any press, and is asked beside the others.
        if codes is not None:
            low, high, most = 0.0, codes.deepest_m, codes.most_tilt_rad
        depths, tilts = presses.depths, presses.tilts
        if ((depths < low - _EDGE * high) | (depths > high * (1.0 + _EDGE))).any():
            raise OutOfDomain(
                f"a press {_span(depths * 1e3)} mm deep was asked of the "
                f"touch's {self.level}, which knows {low * 1e3:g} to {high * 1e3:g} mm; press within that, "
                "or simulate it with `touchstone sim touch`"
            )
        if ((tilts < 0.0) | (tilts > most * (1.0 + _EDGE))).any():
            raise OutOfDomain(
                f"a tilt of {_span(np.degrees(tilts))} deg was asked of "
                f"the touch's {self.level}, which knows 0 to {np.degrees(most):g} deg; lean less, or "
                "simulate it with `touchstone sim touch`"
            )
        self.surface.require_within(presses.points, self.entry.near_surface_m, f"the touch's {self.level}")
        gel = self.entry.gel
        found = np.empty((len(presses), gel.rows, gel.columns))
        for first in range(0, len(presses), CHUNK):
            found[first : first + CHUNK] = self.maps(presses[first : first + CHUNK])
        if not np.isfinite(found).all():
            bad = int(np.count_nonzero(~np.isfinite(found).all(axis=(1, 2))))
            raise DataRefused(
                f"the touch's {self.level} gives numbers that are not finite for {bad} of "
                f"{len(presses)} presses; build it again, or take its other level"
            )
        return found


def _span(values: FloatArray) -> str:
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} to {high}"


def open_touch(of: ObjectFile, level: TouchLevel = "codes", threads: int = 1) -> ObjectTouch:
    """Open the touch of an object at a level.

    Raises:
        DataRefused: the object has no touch or no codes, or a file of it is damaged.
        WrongUse: an unknown level.
    """
    entry = touch_of(of)
    maps: Maps
    match level:
        case "reference":
            maps = ReferenceMaps(RasterMesh(of.mesh), entry.gel)
        case "codes":
            codes = coded(of)
            nodes = NodeSearch(nodes_of(of, codes), codes.most_off_m)
            # Graphs are heavy to read, and the reference needs none of it.
            from harness.objectfile.self_test import open_network

            network = open_network(of.read(codes.network), codes.network, threads, ("maps",))
            maps = CodeMaps(network, nodes)
        case _:
            raise WrongUse(f"no level {level!r} of a touch; there is codes and reference")
    return ObjectTouch(level, entry, SurfaceSearch(of.mesh), maps)


def touch_of(of: ObjectFile) -> TouchEntry:
    """What ``object.json`` says of an object's touch; ``DataRefused`` where it has none."""
    if of.description.touch is None:
        raise DataRefused(
            f"{of.description.name} has no touch; add it with `touchstone object build --only touch`"
        )
    return of.description.touch


def coded(of: ObjectFile) -> CodesEntry:
    """Return the codes of an object's touch.

    Raises:
        DataRefused: the object has no touch, or only the perceptron that earlier versions trained.
    """
    codes = touch_of(of).codes
    if codes is None:
        raise DataRefused(
            f"the touch of {of.description.name} holds only a perceptron, which this version does not "
            "render; add codes with `touchstone object build --only touch`, or take the level reference"
        )
    return codes


def nodes_of(of: ObjectFile, entry: CodesEntry) -> SurfaceNodes:
    """Where the codes of an object belong.

    Raises:
        DataRefused: the file is damaged, holds another number of them than the graph knows, or places of
            another object.
    """
    nodes = nodes_from(of.read(entry.nodes), entry.nodes.file)
    asked = entry.network.inputs[0].domain
    if asked.high is None or asked.high[0] != len(nodes) - 1:
        raise DataRefused(
            f"{entry.nodes.file} has {len(nodes)} nodes, its graph another number; build it again"
        )
    require_own(SurfaceSearch(of.mesh), nodes.points, entry.nodes.file)
    return nodes
