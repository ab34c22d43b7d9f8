"""The sensor's rigid face, around the gel and behind it, against an object: it meets what the gel does not.

A way into what nobody knows may lead the housing onto a rim that passes the gel by. Nothing shows in the
picture then, and the force rises far steeper than a gel's: as what carries sensor and object gives.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import translation
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from mocks.world.gel_contact import GelContact

STIFFNESS = 1.0e4
"""N/m of the stand of foam, the sensor's mount and the arm in a row; chosen, not measured."""

SPACING = 1.0e-3
"""Metres between the places of the face that are looked at: less than the edge of a cup is thick."""

REACH = 10.0e-3
"""Metres behind the face within which a surface is felt."""


class HousingContact:
    """The flat face of a sensor's housing, a gel's thickness behind the gel's own, against one mesh.

    Its sides are not looked at: on a straight way along the gel's axis nothing meets them first.

    Args:
        mesh: of the object, in its frame.
        sensor: the make.
    """

    def __init__(self, mesh: Mesh, sensor: TactileSensor) -> None:
        self._face = GelContact(mesh, sensor.housing, SPACING, REACH)
        self._gel_from_face = translation(np.array([0.0, 0.0, -sensor.gel_thickness]))
        self._sides = sensor.housing

    def wrench(self, object_from_gel: FloatArray) -> FloatArray:
        """``(6,)`` N and N m that the object exerts on the face, at the gel's origin, in gel."""
        depth = self._face.indentation(object_from_gel @ self._gel_from_face)
        push = STIFFNESS * float(depth.max())
        if push == 0.0:
            return np.zeros(6)
        weights = depth / depth.sum()
        y, x = (side * _middles(count) for side, count in zip(self._sides[::-1], depth.shape, strict=True))
        at_x, at_y = float(weights.sum(axis=0) @ x), float(weights.sum(axis=1) @ y)
        return np.array([0.0, 0.0, -push, -at_y * push, at_x * push, 0.0])


def _middles(count: int) -> FloatArray:
    """``(count,)`` of a side of length one, about its middle."""
    return (np.arange(count) + 0.5) / count - 0.5
