"""How well it is known where a camera is, and where what it looks at stands."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CameraErrors:
    """How well the scene camera and the support are known: standard deviations."""

    position: float = 2.0e-3  #: m, per axis.
    rotation: float = float(np.radians(0.2))  #: rad, per axis.
    focal_length: float = 5.0e-3  #: relative.
    support: float = 1.0e-3  #: m, of the height on which the object stands.
    tilt: float = float(np.radians(0.5))  #: rad, per axis, of the object's own stand.
    place: float = 0.1  #: m, per axis of the plane, of where it is put.
