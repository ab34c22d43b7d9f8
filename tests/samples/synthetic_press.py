"""Presses on small meshes without bench, images or noise, for tests of the estimator's parts."""

from dataclasses import dataclass

import numpy as np
import trimesh

from experiments.contact_localization.touch.touch import Contact, TouchNoise, contact_of
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, inverse, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.solid import union
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration

BASE_FROM_OBJECT = transform(rotation_from_vector(np.array([0.0, 0.0, 0.7])), np.array([0.4, -0.1, 0.2]))
"""Where the object stands; no estimate may depend on its translation."""

BLOCK = 8


def solid(shape: trimesh.Trimesh) -> Mesh:
    """What trimesh made, as the simulators take it."""
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def box(x: float, y: float, z: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """An axis-aligned box of full sides in metres."""
    shape = trimesh.creation.box(extents=(x, y, z))
    shape.apply_translation(centre)
    return solid(shape)


def stepped_block() -> Mesh:
    """A block of 70 x 50 x 30 mm with a step and a peg on top: no rotation leaves it as it was."""
    peg = trimesh.creation.cylinder(radius=0.004, height=0.02, sections=40)
    peg.apply_translation((-0.02, 0.012, 0.0155))
    parts = [box(0.07, 0.05, 0.03), box(0.03, 0.035, 0.02, (0.02, -0.0075, 0.015)), solid(peg)]
    return union(parts, smallest=1e-6)


@dataclass(frozen=True)
class Press:
    """One place to press: a point of the surface and the way the gel comes."""

    point: tuple[float, float, float]  #: ``(3,)`` metres, in the object's frame.
    axis: tuple[float, float, float]  #: ``(3,)`` unit, into the object.
    yaw: float = 0.0  #: rad, of the sensor about the axis.
    depth: float = 0.8e-3  #: metres.

    @property
    def object_from_gel(self) -> FloatArray:
        """``(4, 4)``: the gel's centre lies ``depth`` beyond the point."""
        axis = np.array(self.axis)
        return transform(frame_facing(axis, self.yaw), np.array(self.point) + self.depth * axis)


def felt(raster: RasterMesh, press: Press) -> FloatArray:
    """``(rows, columns)`` metres of indentation that an exact gel would show."""
    gap = height_maps(raster, inverse(press.object_from_gel)[None], GELSIGHT_R15)
    return np.asarray(deform(penetration(gap, GELSIGHT_R15), R15_SKIRT)[0])


def contact(raster: RasterMesh, press: Press, base_from_object: FloatArray = BASE_FROM_OBJECT) -> Contact:
    """The press as the estimator knows it, read without error."""
    return contact_of(
        base_from_object @ press.object_from_gel,
        felt(raster, press),
        GELSIGHT_R15.pitch,
        BLOCK,
        TouchNoise(),
    )


def tilted(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """The unit vector along an axis."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return float(unit[0]), float(unit[1]), float(unit[2])


PRESSES = (
    Press((-0.018, 0.0135, 0.0255), tilted((0.05, -0.03, -1.0)), yaw=0.4),
    Press((0.008, -0.005, 0.025), (0.0, 0.0, -1.0), yaw=2.0, depth=0.6e-3),
    Press((0.035, 0.021, 0.012), tilted((-1.0, -0.04, -0.05)), yaw=1.0, depth=1.0e-3),
    Press((-0.03, -0.025, 0.004), (0.0, 1.0, 0.0), yaw=-1.3, depth=0.5e-3),
    Press((-0.035, 0.018, -0.009), tilted((1.0, -0.06, 0.05)), yaw=0.1, depth=0.9e-3),
    Press((0.033, -0.024, 0.025), tilted((0.06, 0.08, -1.0)), yaw=-0.8, depth=0.7e-3),
)
"""On the stepped block: peg, edges, sides and a corner; the last is the one asked about."""
