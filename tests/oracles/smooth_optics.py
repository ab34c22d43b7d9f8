"""Pictures by the smooth model that the readers of tactile images invert, with the light of a press."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.sim.optics.kernels import to_pixels
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.optics import TactileImages
from harness.sim.optics.shading import KNEE, design, scaled_position
from harness.sim.optics.tactile_calibration import TactileCalibration
from tests.oracles.light_design import light_design

_PIXELS = 20000
"""Pixels that are drawn together."""


class SmoothOptics:
    """A calibration's polynomial in slope and position, drawn without the bins of its table."""

    def __init__(self, calibration: TactileCalibration) -> None:
        self._known = calibration

    def render(self, indentation: FloatArray) -> TactileImages:
        """Pictures of ``(n, rows, columns)`` m of a flat gel pushed towards the camera."""
        images = np.stack([self._picture(one) for one in indentation])
        nothing = np.zeros(len(images), np.int64)
        return TactileImages(np.clip(np.rint(images), 0.0, 255.0).astype(np.uint8), nothing, nothing)

    def _picture(self, pressed: FloatArray) -> FloatArray:
        z, limit = np.empty(pressed.shape), self._known.header.slope_limit
        to_pixels(np.zeros(pressed.shape), pressed, 1.0 / self._known.header.pitch, z)
        down, right = (np.pad(slope[1:-1, 1:-1], 1, mode="edge") for slope in np.gradient(z))
        steep = np.hypot(down, right)
        bent = softly_limited(steep / np.sqrt(1.0 + steep**2), limit)
        scale = bent / np.where(steep > 0.0, steep, 1.0)
        image = self._known.background.astype(np.float64)
        touched = np.stack(np.nonzero((steep > 0.0) | (z != 0.0)))
        for k in range(0, touched.shape[1], _PIXELS):
            i, j = touched[:, k : k + _PIXELS]
            normal = np.stack([-right[i, j] * scale[i, j], -down[i, j] * scale[i, j]], axis=-1)
            image[i, j] += self._change(normal, z[i, j], i.astype(np.float64), j.astype(np.float64))
        return image

    def _change(self, normal: FloatArray, z: FloatArray, i: FloatArray, j: FloatArray) -> FloatArray:
        known = self._known
        where = scaled_position(j, i, known.rows, known.columns)
        if not isinstance(known, LitCalibration):
            return np.asarray(design(normal, where) @ known.smooth)
        light = light_design(normal, where) @ known.light
        return np.asarray(design(normal, where) @ known.slopes + z[:, None] * known.header.pitch * light)


def softly_limited(sine: FloatArray, limit: float) -> FloatArray:
    """Bend the sines of slopes towards ``limit`` beyond the knee."""
    knee, room = KNEE * limit, max((1.0 - KNEE) * limit, 1e-12)
    bent = knee + room * (1.0 - np.exp(-np.maximum(sine - knee, 0.0) / room))
    return np.where(sine <= knee, sine, bent)
