"""How far the surface of an elastic layer on a rigid plate gives under a pressure: no friction, any contact.

A wave of pressure of wavenumber k moves the surface of a half-space by ``2 p / (E* k)``; of a layer of
thickness h that sticks to its plate by ``S(k h)`` times that (Burmister's layer; the incompressible one is
``marker_kernel.layer_response``). A half-space under one loaded square is Love's (Johnson, Contact
Mechanics, 1985, section 3.3); what the plate takes back is the Hankel transform of ``S - 1``, smooth over a
thickness. Their sum is the layer's, out to any distance, with no copies of the load beside it.
"""

from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1

from harness.basics.arrays import FloatArray, read_only
from harness.sim.gel.elastic import GelElastic

_LAST_WAVE = 20.0
"""Of k h: ``1 - S`` is 3e-15 there."""

_KNOTS = 40.0
"""To one thickness: between them the smooth part is a cubic within 1e-7 of its largest value."""


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
