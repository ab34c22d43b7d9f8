"""How well it is known where a camera is, and where what it looks at stands."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CameraErrors:
    """How well the scene camera and the support are known: standard deviations.

    Attributes:
        position: m, per axis.
        rotation: rad, per axis.
        focal_length: relative.
        support: m, of the height on which the object stands.
        tilt: rad, per axis, of the object's own stand.
        place: m, per axis of the plane, of where it is put.
    """

    position: float = 2.0e-3
    rotation: float = float(np.radians(0.2))
    focal_length: float = 5.0e-3
    support: float = 1.0e-3
    tilt: float = float(np.radians(0.5))
    place: float = 0.1
