"""The gel around a contact: how its surface hangs from what presses it.

Taxim's construction (Si and Yuan, 2022, section III-A): blur the surface with ever narrower
Gaussians, putting back after each the part that the object surely shapes. It works on the
indentation, so an untouched gel, flat or dome, stays untouched to the bit.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.compiled import compiled, compiled_fast, copy_line
from harness.basics.errors import OutOfDomain
from harness.bench.sensor import TactileSensor

GelLevel = Literal["exact", "fast"]

_COARSE = 4


@dataclass(frozen=True)
class GelSkirt:
    """How a gel hangs from what presses it: blurs repeated with the core put back.

    The constants of Taxim (Si and Yuan, 2022) and ObjectFolder 2.0, in pixels of the sensor.
    """

    kernels: tuple[int, ...] = (11, 5)  #: odd widths in pixels of the Gaussian blurs, widest first.
    final: int = 5  #: odd width in pixels of the last blur, over the core too.
    core: float = 0.2  #: share of the greatest penetration above which the object shapes the gel.


TAXIM_SKIRT = GelSkirt(kernels=(201, 101, 51, 21, 11, 5), final=5, core=0.4)
"""For pixels of 0.0295 mm and images of 480 x 640 (Taxim's own sensor)."""

R15_SKIRT = GelSkirt(kernels=(11, 5), final=5, core=0.2)
"""For pixels of 0.1245 mm and images of 120 x 160 (ObjectFolder 2.0)."""

_ROUNDING = 1e-9
"""Metres by which a press as deep as the gel may differ from it."""

_COARSE_FROM = 41
"""Width in pixels from which the fast level blurs on a coarser grid."""


def skirt_for(sensor: TactileSensor, skirt: GelSkirt = R15_SKIRT, at_pitch: float = 0.1245e-3) -> GelSkirt:
    """A skirt with the same kernels in metres on a sensor of another pitch; odd, at least 3 pixels wide."""
    scale = at_pitch / sensor.pitch

    def width(kernel: int) -> int:
        return max(3, 2 * round((kernel * scale - 1) / 2) + 1)

    return GelSkirt(tuple(width(k) for k in skirt.kernels), width(skirt.final), skirt.core)


def deform(penetration: FloatArray, skirt: GelSkirt, level: GelLevel = "exact") -> FloatArray:
    """The surface of the pressed gel, as the camera behind it sees it.

    Args:
        penetration: ``(n, rows, columns)`` metres, 0 or more: how deep the object reaches.
        skirt: kernels in pixels of these images.
        level: ``"exact"`` blurs every kernel in full; ``"fast"`` blurs those of 41 pixels and more
            on a grid of a quarter of the width (error measured in the benchmark).

    Returns:
        ``(n, rows, columns)`` metres of indentation, positive into the gel; a contact that
        penetrates nowhere is exactly zero.

    Raises:
        OutOfDomain: a penetration that is negative or not finite.
    """
    if not (np.isfinite(penetration).all() and (penetration >= 0.0).all()):
        raise OutOfDomain(
            "a penetration is negative or not finite; pass gaps through height_map.penetration first"
        )
    surface = np.array(penetration, dtype=np.float64, order="C")
    for n in range(len(surface)):
        if surface[n].any():
            _hang(surface[n], skirt, level)
    return read_only(surface)


def require_depth(deepest: float, thickness: float) -> None:
    """Refuse a press that is deeper than its gel is thick.

    Args:
        deepest: metres that the object reaches, or is to be pressed, into the undeformed gel.
        thickness: metres of the gel.

    Raises:
        OutOfDomain: it is deeper.
    """
    if deepest > thickness + _ROUNDING:
        raise OutOfDomain(
            f"pressed {1e3 * deepest:.3g} mm deep; this gel is {1e3 * thickness:g} mm thick: press less "
            "deep; where another part of the object is in the sensor's way, move, turn or tilt the contact"
        )


def require_within_gel(penetration: FloatArray, sensor: TactileSensor) -> FloatArray:
    """Return presses ``(n, rows, columns)`` in metres; ``OutOfDomain`` where one is deeper than the gel."""
    require_depth(float(penetration.max(initial=0.0)), sensor.gel_thickness)
    return penetration


def over_range(penetration: FloatArray, sensor: TactileSensor) -> tuple[FloatArray, FloatArray]:
    """Hold presses to the gel's thickness, and say where they went beyond.

    Args:
        penetration: ``(n, rows, columns)`` metres.
        sensor: gives the thickness.

    Returns:
        The penetration with nothing deeper than the gel is thick, and ``(n,)`` metres by which
        each contact went beyond, 0 where it did not: the caller flags or refuses.
    """
    beyond = np.maximum(0.0, penetration.max(axis=(1, 2)) - sensor.gel_thickness)
    return read_only(np.minimum(penetration, sensor.gel_thickness)), read_only(beyond)


def _hang(surface: FloatArray, skirt: GelSkirt, level: GelLevel) -> None:
    pressed = surface.copy()
    core = skirt.core * float(pressed.max())
    for width in skirt.kernels:
        if level == "fast" and width >= _COARSE_FROM:
            blur_coarsely(surface, half_kernel(width))
        else:
            blur(surface, half_kernel(width))
        put_back(surface, pressed, core)
    if skirt.final > 1:
        blur(surface, half_kernel(skirt.final))


def half_kernel(width: int) -> FloatArray:
    """The right half of a normalised Gaussian of an odd ``width`` in pixels, centre first.

    OpenCV's rule for the sigma, 0.3 ((width - 1) / 2 - 1) + 0.8, and its binomials for 3 and 5.
    """
    if width % 2 == 0 or width < 1:
        raise OutOfDomain(f"a blur of {width} pixels has no centre; give an odd width")
    binomials = {1: [1.0], 3: [0.5, 0.25], 5: [0.375, 0.25, 0.0625]}
    if width in binomials:
        return np.array(binomials[width])
    sigma = 0.3 * ((width - 1) * 0.5 - 1.0) + 0.8
    half = np.exp(-(np.arange(width // 2 + 1) ** 2) / (2.0 * sigma**2))
    kernel: FloatArray = half / (2.0 * half.sum() - half[0])
    return kernel


@compiled_fast
def blur(image: FloatArray, half: FloatArray) -> None:
    """Blur ``(rows, columns)`` in place by a symmetric kernel given from its centre out."""
    rows, columns = image.shape
    reach = len(half) - 1
    line = np.empty(columns + 2 * reach)
    for i in range(rows):
        copy_line(line[reach:], image[i])
        for k in range(1, reach + 1):
            line[reach - k] = image[i, _mirrored(-k, columns)]
            line[reach + columns - 1 + k] = image[i, _mirrored(columns - 1 + k, columns)]
        out = image[i]
        for j in range(columns):
            out[j] = half[0] * line[reach + j]
        for k in range(1, reach + 1):
            weight = half[k]
            left = line[reach - k : reach - k + columns]
            right = line[reach + k : reach + k + columns]
            for j in range(columns):
                out[j] += weight * (left[j] + right[j])
    source = image.copy()
    for i in range(rows):
        out = image[i]
        middle = source[i]
        for j in range(columns):
            out[j] = half[0] * middle[j]
        for k in range(1, reach + 1):
            weight = half[k]
            above = source[_mirrored(i - k, rows)]
            below = source[_mirrored(i + k, rows)]
            for j in range(columns):
                out[j] += weight * (above[j] + below[j])


@compiled
def blur_coarsely(image: FloatArray, half: FloatArray) -> None:
    """As ``blur``, on means of 4 x 4 pixels, interpolated back; for kernels much wider than that."""
    rows, columns = image.shape
    small = np.zeros(((rows + _COARSE - 1) // _COARSE, (columns + _COARSE - 1) // _COARSE))
    for i in range(small.shape[0]):
        for j in range(small.shape[1]):
            total, count = 0.0, 0
            for a in range(i * _COARSE, min((i + 1) * _COARSE, rows)):
                for b in range(j * _COARSE, min((j + 1) * _COARSE, columns)):
                    total += image[a, b]
                    count += 1
            small[i, j] = total / count
    blur(small, _thinned(half))
    for i in range(rows):
        y = (i + 0.5) / _COARSE - 0.5
        top = min(max(int(np.floor(y)), 0), max(small.shape[0] - 2, 0))
        below = min(top + 1, small.shape[0] - 1)
        t = min(max(y - top, 0.0), 1.0)
        for j in range(columns):
            x = (j + 0.5) / _COARSE - 0.5
            left = min(max(int(np.floor(x)), 0), max(small.shape[1] - 2, 0))
            right = min(left + 1, small.shape[1] - 1)
            s = min(max(x - left, 0.0), 1.0)
            upper = small[top, left] * (1 - s) + small[top, right] * s
            lower = small[below, left] * (1 - s) + small[below, right] * s
            image[i, j] = upper * (1 - t) + lower * t


@compiled
def _thinned(half: FloatArray) -> FloatArray:
    # The variance of the wide kernel less that of averaging and of interpolating, in coarse pixels.
    variance = 0.0
    for k in range(1, len(half)):
        variance += 2.0 * half[k] * k * k
    variance = variance / _COARSE**2 - (1.0 - 1.0 / _COARSE**2) / 12.0 - 1.0 / 6.0
    reach = max((len(half) - 1) // _COARSE, 1)
    thin = np.exp(-(np.arange(reach + 1) ** 2) / (2.0 * variance))
    normalised: FloatArray = thin / (2.0 * thin.sum() - thin[0])
    return normalised


@compiled
def put_back(surface: FloatArray, pressed: FloatArray, core: float) -> None:
    """Copy ``pressed`` onto ``surface`` where it is deeper than ``core``."""
    rows, columns = surface.shape
    for i in range(rows):
        for j in range(columns):
            if pressed[i, j] > core:
                surface[i, j] = pressed[i, j]


@compiled
def _mirrored(at: int, size: int) -> int:
    if size == 1:
        return 0
    at = abs(at) % (2 * (size - 1))
    return at if at < size else 2 * (size - 1) - at
