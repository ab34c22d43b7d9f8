"""How near maps of touch are to the reference simulator's, beside what costs nothing to compare with."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.authoring.touch.data import DEPTHS, draw_presses, pressed, reference_maps, smooth_normals
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.graph import MOST_TILT as CODED_TILT
from harness.objectfile.touch.nodes import NodeSearch, SurfaceNodes
from harness.objectfile.touch.touch import Maps
from harness.objectfile.touch_entries import MAP_RANGE
from harness.sim.gel.gel import GelSkirt
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.press_pose import Presses

_OTHER_PLACES = 1_000_003
"""Added to a seed: places that are drawn with it are none of the nodes'."""

_EXACT = 200.0
"""dB, for two maps that are the same to a ten-billionth of the range."""


def psnr(found: AnyArray, reference: FloatArray) -> FloatArray:
    """``(n,)`` dB: ``10 log10(MAP_RANGE^2 / mean squared difference)`` over all pixels of each map.

    Args:
        found: ``(n, rows, columns)`` m.
        reference: the same.

    Raises:
        WrongUse: maps of different shapes.
    """
    if found.shape != reference.shape or found.ndim != 3:
        raise WrongUse(f"maps of shapes {found.shape} and {reference.shape} cannot be compared")
    wrong = ((found - reference) ** 2).mean(axis=(1, 2)) / MAP_RANGE**2
    decibels: FloatArray = -10.0 * np.log10(np.maximum(wrong, 10.0 ** (-0.1 * _EXACT)))
    return decibels


@dataclass(frozen=True, eq=False)
class MapErrors:
    """Maps of one kind of press against the reference."""

    presses: Presses  #: that were possible.
    asked: int  #: how many were drawn.
    level: FloatArray  #: ``(n,)`` dB of the level that is measured.
    nearest: FloatArray
    """``(n,)`` dB of one reference map for each node: the nearest, upright, half as deep as may be, with the
    yaw that was asked."""
    nothing: FloatArray  #: ``(n,)`` dB of an untouched gel.

    def rows(self) -> dict[str, Mapping[str, float]]:
        """Median and 10th percentile of each, by name."""
        every = {"level": self.level, "nearest_trained": self.nearest, "background": self.nothing}
        return {
            name: {
                "psnr_db_median": float(np.median(values)),
                "psnr_db_p10": float(np.quantile(values, 0.1)),
            }
            for name, values in every.items()
        }


@dataclass(frozen=True, eq=False)
class PressBench:
    """What maps are measured on."""

    mesh: Mesh  #: of the object.
    raster: RasterMesh  #: of the same.
    sensor: TactileSensor  #: a flat gel.
    skirt: GelSkirt  #: of the gel.
    nodes: SurfaceNodes  #: the trained places.
    most_off: float  #: m, of ``touch_nodes.signatures``: a press farther from all of them is left out.

    def at_nodes(self, maps: Maps, count: int, seed: int) -> MapErrors:
        """Poses that were never shown, at trained places."""
        random = np.random.default_rng([seed, 8])
        chosen = np.sort(random.permutation(len(self.nodes))[:count])
        return self.measure(maps, draw_presses(self.mesh, self.nodes.points[chosen], seed + 1))

    def between_nodes(self, maps: Maps, count: int, seed: int) -> MapErrors:
        """Poses that were never shown, at places of the surface that were never shown."""
        points = SurfaceSearch(self.mesh).spread(count, seed + _OTHER_PLACES)[0]
        return self.measure(maps, draw_presses(self.mesh, points, seed + 2))

    def of_any_press(self, maps: Maps, count: int, seed: int) -> MapErrors:
        """At such places, as deep and as leant as codes answer."""
        points = SurfaceSearch(self.mesh).spread(count, seed + 2 * _OTHER_PLACES)[0]
        normals, depths = smooth_normals(self.mesh, points), (0.0, self.sensor.gel_thickness)
        return self.measure(maps, pressed(points, normals, seed + 3, depths, CODED_TILT))

    def measure(self, maps: Maps, presses: Presses) -> MapErrors:
        """Maps of presses against the reference; presses with a part of the object in the way are left out.

        So are those whose place cannot be seen from straight outside: no gel gets there.
        """
        asked = len(presses)
        off = NodeSearch(self.nodes, self.most_off).nearest(presses)[1]
        reference = reference_maps(self.raster, presses, self.sensor, self.skirt)
        kept = np.flatnonzero(reference.possible & (off <= self.most_off))
        presses, truth = presses[kept], reference.maps[kept]
        if len(presses) == 0:
            raise WrongUse(f"none of {asked} presses is possible; is the mesh inside out?")
        found = np.concatenate([maps(presses[k : k + 16]) for k in range(0, len(presses), 16)])
        nodes = NodeSearch(self.nodes, self.most_off).nearest(presses)[0]
        neighbours = Presses(
            self.nodes.points[nodes],
            self.nodes.normals[nodes],
            np.full(len(presses), np.mean(DEPTHS)),
            *(np.zeros(len(presses)), np.zeros(len(presses)), presses.yaws),
        )
        beside = reference_maps(self.raster, neighbours, self.sensor, self.skirt).maps
        return MapErrors(
            presses, asked, psnr(found, truth), psnr(beside, truth), psnr(np.zeros_like(truth), truth)
        )
