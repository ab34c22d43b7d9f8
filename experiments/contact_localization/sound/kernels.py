"""The loops that find a place's gains: samples about it, and how strongly a strike there moves each mode."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled

_FACING = 0.5
"""Cosine between normals below which a sample is on another face."""

_LITTLE = 1.0e-3


@compiled
def nearest_in_table(points: FloatArray, nearest: AnyArray, origin: FloatArray, pitch: float) -> IntArray:
    """``(n,)`` sample of the voxel that each of ``(n, 3)`` points lies in; -1 where the table ends."""
    found = np.full(len(points), -1, np.int64)
    for i in range(len(points)):
        a = int(np.floor((points[i, 0] - origin[0]) / pitch))
        b = int(np.floor((points[i, 1] - origin[1]) / pitch))
        c = int(np.floor((points[i, 2] - origin[2]) / pitch))
        if 0 <= a < nearest.shape[0] and 0 <= b < nearest.shape[1] and 0 <= c < nearest.shape[2]:
            found[i] = nearest[a, b, c]
    return found


@compiled
def blend_of_samples(
    points: FloatArray,
    nearest: IntArray,
    places: FloatArray,
    normals: FloatArray,
    neighbours: AnyArray,
    count: int,
    width: float,
) -> tuple[IntArray, FloatArray]:
    """Samples about each place and their shares: a Gaussian of the distance, facing the same way.

    Args:
        points: ``(n, 3)`` metres.
        nearest: ``(n,)`` the sample nearest to each.
        places: ``(s, 3)`` metres, of the samples.
        normals: ``(s, 3)`` unit, of the samples.
        neighbours: ``(s, >= count - 1)`` of the samples, nearest first.
        count: samples that share a place.
        width: metres, one sigma of the Gaussian.

    Returns:
        ``(n, count)`` samples and ``(n, count)`` shares that sum to 1.
    """
    samples = np.empty((len(points), count), np.int64)
    shares = np.zeros((len(points), count))
    gaps = np.empty(count)
    for i in range(len(points)):
        first = nearest[i]
        for j in range(count):
            sample = first if j == 0 else neighbours[first, j - 1]
            samples[i, j] = sample
            facing, gap = 0.0, 0.0
            for d in range(3):
                facing += normals[first, d] * normals[sample, d]
                gap += (points[i, d] - places[sample, d]) ** 2
            gaps[j] = gap if facing > _FACING else np.inf
        closest = gaps.min()
        for j in range(count):
            shares[i, j] = np.exp(-0.5 * (gaps[j] - closest) / width**2)
        shares[i] /= shares[i].sum()
    return samples, shares


@compiled
def put_gains(
    gains: AnyArray,
    shapes: AnyArray,
    first: IntArray,
    last: IntArray,
    samples: IntArray,
    blend: FloatArray,
    directions: FloatArray,
    blended: FloatArray,
) -> None:
    """Set ``(m, K)`` gains, 1/sqrt(kg): how strongly strikes of one hypothesis move the modes asked for.

    Args:
        gains: written where a mode is asked for.
        shapes: ``(n, 3 m)`` modes at the surface's samples: a mode's three axes side by side.
        first: ``(R,)`` first mode of each run of modes that are asked for.
        last: ``(R,)`` mode behind the run's last.
        samples: ``(K, J)`` samples about the place that each strike hit.
        blend: ``(K, J)`` their shares in it.
        directions: ``(K, 3)`` unit, of the strikes.
        blended: ``(3 m,)``, written.
    """
    strikes, about = samples.shape
    for k in range(strikes):
        for r in range(len(first)):
            blended[3 * first[r] : 3 * last[r]] = 0.0
        for j in range(about):
            share = blend[k, j]
            if share > _LITTLE:
                row = shapes[samples[k, j]]
                for r in range(len(first)):
                    for i in range(3 * first[r], 3 * last[r]):
                        blended[i] += share * row[i]
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        for r in range(len(first)):
            for m in range(first[r], last[r]):
                gains[m, k] = blended[3 * m] * x + blended[3 * m + 1] * y + blended[3 * m + 2] * z
