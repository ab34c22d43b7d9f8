"""Presses at places that no network has learned from, and the pictures that the reference draws of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from experiments.baselines.bench import RenderingWork, Sense, picture_scores
from harness.authoring.touch.data import (
    DEPTHS,
    MOST_TILT,
    choose_nodes,
    pressed,
    reference_maps,
    smooth_normals,
)
from harness.authoring.touch.metrics import PressBench
from harness.basics.arrays import AnyArray, ByteArray, FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.touch_drawing import optics
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.nodes import NodeSearch, SurfaceNodes
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.presses import Presses
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

SEED = 11
"""Of places and presses; networks are made with 0."""

SPACING = 5e-3
"""m between places that networks of the table may learn from."""

NEAR = 6.5e-3
"""m: a press farther from all of them is left out, as by the codes of that spacing."""

MIDDLE = float(np.mean(DEPTHS))
"""m: how deep 1.0's one picture of a place is pressed, which knows no other depth."""

Kind = Literal["any", "upright"]


@dataclass(frozen=True, eq=False)
class TouchBench:
    """Presses of 2.0's range at random places, without yaw, or of 1.0's: upright and equally deep.

    Attributes:
        places: where networks learn, with the rasteriser.
        presses: that are possible.
        maps: ``(n, rows, columns)`` m, of the reference.
        calibration: of the colours.
    """

    places: PressBench
    presses: Presses
    maps: FloatArray
    calibration: TactileCalibration

    sense: Sense = "touch"

    @property
    def count(self) -> int:
        """Presses."""
        return len(self.presses)

    @cached_property
    def identity(self) -> str:
        """Of the object, the presses and the sensor."""
        return digest([self.lesson, self.presses.object_from_gel, self.presses.depths, self.maps])

    @cached_property
    def lesson(self) -> str:
        """Of all that networks learn from."""
        places, known = self.places, self.calibration
        return digest([places.mesh.vertices, places.nodes.points, known.background, known.table])

    @cached_property
    def optics(self) -> Optics:
        """From maps to pictures, for the reference and for every map of a method alike."""
        return optics(self.calibration, "fast", self.places.sensor)

    def picture(self, indentation: AnyArray) -> ByteArray:
        """``(rows, columns, 3)`` of ``(rows, columns)`` m."""
        drawn: ByteArray = self.optics.render(np.asarray(indentation, np.float64)[None]).images[0]
        return drawn

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """PSNR and SSIM of the whole picture."""
        return picture_scores(rendered, self.picture(self.maps[number]))


def learning_places(mesh: Mesh, calibration: TactileCalibration) -> PressBench:
    """Where networks of an object learn."""
    nodes: SurfaceNodes = choose_nodes(mesh, SPACING)
    return PressBench(mesh, RasterMesh(mesh), GELSIGHT_R15, calibration.header.skirt, nodes, NEAR)


def touch_bench(
    mesh: Mesh, presses: int, kind: Kind, work: RenderingWork, codes: NodeSearch | None = None
) -> TouchBench:
    """The presses of an object.

    Args:
        mesh: of the object.
        presses: that are drawn; those that are impossible are left out.
        kind: of presses.
        work: is informed.
        codes: of an ObjectFile that is to answer them too: a press that its codes refuse is left out.

    Raises:
        OutOfDomain: no press is possible.
    """
    work.report("touch: simulating presses", 0.0)
    calibration = shipped_calibration("gelsight_r15_bench")
    places = learning_places(mesh, calibration)
    points = SurfaceSearch(mesh).spread(presses, SEED)[0]
    drawn = _drawn(mesh, points, kind)
    searches = [NodeSearch(places.nodes, NEAR), *([] if codes is None else [codes])]
    near = np.all([each.nearest(drawn)[1] <= each.most for each in searches], axis=0)
    reference = reference_maps(places.raster, drawn, places.sensor, places.skirt)
    chosen = np.flatnonzero(reference.possible & near)
    if not len(chosen):
        raise OutOfDomain(f"none of {presses} presses is possible; is the mesh inside out?")
    return TouchBench(places, drawn[chosen], reference.maps[chosen], calibration)


def _drawn(mesh: Mesh, points: FloatArray, kind: Kind) -> Presses:
    normals, nothing = smooth_normals(mesh, points), np.zeros(len(points))
    if kind == "upright":
        return Presses(points, normals, nothing + MIDDLE, nothing, nothing, nothing)
    drawn = pressed(points, normals, SEED, DEPTHS, MOST_TILT)
    return Presses(points, normals, drawn.depths, drawn.tilts, drawn.azimuths, nothing)
