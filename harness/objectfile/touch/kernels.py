"""The loops of ``touch_graph``: a pressed gel's rays through the heights of a node, and the gel's skirt.

In float32, in the order of the graph's operations; sums and products may be fused, so that rounding differs.
"""

import math

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.compiled import compiled_fast

LEAST_COSINE = np.float32(0.25)
"""As the graph's."""

COVERED = np.float32(127.5)
"""As the graph's."""


@compiled_fast
def press(
    heights: AnyArray,
    covers: AnyArray,
    nodes: AnyArray,
    motions: AnyArray,
    grids: tuple[tuple[int, AnyArray, AnyArray], ...],
    lookups: int,
    thickness: np.float32,
    halves: tuple[AnyArray, ...],
    core: np.float32,
    maps: AnyArray,
) -> None:
    """Maps of presses.

    Args:
        heights: ``(nodes, size * size)`` m over that of all outside, float32, with a ring of zeros.
        covers: ``(nodes, size * size)`` uint8, likewise.
        nodes: ``(n,)`` of each press.
        motions: ``(n, 4, 3)``: places of the gel's plane, homogeneous, to the patch's width and to m over all
            outside.
        grids: of the coarse rays, the covers' and the pixels': pixels a side of each, and its x and y in m.
        lookups: along each ray.
        thickness: m, of the gel.
        halves: right halves of the skirt's kernels; the last is the final one.
        core: share of the deepest that the object surely shapes.
        maps: ``(n, rows, columns)`` m, written.
    """
    coarse, half, fine = grids
    rows, columns = maps.shape[1:]
    near = np.zeros((len(coarse[2]), len(coarse[1])), np.float32)
    beside = np.zeros((len(half[2]), len(half[1])), np.float32)
    covered = np.zeros_like(beside)
    between, seen = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
    for n in range(len(maps)):
        image, out = heights[nodes[n]], maps[n]
        near[:] = np.float32(0.0)
        for _ in range(lookups - 1):
            _along(image, motions[n], coarse[1], coarse[2], near, near)
            for i in range(near.shape[0]):
                for j in range(near.shape[1]):
                    near[i, j] = min(max(near[i, j], -thickness), thickness)
        _finer(near, coarse[0] // half[0], beside)
        _look_up(covers[nodes[n]], motions[n], half[1], half[2], beside, covered)
        _finer(covered, half[0], seen)
        _finer(near, coarse[0], between)
        _along(image, motions[n], fine[1], fine[2], between, out)
        deepest = np.float32(0.0)
        for i in range(rows):
            for j in range(columns):
                deep = -out[i, j] if seen[i, j] > COVERED else np.float32(0.0)
                deep = min(max(deep, np.float32(0.0)), thickness)
                out[i, j] = deep
                deepest = max(deepest, deep)
        hang(out, halves, core * deepest)


@compiled_fast
def _along(
    image: AnyArray, motion: AnyArray, x: AnyArray, y: AnyArray, near: AnyArray, out: AnyArray
) -> None:
    """Along the gel's z to the height under where ``near`` is; ``out`` may be ``near`` itself."""
    rise = max(motion[2, 2], LEAST_COSINE)
    h0, h1, h3 = motion[0, 2], motion[1, 2], motion[3, 2]
    _look_up(image, motion, x, y, near, out)
    for i in range(len(y)):
        w0 = y[i] * h1 + h3
        for j in range(len(x)):
            out[i, j] = (out[i, j] - (x[j] * h0 + w0)) / rise


@compiled_fast
def _look_up(
    image: AnyArray, motion: AnyArray, x: AnyArray, y: AnyArray, near: AnyArray, out: AnyArray
) -> None:
    """A square image with a ring of zeros, linear between its pixels and zero beyond, where the rays are."""
    size = math.sqrt(len(image))
    across, last, most = np.uint32(size), np.float32(size - 1), np.uint32(size - 2)
    scale, shift = np.float32(0.5 * (size - 2)), np.float32(0.5 * (size - 1))
    a0, a1, a2 = motion[0, 0] * scale, motion[1, 0] * scale, motion[2, 0] * scale
    b0, b1, b2 = motion[0, 1] * scale, motion[1, 1] * scale, motion[2, 1] * scale
    a3, b3 = motion[3, 0] * scale + shift, motion[3, 1] * scale + shift
    zero = np.float32(0.0)
    for i in range(len(y)):
        u0, v0 = y[i] * a1 + a3, y[i] * b1 + b3
        for j in range(len(x)):
            u = min(max(x[j] * a0 + u0 + near[i, j] * a2, zero), last)
            v = min(max(x[j] * b0 + v0 + near[i, j] * b2, zero), last)
            left, top = min(np.uint32(u), most), min(np.uint32(v), most)
            s, t = u - np.float32(left), v - np.float32(top)
            at = top * across + left
            first, second = np.float32(image[at]), np.float32(image[at + np.uint32(1)])
            upper = first + s * (second - first)
            first, second = (
                np.float32(image[at + across]),
                np.float32(image[at + across + np.uint32(1)]),
            )
            lower = first + s * (second - first)
            out[i, j] = upper + t * (lower - upper)


@compiled_fast
def _finer(value: AnyArray, step: int, out: AnyArray) -> None:
    """Linear between rays that are ``step`` times as far apart, constant beyond the outer ones."""
    if step == 1:
        out[:] = value
        return
    rows, columns = value.shape
    line = np.empty(columns + 1, np.float32)
    left, share = _places(out.shape[1], columns), _shares(out.shape[1], columns)
    top, down = _places(out.shape[0], rows), _shares(out.shape[0], rows)
    for i in range(out.shape[0]):
        above, below = value[top[i]], value[min(top[i] + 1, rows - 1)]
        t, own = down[i], out[i]
        for j in range(columns):
            line[j] = above[j] * (np.float32(1.0) - t) + below[j] * t
        line[columns] = line[columns - 1]
        for j in range(len(own)):
            k, s = np.uint64(left[j]), share[j]
            own[j] = line[k] * (np.float32(1.0) - s) + line[k + np.uint64(1)] * s


@compiled_fast
def _places(size: int, count: int) -> AnyArray:
    """``(size,)``: before each pixel, of ``count`` coarse ones."""
    found = np.empty(size, np.int64)
    for i in range(size):
        at = min(max((i + 0.5) * count / size - 0.5, 0.0), count - 1.0)
        found[i] = min(int(at), max(count - 2, 0))
    return found


@compiled_fast
def _shares(size: int, count: int) -> AnyArray:
    """``(size,)`` float32: of the coarse pixel after each pixel."""
    before, found = _places(size, count), np.empty(size, np.float32)
    for i in range(size):
        found[i] = np.float32(min(max((i + 0.5) * count / size - 0.5, 0.0), count - 1.0) - before[i])
    return found


@compiled_fast
def hang(surface: AnyArray, halves: tuple[AnyArray, ...], core: np.float32) -> None:
    """``harness.sim.gel.gel.deform`` of one map, in float32."""
    pressed, source = surface.copy(), np.empty_like(surface)
    for number, half in enumerate(halves):
        if len(half) > 1:
            _blur(surface, half, source)
        if number < len(halves) - 1:
            for i in range(surface.shape[0]):
                for j in range(surface.shape[1]):
                    if pressed[i, j] > core:
                        surface[i, j] = pressed[i, j]


@compiled_fast
def _blur(image: AnyArray, half: AnyArray, source: AnyArray) -> None:
    """As ``gel_kernels.blur``, rows first; ``source`` is room for a copy."""
    rows, columns = image.shape
    reach = len(half) - 1
    line = np.empty(columns + 2 * reach, np.float32)
    for i in range(rows):
        middle = line[reach : reach + columns]
        middle[:] = image[i]
        for k in range(1, reach + 1):
            line[reach - k] = image[i, _mirrored(-k, columns)]
            line[reach + columns - 1 + k] = image[i, _mirrored(columns - 1 + k, columns)]
        out = source[i]
        for j in range(columns):
            out[j] = half[0] * middle[j]
        for k in range(1, reach + 1):
            # Views, as an index that might be negative keeps eight sums from being done at once.
            weight, left = half[k], line[reach - k : reach - k + columns]
            right = line[reach + k : reach + k + columns]
            for j in range(columns):
                out[j] += weight * (left[j] + right[j])
    for i in range(rows):
        out, own = image[i], source[i]
        for j in range(columns):
            out[j] = half[0] * own[j]
        for k in range(1, reach + 1):
            weight = half[k]
            above, below = source[_mirrored(i - k, rows)], source[_mirrored(i + k, rows)]
            for j in range(columns):
                out[j] += weight * (above[j] + below[j])


@compiled_fast
def _mirrored(at: int, size: int) -> int:
    if size == 1:
        return 0
    at = abs(at) % (2 * (size - 1))
    return at if at < size else 2 * (size - 1) - at
