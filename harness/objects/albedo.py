"""Colours for the built-in objects: stated here, since their shapes say none.

Each has the colour of its material and a print in another: bands and rings of dots that pass through the
object along the shortest side of its box. What is printed depends on where a place is and not on how
finely the surface is cut up, and has no seam.
"""

from types import MappingProxyType

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.picture.srgb import bytes_from_linear

Colour = tuple[float, float, float]

COLOURS: MappingProxyType[str, tuple[Colour, Colour]] = MappingProxyType(
    {
        "ceramic": ((0.72, 0.70, 0.64), (0.06, 0.16, 0.38)),
        "polycarbonate": ((0.55, 0.14, 0.09), (0.70, 0.58, 0.30)),
        "wood": ((0.42, 0.24, 0.11), (0.17, 0.08, 0.035)),
        "steel": ((0.40, 0.41, 0.43), (0.10, 0.10, 0.11)),
    }
)
"""Linear albedo (red, green, blue) of each material, and of what is printed on it; all of them matt."""

_TEXELS = 512

_BAND_AT, _BAND_HALF = (0.16, 0.84), 0.035
"""Of the box's sides, from an edge: where the bands' middles are, and half their width."""

_DOTS, _DOT_RADIUS = 6, 0.045
"""Dots along a side, between the bands; radius as a share of that side."""


def print_of(material: str) -> ByteArray:
    """``(rows, columns, 3)`` sRGB: the print of a material, as wide and high as the object's box.

    Raises:
        WrongUse: a material of no built-in object.
    """
    if material not in COLOURS:
        raise WrongUse(f"no colour of {material!r} is known; there are {', '.join(COLOURS)}")
    base, printed = (np.array(colour) for colour in COLOURS[material])
    step = (np.arange(_TEXELS) + 0.5) / _TEXELS
    u, v = np.meshgrid(step, step)
    inked = np.maximum(_bands(v), _dots(u, v))[..., None]
    return bytes_from_linear(inked * printed + (1.0 - inked) * base)


def print_places(mesh: Mesh) -> FloatArray:
    """``(m, 3, 2)`` (u, v), 0 to 1: where in the print the corners of a mesh's faces are."""
    low, high = mesh.bounds
    across = [int(axis) for axis in range(3) if axis != int(np.argmin(high - low))]
    places: FloatArray = ((mesh.corners - low) / (high - low))[..., across]
    return places


def _bands(v: FloatArray) -> FloatArray:
    apart = np.min([np.abs(v - at) for at in _BAND_AT], axis=0)
    return np.asarray(apart < _BAND_HALF, dtype=np.float64)


def _dots(u: FloatArray, v: FloatArray) -> FloatArray:
    """Three rows between the bands, the middle one shifted by half a step."""
    inked = np.zeros_like(u)
    for row, height in enumerate((0.32, 0.5, 0.68)):
        across = np.mod(_DOTS * u + 0.5 * (row % 2), 1.0) - 0.5
        inked = np.maximum(inked, np.hypot(across / _DOTS, v - height) < _DOT_RADIUS)
    return inked.astype(np.float64)
