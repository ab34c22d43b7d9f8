"""What a core multiplies and adds at most, which kernels are measured by."""

import time

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.compiled import compiled_fast
from harness.objectfile.vision.network.tiles import OUTPUTS, SAMPLES, relu_tile


@compiled_fast
def _tiles(given: AnyArray, weight: AnyArray, bias: AnyArray, out: AnyArray, count: int) -> None:
    for _ in range(count):
        relu_tile(given.ctypes.data, weight.ctypes.data, bias.ctypes.data, out.ctypes.data, len(given))


def peak() -> float:
    """FLOP/s of one core multiplying and adding in registers and the first cache, by CPU seconds."""
    given, weight = np.zeros((64, SAMPLES), np.float32), np.zeros((64, OUTPUTS), np.float32)
    bias, out = np.zeros(OUTPUTS, np.float32), np.zeros((OUTPUTS, SAMPLES), np.float32)
    _tiles(given, weight, bias, out, 10)
    rates = []
    for _ in range(5):
        begun = time.process_time()
        _tiles(given, weight, bias, out, 20_000)
        rates.append(20_000 * 2.0 * 64 * OUTPUTS * SAMPLES / (time.process_time() - begun))
    return max(rates)
