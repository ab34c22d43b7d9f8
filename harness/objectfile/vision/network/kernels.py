"""All layers of the tiny networks for a block of samples, without leaving the first cache.

A sample is a lane. Its encoding is a polynomial for the first octave and the double angle from there on;
the layer without an activation is folded into the next; what one light and one object have in common is a
bias. Numbers are float32; products and sums may be fused.
"""

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.compiled import compiled_fast
from harness.objectfile.vision.network.positional_encoding import (
    logistic_3,
    logistic_3_narrow,
    waves,
    waves_narrow,
)
from harness.objectfile.vision.network.tiles import (
    LANES,
    OUTPUTS,
    SAMPLES,
    relu_narrow,
    relu_tile,
    sum_1,
    sum_1_narrow,
    sum_4,
    sum_4_narrow,
)


@compiled_fast
def _layer(given: int, weight: int, bias: int, out: int, inputs: int, outputs: int, across: int) -> None:
    """All outputs of a layer with ReLU, tile by tile, at addresses."""
    for o in range(0, outputs, OUTPUTS):
        w, b, to = weight + 4 * o * inputs, bias + 4 * o, out + 4 * o * across
        if across == LANES:
            relu_narrow(given, w, b, to, inputs)
        else:
            relu_tile(given, w, b, to, inputs)


@compiled_fast
def ask_blocks(
    blocks: AnyArray,
    order: AnyArray,
    local: AnyArray,
    rays: AnyArray,
    most: int,
    views: AnyArray,
    extras: AnyArray,
    packed: AnyArray,
    lit: AnyArray,
    octaves: int,
    turns: int,
    density: AnyArray,
    scattered: AnyArray,
) -> None:
    """Densities and scattered fractions of blocks of samples.

    Args:
        blocks: ``(m, 3)``: network, first place in ``order``, samples.
        order: of samples, so that those of a block are next to each other.
        local: ``(n, 3)`` float32, -1 to 1 in each sample's cell.
        rays: of each ``most`` samples.
        most: places for samples of a ray.
        views: ``(r, 3)`` float32 unit, of each ray; ``(r, 0)`` where ``packed`` has no rows of them.
        extras: ``(r, 0)`` or ``(r, 4)`` float32.
        packed: ``(networks, numbers)`` float32, as ``vision_fold`` lays them out.
        lit: ``(networks, width)`` float32: bias of the layer that sees directions, with the light's part.
        octaves: of places.
        turns: octaves of directions.
        density: ``(n,)`` float32, written; in units of the weights' scale.
        scattered: ``(n, 3)`` float32, written.
    """
    wide, place, more, looks = lit.shape[1], 3 + 6 * octaves, extras.shape[1], views.shape[1] > 0
    seen = 3 + 6 * turns if looks else 0
    encoding = np.zeros(place * SAMPLES, np.float32)
    hidden = np.zeros(wide * SAMPLES, np.float32)
    scatter = np.zeros((wide + seen + more) * SAMPLES, np.float32)
    toward = scatter[wide * SAMPLES :]
    raw = np.zeros(5 * SAMPLES, np.float32)
    for m in range(len(blocks)):
        network, first, count = blocks[m, 0], blocks[m, 1], blocks[m, 2]
        across = LANES if count <= LANES else SAMPLES
        toward = scatter[wide * across :]
        for i in range(across):
            sample = order[first + min(i, count - 1)]
            ray = rays[sample // most]
            for c in range(3):
                encoding[c * across + i] = local[sample, c]
            for c in range(views.shape[1]):
                toward[c * across + i] = views[ray, c]
            for c in range(more):
                toward[(seen + c) * across + i] = extras[ray, c]
        if across == LANES:
            waves_narrow(encoding.ctypes.data, octaves)
            if looks:
                waves_narrow(toward.ctypes.data, turns)
        else:
            waves(encoding.ctypes.data, octaves)
            if looks:
                waves(toward.ctypes.data, turns)
        at = packed[network].ctypes.data
        _layer(encoding.ctypes.data, at + 4 * wide, at, hidden.ctypes.data, place, wide, across)
        at += 4 * wide * (place + 1)
        _layer(hidden.ctypes.data, at + 4 * wide, at, scatter.ctypes.data, wide, wide, across)
        at += 4 * wide * (wide + 1)
        out = raw.ctypes.data
        if across == LANES:
            sum_1_narrow(scatter.ctypes.data, at + 4, at, out, wide)
        else:
            sum_1(scatter.ctypes.data, at + 4, at, out, wide)
        at += 4 * (wide + 1)
        inputs = wide + seen + more
        _layer(scatter.ctypes.data, at, lit[network].ctypes.data, hidden.ctypes.data, inputs, wide, across)
        at += 4 * wide * inputs
        out += 4 * across
        if across == LANES:
            sum_4_narrow(hidden.ctypes.data, at + 16, at, out, wide)
            logistic_3_narrow(out)
        else:
            sum_4(hidden.ctypes.data, at + 16, at, out, wide)
            logistic_3(out)
        for i in range(count):
            sample = order[first + i]
            density[sample] = max(raw[i], np.float32(0.0))
            for c in range(3):
                scattered[sample, c] = raw[(1 + c) * across + i]
