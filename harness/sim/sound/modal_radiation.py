"""How loud each mode is in the open, from the way the surface moves."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.sim.modal.modes import Modes

AIR_DENSITY = 1.204
"""kg/m^3, of dry air at 20 C and 101.325 kPa (ISO 2533)."""

SPEED_OF_SOUND = 343.2
"""m/s, likewise."""

_DIRECTIONS = 24


def radiation(modes: Modes, distance: float) -> FloatArray:
    """``(m,)`` Pa sqrt(kg) / (N s): the pressure at a distance of each mode, for a unit gain.

    Times the gain at the struck point (``Modes.gains``) it is the amplitude that ``ring`` takes.
    A mode's surface accelerates by ``w`` times its shape for a unit impulse. Every piece of the surface is a
    source of its own in free air, rms over all directions, so that parts that move against each other cancel
    (Rayleigh's integral without baffle; the shadow of the object on its own sound is left out).

    Args:
        modes: of the object.
        distance: m from the object's middle, above zero.

    Raises:
        WrongUse: a distance that is not above zero.
    """
    if not (np.isfinite(distance) and distance > 0.0):
        raise WrongUse(f"a microphone {distance:g} m from the object hears nothing; say a distance above 0")
    omega = 2.0 * np.pi * modes.frequencies
    areas = np.zeros(len(modes.points))
    faces = Mesh(modes.points, modes.faces)
    for corner in range(3):
        np.add.at(areas, modes.faces[:, corner], faces.face_areas / 3.0)
    outward = np.einsum("nmd,nd->nm", modes.shapes, modes.normals)
    per_volume = AIR_DENSITY * omega / (4.0 * np.pi * distance)
    return np.asarray(per_volume * _flow(modes, areas[:, None] * outward, omega / SPEED_OF_SOUND))


def _flow(modes: Modes, flow: FloatArray, wavenumbers: FloatArray) -> FloatArray:
    """``(m,)``: rms over directions of ``(n, m)`` flows added up with their delays."""
    middle = modes.points.mean(axis=0)
    height = 1.0 - (2.0 * np.arange(_DIRECTIONS) + 1.0) / _DIRECTIONS
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(_DIRECTIONS)
    radius = np.sqrt(1.0 - height**2)
    directions = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    ahead = (modes.points - middle) @ directions.T
    total = np.zeros(len(wavenumbers))
    for mode, wavenumber in enumerate(wavenumbers):
        phase = wavenumber * ahead
        total[mode] = np.mean((flow[:, mode] @ np.cos(phase)) ** 2 + (flow[:, mode] @ np.sin(phase)) ** 2)
    return np.sqrt(total)
