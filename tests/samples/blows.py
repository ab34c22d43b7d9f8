"""Forces of a blow."""

import numpy as np

from harness.basics.arrays import FloatArray


def half_sine(rate: float, duration: float, peak: float) -> FloatArray:
    """``(t,)`` N, a blow of ``duration`` s that rises to ``peak`` N and falls as half a sine."""
    times = np.arange(int(np.floor(duration * rate)) + 1) / rate
    pulse: FloatArray = peak * np.sin(np.pi * times / duration)
    return pulse
