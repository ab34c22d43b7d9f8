"""Cameras and lights of ObjectFolder's queries: a place each, in the vision frame.

The camera looks at the origin, z is up in the picture as far as the view allows. In the camera x is right, y
up and the view is along -z; a ray's direction has the length at which its depth along the axis is 1.
"""

import math
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.picture.pinhole import unit_vector

COMPAT_DISTANCE = 2.5
"""Of every camera that the published networks were trained by."""

FOCAL = 355.5555419921875
"""Pixels, of a picture of 256."""

SIZE = 256

_OFF = 1e-3
"""Relative, of a distance or the length of a direction; query files are rounded to a few digits."""


@dataclass(frozen=True, eq=False)
class PublishedView:
    """Where a picture is taken from, and in which light."""

    eye: FloatArray  #: ``(3,)``, in the vision frame.
    rotation: FloatArray  #: ``(3, 3)``: vision from camera.
    light: FloatArray  #: ``(3,)`` as the network takes it.

    def directions(self, size: int, offset: float) -> FloatArray:
        """``(size * size, 3)``: of the rays, row by row.

        Args:
            size: pixels a side.
            offset: pixels from a pixel's upper left corner, right and down.
        """
        x, y = np.meshgrid(np.arange(size) + offset, np.arange(size) + offset)
        scale = SIZE / (FOCAL * size)
        in_camera = np.stack(
            [(x - 0.5 * size) * scale, (0.5 * size - y) * scale, np.full_like(x, -1.0)], axis=-1
        )
        found: FloatArray = in_camera.reshape(-1, 3) @ self.rotation.T
        return found


def views_of(rows: FloatArray, reach: float, compat: bool) -> list[PublishedView]:
    """The views of a query file.

    Args:
        rows: ``(n, 6)``: camera and light.
        reach: of the object from the origin; a camera stands beyond it.
        compat: whether the camera must stand where the published program takes it to, and the light have the
        length
            that it was trained with; else any distance and length will do.

    Raises:
        OutOfDomain: naming the row.
    """
    return [_view(number, row[:3], row[3:], reach, compat) for number, row in enumerate(rows)]


def _view(number: int, eye: FloatArray, light: FloatArray, reach: float, compat: bool) -> PublishedView:
    distance = float(np.linalg.norm(eye))
    if compat and abs(distance - COMPAT_DISTANCE) > _OFF * COMPAT_DISTANCE:
        raise OutOfDomain(
            f"camera {number} is {distance:.6g} from the origin, and the published program takes every one "
            "to be at "
            f"{COMPAT_DISTANCE}: it would aim elsewhere; move it, or leave --objectfolder-compat out"
        )
    if not distance > reach:
        raise OutOfDomain(
            f"camera {number} is {distance:.6g} from the origin, within the object's {reach:g}; move it out"
        )
    towards = unit_vector(light, f"light {number}")
    length = float(np.linalg.norm(light))
    if compat and abs(length - 1.0) > _OFF:
        raise OutOfDomain(
            f"light {number} has the length {length:.6g}, and the network was trained with 1; divide it by "
            "that"
        )
    return PublishedView(
        eye, _rotation(eye, COMPAT_DISTANCE if compat else distance), light if compat else towards
    )


def _rotation(eye: FloatArray, distance: float) -> FloatArray:
    """First about x by the polar angle, then about z by the azimuth."""
    polar = math.acos(max(-1.0, min(1.0, float(eye[2]) / distance)))
    azimuth = math.atan2(float(eye[0]), -float(eye[1]))
    c, s = math.cos(polar), math.sin(polar)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    c, s = math.cos(azimuth), math.sin(azimuth)
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    rotation: FloatArray = about_z @ about_x
    return rotation
