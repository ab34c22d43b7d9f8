"""The light's terms of a press, written out."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.sim.optics.lit_calibration import LIGHT_POWERS, place_terms


def light_design(normal: FloatArray, position: FloatArray) -> FloatArray:
    """``(n, 36)`` the light's terms at ``(n, 2)`` normals and scaled positions, for unit indentation."""
    powers = np.empty((len(normal), len(LIGHT_POWERS)))
    for k, (a, b) in enumerate(LIGHT_POWERS):
        powers[:, k] = normal[:, 0] ** a * normal[:, 1] ** b
    terms: FloatArray = (powers[:, :, None] * place_terms(position)[:, None, :]).reshape(len(normal), -1)
    return terms
