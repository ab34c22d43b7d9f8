"""The gel around a contact: how its surface hangs from what presses it.

Taxim's construction (Si and Yuan, 2022, section III-A): blur the surface with ever narrower
Gaussians, putting back after each the part that the object surely shapes. It works on the
indentation, so an untouched gel, flat or dome, stays untouched to the bit.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import OutOfDomain
from harness.bench.sensor import TactileSensor
from harness.sim.gel.kernels import blur, blur_coarsely, put_back

GelLevel = Literal["exact", "fast"]


@dataclass(frozen=True)
class GelSkirt:
    """How a gel hangs from what presses it: blurs repeated with the core put back.

    The constants of Taxim (Si and Yuan, 2022) and ObjectFolder 2.0, in pixels of the sensor.

    Attributes:
        kernels: odd widths in pixels of the Gaussian blurs, widest first.
        final: odd width in pixels of the last blur, over the core too.
        core: share of the greatest penetration above which the object shapes the gel.
    """

    kernels: tuple[int, ...] = (11, 5)
    final: int = 5
    core: float = 0.2


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
