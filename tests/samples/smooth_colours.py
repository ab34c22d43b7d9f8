"""Colours that are off by a smooth random function of the gel's normal, drawn as a sum of waves."""

import numpy as np

from harness.basics.arrays import FloatArray

_WAVES = 60


class SmoothColours:
    """Three functions of a normal, of variance one.

    Args:
        alike: sine over which they are alike: of white noise under a Gaussian of this sigma.
        seed: of the waves.
    """

    def __init__(self, alike: float, seed: int) -> None:
        rng = np.random.default_rng([seed, 7])
        self._waves = rng.normal(0.0, 1.0 / (np.sqrt(2.0) * alike), (3, _WAVES, 2))
        self._phases = rng.uniform(0.0, 2.0 * np.pi, (3, _WAVES))

    def at(self, normal: FloatArray) -> FloatArray:
        """``(..., 3)`` of ``(..., 2)`` normals."""
        angle = np.einsum("...a,cwa->...cw", normal, self._waves) + self._phases
        return np.asarray(np.sqrt(2.0 / _WAVES) * np.cos(angle).sum(axis=-1))
