"""How stiff a gel is, how well that is known, and who says so.

Published figures of such gels, and what they rest on:

- GelSight Mini: shear modulus 0.145 MPa, Young's 0.435 MPa, fitted to four forces that a ball of 15 mm
  in diameter was pressed with, 0.5 to 2 mm deep (Helmut et al., Learning Force Distribution Estimation for
  the GelSight Mini, arXiv 2411.03315; github.com/feats-ai/feats, src/calculix/src, where the folder
  hyperelasticity_identification has the forces and the fit).
- Gel of a GelSight Wedge (silicone XP-565): 0.15 MPa and a Poisson's ratio of 0.485, from its Shore hardness
  (github.com/GelSight-lab/EstimateModulus, tactile_estimate.py).

No modulus of the R1.5's gel, nor of Taxim's, was found: these two are a factor of 2.9 apart, and the one
taken where nobody measured is their geometric mean.

How far the surface of an elastic layer on a rigid plate gives under a pressure: no friction, any contact.

A wave of pressure of wavenumber k moves the surface of a half-space by ``2 p / (E* k)``; of a layer of
thickness h that sticks to its plate by ``S(k h)`` times that (Burmister's layer; the incompressible one is
``markers.layer_response``). A half-space under one loaded square is Love's (Johnson, Contact
Mechanics, 1985, section 3.3); what the plate takes back is the Hankel transform of ``S - 1``, smooth over a
thickness. Their sum is the layer's, out to any distance, with no copies of the load beside it.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse

_LAST_WAVE = 20.0
"""Of k h: ``1 - S`` is 3e-15 there."""

_KNOTS = 40.0
"""To one thickness: between them the smooth part is a cubic within 1e-7 of its largest value."""


@dataclass(frozen=True)
class GelElastic:
    """An isotropic elastic gel that sticks to a rigid plate."""

    young: float  #: Pa, Young's modulus.
    young_share: float  #: one standard deviation of it, as a share.
    poisson: float = 0.485  #: Poisson's ratio, 0 to 0.5; a half is a gel that keeps its volume.
    poisson_sigma: float = 0.01  #: one standard deviation of it.
    thickness_share: float = 0.1  #: one standard deviation of the gel's thickness, as a share.
    source: str = "given"  #: of the modulus.

    def __post_init__(self) -> None:
        if not 0.0 < self.young < math.inf:
            raise WrongUse(
                f"a modulus of {self.young:g} Pa is no gel's; give Young's modulus above zero, such as 0.2MPa"
            )
        if not 0.0 <= self.poisson <= 0.5:
            raise WrongUse(
                f"a Poisson's ratio of {self.poisson:g} is no gel's; it lies from 0 to 0.5, near 0.49"
            )
        for name, share in (
            ("modulus", self.young_share),
            ("Poisson's ratio", self.poisson_sigma),
            ("thickness", self.thickness_share),
        ):
            if not 0.0 <= share < math.inf:
                raise WrongUse(f"an uncertainty of {share:g} of the {name} cannot be; give 0 or more")

    @property
    def plane(self) -> float:
        """Pa, the plane strain modulus E / (1 - nu^2)."""
        return self.young / (1.0 - self.poisson**2)


NOT_MEASURED = GelElastic(
    young=0.255e6,
    young_share=0.53,
    source="not measured: between the published 0.15 MPa (XP-565, by its hardness) and 0.435 MPa (GelSight "
    "Mini, by forces)",
)
"""Geometric mean of the two published moduli; half the logarithm of their ratio as its deviation."""


def taken_back(waves: FloatArray, poisson: float) -> FloatArray:
    """``S - 1``, without the cancellation, and without overflow for short waves.

    Args:
        waves: wavenumber times thickness, 0 or more.
        poisson: Poisson's ratio.
    """
    first, last = 3.0 - 4.0 * poisson, 5.0 - 12.0 * poisson + 8.0 * poisson**2
    decay = np.exp(-2.0 * waves)
    above = first * decay**2 + (2.0 * waves + 2.0 * waves**2 + last) * decay
    below = 0.5 * first * (1.0 + decay**2) + (2.0 * waves**2 + last) * decay
    taken: FloatArray = -above / below
    return taken


def influence(rows: int, columns: int, pitch: float, thickness: float, gel: GelElastic) -> FloatArray:
    """Metres that the middle of one square gives for each pascal on another.

    Args:
        rows: squares, downwards.
        columns: squares, to the right.
        pitch: metres, side of a square.
        thickness: metres of the gel; infinite for a half-space.
        gel: how stiff it is.

    Returns:
        ``(rows, columns)`` by how many squares the two are apart.
    """
    y, x = pitch * np.arange(rows, dtype=np.float64)[:, None], pitch * np.arange(columns, dtype=np.float64)
    half = 0.5 * pitch
    whole = (
        _corner(x + half, y + half)
        - _corner(x + half, y - half)
        - _corner(x - half, y + half)
        + _corner(x - half, y - half)
    )
    if np.isfinite(thickness):
        apart = np.hypot(x, y) / thickness
        spline = _plate(gel.poisson, float(np.ceil(apart.max() + 1.0)))
        whole = whole + spline(apart) * (pitch**2 / thickness)
    return read_only(whole / (np.pi * gel.plane))


def _corner(x: FloatArray, y: FloatArray) -> FloatArray:
    """Twice integrated ``1 / r``. No square has an edge through its middle, so that neither is zero."""
    found: FloatArray = x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y))
    return found


@lru_cache(maxsize=16)
def _plate(poisson: float, reach: float) -> CubicSpline:
    """What the plate takes back, of the distance in thicknesses, times ``pi E* h`` for a point load."""
    waves, weights = _nodes(reach)
    apart = np.linspace(0.0, reach, int(_KNOTS * reach) + 1)
    taken = taken_back(waves, poisson) * weights
    return CubicSpline(apart, j0(np.outer(apart, waves)) @ taken)


@lru_cache(maxsize=4096)
def disc_stiffness(radius: float, poisson: float) -> float:
    """Pressure over the mean depth of a disc that is pressed evenly, times ``radius / E*``.

    On a half-space ``3 pi / 16``; on a layer much thinner than the disc it tends to what the layer gives when
    it is pressed everywhere (Johnson, section 4.3, has an elastic foundation between these limits).

    Args:
        radius: in thicknesses; 0 for a half-space.
        poisson: Poisson's ratio.
    """
    gives = 4.0 / (3.0 * np.pi)
    if radius > 0.0:
        waves, weights = _nodes(float(np.ceil(radius)))
        shape = (j1(waves * radius) / waves) ** 2 * weights
        gives += float(taken_back(waves, poisson) @ shape) / radius
    return 1.0 / (4.0 * gives)


@lru_cache(maxsize=16)
def _nodes(reach: float) -> tuple[FloatArray, FloatArray]:
    """Gauss's nodes and weights, sixteen to two turns of the farthest wave or to a whole wave number."""
    panels = max(int(_LAST_WAVE), int(np.ceil(reach * _LAST_WAVE / (4.0 * np.pi))))
    nodes, weights = np.polynomial.legendre.leggauss(16)
    half = 0.5 * _LAST_WAVE / panels
    middles = half * (2.0 * np.arange(panels)[:, None] + 1.0)
    return (middles + half * nodes).ravel(), np.tile(half * weights, panels)
