"""Samples sorted by network into blocks, and put together again along their rays."""

import math

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled


@compiled
def sort_samples(
    counts: AnyArray, most: int, networks: AnyArray, every: int, size: int, order: AnyArray, blocks: AnyArray
) -> tuple[int, int]:
    """Samples of one network next to each other, in blocks.

    Args:
        counts: ``(n,)`` samples of each ray.
        most: places for samples of a ray.
        networks: ``(n * most,)`` of each; -1 is left out.
        every: networks that there are.
        size: of a block at most.
        order: ``(samples,)`` int32, written: their places.
        blocks: ``(m, 3)`` int32, written: network, first in ``order``, samples. ``m`` of at least
            ``samples // size + every`` is enough.

    Returns:
        Samples, and blocks.
    """
    begin = np.zeros(every + 1, np.int64)
    for n in range(len(counts)):
        for i in range(counts[n]):
            network = networks[n * most + i]
            if network >= 0:
                begin[network + 1] += 1
    made = 0
    for network in range(every):
        left, at = begin[network + 1], begin[network]
        while left > 0:
            blocks[made, 0], blocks[made, 1], blocks[made, 2] = network, at, min(left, size)
            made, left, at = made + 1, left - size, at + size
        begin[network + 1] += begin[network]
    total = begin[every]
    for n in range(len(counts)):
        for i in range(counts[n]):
            network = networks[n * most + i]
            if network >= 0:
                order[begin[network]] = n * most + i
                begin[network] += 1
    return total, made


@compiled
def composite(
    rays: AnyArray,
    counts: AnyArray,
    most: int,
    networks: AnyArray,
    density: AnyArray,
    scattered: AnyArray,
    lengths: AnyArray,
    places: AnyArray,
    scale: float,
    least: float,
    resume: FloatArray,
    optical: FloatArray,
    sums: FloatArray,
) -> None:
    """Lay samples behind what their rays have met so far.

    What a sample takes of the light is ``-expm1``, so that thin ones are not lost. A ray with less than
    ``least`` left ends there, and what it saw counts as all.

    Args:
        rays: ``(n,)``.
        counts: ``(n,)`` samples of each.
        most: places for samples of a ray.
        networks: ``(n * most,)``; -1 is nothing.
        density: ``(n * most,)`` in units of ``scale``.
        scattered: ``(n * most, 3)``.
        lengths: ``(n * most,)`` m; infinite is opaque, whatever the density.
        places: ``(n * most,)`` m along the ray.
        scale: 1/m.
        least: of the light; 0 ends no ray.
        resume: ``(r,)`` m, becomes infinite where a ray ends.
        optical: ``(r,)`` sum of density times length, raised.
        sums: ``(r, 5)``: red, green, blue, opacity, opacity times m along the ray, raised.
    """
    for n in range(len(rays)):
        ray = rays[n]
        passed, sum_ = optical[ray], sums[ray]
        light = math.exp(-passed)
        red, green, blue, opacity, away = sum_[0], sum_[1], sum_[2], sum_[3], sum_[4]
        for at in range(n * most, n * most + counts[n]):
            if networks[at] < 0:
                continue
            thick = np.inf if lengths[at] == np.inf else scale * density[at] * lengths[at]
            taken = -math.expm1(-thick)
            weight = light * taken
            red += weight * scattered[at, 0]
            green += weight * scattered[at, 1]
            blue += weight * scattered[at, 2]
            opacity += weight
            away += weight * places[at]
            passed += thick
            light *= 1.0 - taken
            if light < least:
                resume[ray] = np.inf
                whole = 1.0 / (1.0 - light)
                red, green, blue, opacity, away = (
                    red * whole, green * whole, blue * whole, opacity * whole, away * whole,
                )  # fmt: skip
                break
        sum_[0], sum_[1], sum_[2], sum_[3], sum_[4] = red, green, blue, opacity, away
        optical[ray] = passed


@compiled
def aim(
    places: AnyArray,
    focal: float,
    x: float,
    y: float,
    rotation: FloatArray,
    ways: FloatArray,
    views: AnyArray,
    slant: FloatArray,
) -> None:
    """Where rays look.

    Args:
        places: ``(r, 2)`` x and y in the picture, pixels.
        focal: pixels.
        x: pixels, of the axis.
        y: pixels.
        rotation: ``(3, 3)`` object from camera.
        ways: ``(r, 3)`` unit, written.
        views: ``(r, 3)`` the same as float32, written.
        slant: ``(r,)`` depth for a unit of length, written.
    """
    for ray in range(len(places)):
        a, b = (places[ray, 0] - x) / focal, (places[ray, 1] - y) / focal
        part = 1.0 / math.sqrt(a * a + b * b + 1.0)
        for axis in range(3):
            way = part * (rotation[axis, 0] * a + rotation[axis, 1] * b + rotation[axis, 2])
            ways[ray, axis], views[ray, axis] = way, way
        slant[ray] = part


@compiled
def lay_out(
    pixels: AnyArray,
    cover: AnyArray,
    sums: FloatArray,
    slant: FloatArray,
    radiance: float,
    colour: FloatArray,
    alpha: FloatArray,
    depth: FloatArray,
) -> None:
    """What rays have seen, in the pixels that they belong to.

    Args:
        pixels: ``(r,)`` of each ray.
        cover: ``(r,)`` float32, share of each that is covered.
        sums: of ``composite``.
        slant: ``(r,)`` depth for a unit of length.
        radiance: of white.
        colour: ``(p, 3)`` written where rays are, and so are the next two.
        alpha: ``(p,)``.
        depth: ``(p,)`` m, where anything was seen.
    """
    for n in range(len(pixels)):
        at, share = pixels[n], radiance * cover[n]
        colour[at, 0], colour[at, 1], colour[at, 2] = (
            sums[n, 0] * share,
            sums[n, 1] * share,
            sums[n, 2] * share,
        )
        alpha[at] = min(sums[n, 3], 1.0) * cover[n]
        if sums[n, 3] > 0.0:
            depth[at] = sums[n, 4] / sums[n, 3] * slant[n]
