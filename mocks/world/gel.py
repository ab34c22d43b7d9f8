"""What the world's gel shows: its own skirt, its own colours, and noise."""

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.bench.gap import GelGap
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import R15_SKIRT, GelSkirt, deform, half_kernel, over_range
from harness.sim.gel.height_map import rest_surface
from harness.sim.optics.lit_calibration import named_calibration
from harness.sim.optics.optics import Optics
from harness.sim.optics.pressed_gel import require_own

_NARROWEST = 5
_WIDEST = 301


class WorldGel:
    """From how deep the object reaches into the gel to the picture, at the exact level.

    Args:
        sensor: make and geometry.
        gap: how this gel differs from its model.
        calibration: whose colours it has, a shipped name or a path.
        steeper: the pitch that colours are stated for over this gel's own: a slope in pixels.

    Attributes:
        background: ``(rows, columns, 3)``, the picture of the untouched gel.
        calibration: whose colours this gel has.
    """

    def __init__(self, sensor: TactileSensor, gap: GelGap, calibration: str, steeper: float = 1.0) -> None:
        self._sensor = sensor
        self.calibration = named_calibration(calibration)
        require_own(self.calibration, sensor)
        self._steeper = steeper
        self._skirt = skirt_of(gap.skirt, sensor.pitch)
        self._optics = Optics(self.calibration, "exact", -rest_surface(sensor))
        self.background: ByteArray = self.calibration.background

    def picture(self, penetration: FloatArray, gain: float, noise: FloatArray) -> ByteArray:
        """``(rows, columns, 3)`` uint8, RGB.

        Args:
            penetration: ``(rows, columns)`` metres, 0 or more.
            gain: shown indentation over the true one.
            noise: ``(rows, columns)`` metres, added where the gel is touched.
        """
        touched = penetration > 0.0
        shown = np.where(touched, np.maximum(gain * penetration + noise, 0.0), 0.0)
        held, _ = over_range(shown[None], self._sensor)
        deformed = deform(held, self._skirt)
        if self._steeper != 1.0:
            deformed = self._steeper * deformed
        image: ByteArray = self._optics.render(deformed).images[0]
        return image


def skirt_of(blur: float, pitch: float) -> GelSkirt:
    """Taxim's pyramid of blurs, each half as wide as the one before, that blurs by ``blur`` in all.

    Args:
        blur: metres, the sigma of all the blurs together.
        pitch: metres a pixel.
    """
    wanted = blur / pitch
    pyramids = [_pyramid(widest) for widest in range(_NARROWEST, _WIDEST + 1, 2)]
    best = min(pyramids, key=lambda kernels: abs(_sigma((*kernels, R15_SKIRT.final)) - wanted))
    return GelSkirt(best, R15_SKIRT.final, R15_SKIRT.core)


def _pyramid(widest: int) -> tuple[int, ...]:
    kernels = [widest]
    while kernels[-1] // 2 | 1 >= _NARROWEST:
        kernels.append(kernels[-1] // 2 | 1)
    return tuple(kernels)


def _sigma(kernels: tuple[int, ...]) -> float:
    """Pixels: variances of blurs in a row add up."""
    halves = [half_kernel(kernel) for kernel in kernels]
    return float(np.sqrt(sum(2.0 * np.sum(half * np.arange(len(half)) ** 2) for half in halves)))
