"""How the surface of a gel gives under a push: an incompressible elastic layer on a rigid plate.

On an incompressible half-space a normal push moves the surface straight down and not sideways:
the radial term of Boussinesq's solution carries a factor 1 - 2 nu (Johnson, Contact Mechanics,
1985, section 3.2). What moves a gel's dots is that the gel is thin and sticks to its plate: what is
pushed away must go outwards (the thin limit is in Johnson, section 5.8). So the kernel is that of
the layer, which contains both limits. Stokes' stream function, clamped at the plate and free of shear at
the surface, gives for a pressure ``p cos(k x)`` on a layer of thickness h, with q = k h and shear modulus G:

    into the gel   p / (2 G k) (sinh 2q - 2q) / (cosh 2q + 1 + 2 q^2) cos(k x)
    outwards       p / (2 G k) 2 q^2          / (cosh 2q + 1 + 2 q^2) sin(k x)

A push on a spot is the Hankel transform of these. The modulus only scales the load, and cancels
where the load follows from the depth.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain

_WAVE_STEP = 0.02
"""Of q: an integral out to r is sound while r is well below 2 pi / 0.02 thicknesses."""

_FARTHEST = 60.0
"""Thicknesses to which the integrals are taken."""


@dataclass(frozen=True, eq=False)
class LayerKernel:
    """Surface displacement around one push, per load.

    Attributes:
        inwards: of the distance in metres: into the gel.
        outwards: of the distance in metres: along the surface, away from the push.
        reach: metres, the largest distance that may be asked for.
    """

    inwards: CubicSpline
    outwards: CubicSpline
    reach: float


def layer_response(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(into the gel, outwards)`` of a wave of pressure, as factors of ``p / (2 G k)``.

    Args:
        q: wavenumber times thickness, greater than zero.
    """
    decay = np.exp(-2.0 * q)  # both fractions expanded by it: no overflow for a thick gel
    below = 0.5 * (1.0 + decay**2) + (1.0 + 2.0 * q**2) * decay
    return (0.5 * (1.0 - decay**2) - 2.0 * q * decay) / below, 2.0 * q**2 * decay / below


@lru_cache(maxsize=8)
def layer_kernel(thickness: float, spread: float, reach: float) -> LayerKernel:
    """The kernel of a push spread over a Gaussian spot.

    Args:
        thickness: metres, of the gel.
        spread: metres, sigma of the spot.
        reach: metres, the largest distance wanted.

    Raises:
        OutOfDomain: not lengths, a spot much smaller than the gel is thick, or a reach beyond 60
            thicknesses.
    """
    if not (0.0 < spread < np.inf and 0.0 < thickness < np.inf and 0.0 < reach < np.inf):
        raise OutOfDomain(f"a gel of {thickness} m, a spot of {spread} m and a reach of {reach} m cannot be")
    if reach > _FARTHEST * thickness or spread < thickness / 100.0:
        raise OutOfDomain(
            f"a reach of {reach * 1e3:g} mm and a spot of {spread * 1e3:g} mm on a gel of "
            f"{thickness * 1e3:g} mm; the kernel reaches {_FARTHEST:g} thicknesses, and a spot is "
            "at least 1/100 of one"
        )
    q = np.arange(0.5, 6.5 * thickness / spread / _WAVE_STEP) * _WAVE_STEP
    down, out = layer_response(q)
    weight = np.exp(-0.5 * (q * spread / thickness) ** 2) * _WAVE_STEP / thickness
    r = np.linspace(0.0, reach, int(np.ceil(8.0 * reach / spread)) + 2)
    inwards, outwards = np.empty_like(r), np.empty_like(r)
    for part in np.array_split(np.arange(len(r)), 1 + len(r) // 64):
        waves = np.outer(r[part] / thickness, q)
        inwards[part], outwards[part] = j0(waves) @ (down * weight), j1(waves) @ (out * weight)
    return LayerKernel(CubicSpline(r, inwards), CubicSpline(r, outwards), reach)
