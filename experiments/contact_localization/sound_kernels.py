"""The loops of the likelihood of sound: hypotheses by contacts by modes.

Every row of ``y`` and of the gains comes divided by its noise, so that the matrix of the angular
Gaussian is ``I + G G^T`` with a real ``(K, r)`` block ``G``, ``r`` at most ``MOST_RANK``; by Woodbury
and the determinant lemma only ``r`` by ``r`` systems are left.
"""

import numpy as np

from harness.arrays import AnyArray, FloatArray, IntArray
from harness.sim.compiled import compiled

MOST_RANK = 4
_TINY = 1.0e-12
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
def gains_at(shapes: AnyArray, samples: IntArray, blend: FloatArray, directions: FloatArray) -> FloatArray:
    """``(K, m)`` 1/sqrt(kg): how strongly each strike of one hypothesis moves each mode.

    Args:
        shapes: ``(n, m, 3)`` modes at the surface's samples.
        samples: ``(K, J)`` samples about the place that each strike hit.
        blend: ``(K, J)`` their shares in it.
        directions: ``(K, 3)`` unit, of the strikes.
    """
    strikes, about = samples.shape
    gains = np.zeros((strikes, shapes.shape[1]))
    for k in range(strikes):
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        for j in range(about):
            share = blend[k, j]
            if share > _LITTLE:
                for m in range(shapes.shape[1]):
                    shape = shapes[samples[k, j], m]
                    gains[k, m] += share * (shape[0] * x + shape[1] * y + shape[2] * z)
    return gains


@compiled
def angular_gaussian(
    gains: FloatArray, rows: FloatArray, real: FloatArray, imaginary: FloatArray, count: int
) -> float:
    """Log density of a complex direction, 0 for the even one.

    ``-log det A - count log(y^H A^-1 y)`` with ``A = I + G G^T``: the density of ``y / |y|`` up to its
    phase where ``y = (G a + e) c`` with normal ``a`` and ``e`` and any ``c`` (complex angular central
    Gaussian; Kent, Data analysis for shapes and images, JSPI 57, 1997).

    Args:
        gains: ``(K, r)`` gains of the group's modes, in units of the noise.
        rows: ``(K,)`` further factor of each row; 0 leaves the row out.
        real: ``(K,)`` real part of ``y``, of unit length together with the imaginary part.
        imaginary: ``(K,)``.
        count: rows that are not left out.
    """
    rank = gains.shape[1]
    inner = np.zeros((MOST_RANK, MOST_RANK))
    b = np.zeros(MOST_RANK)
    c = np.zeros(MOST_RANK)
    for k in range(gains.shape[0]):
        square = rows[k] * rows[k]
        for r in range(rank):
            b[r] += gains[k, r] * rows[k] * real[k]
            c[r] += gains[k, r] * rows[k] * imaginary[k]
            for s in range(r + 1):
                inner[r, s] += square * gains[k, r] * gains[k, s]
    log_det, explained = 0.0, 0.0
    # Cholesky of I + G^T G, solving forward for both right sides on the way.
    for r in range(rank):
        inner[r, r] += 1.0
        for s in range(r):
            for t in range(s):
                inner[r, s] -= inner[r, t] * inner[s, t]
            inner[r, s] /= inner[s, s]
            inner[r, r] -= inner[r, s] * inner[r, s]
            b[r] -= inner[r, s] * b[s]
            c[r] -= inner[r, s] * c[s]
        inner[r, r] = np.sqrt(inner[r, r])
        b[r] /= inner[r, r]
        c[r] /= inner[r, r]
        log_det += 2.0 * np.log(inner[r, r])
        explained += b[r] * b[r] + c[r] * c[r]
    return float(-log_det - count * np.log(max(1.0 - explained, _TINY)))


@compiled
def sound_scores(
    shapes: AnyArray,
    samples: IntArray,
    blend: FloatArray,
    directions: FloatArray,
    scales: FloatArray,
    rows: FloatArray,
    real: FloatArray,
    imaginary: FloatArray,
    counts: IntArray,
    offsets: FloatArray,
    pair_starts: IntArray,
    pair_groups: IntArray,
    group_starts: IntArray,
    shares: FloatArray,
    clutter: FloatArray,
    weights: FloatArray,
    log_scale_shares: FloatArray,
) -> FloatArray:
    """``(h,)`` nats of hypotheses.

    Args:
        shapes: ``(n, m, 3)`` modes at the surface's samples, groups of modes side by side.
        samples: ``(h, K, J)`` samples about the place that each strike of a hypothesis hit.
        blend: ``(h, K, J)`` their shares in it.
        directions: ``(h or 1, K, 3)`` unit, of the strikes.
        scales: ``(C, m)`` what makes a gain one of unit noise, under each of the spreads.
        rows: ``(C, P, K)`` further factor of each strike at each peak.
        real: ``(C, P, K)`` of the peaks' directions.
        imaginary: ``(C, P, K)``.
        counts: ``(P,)`` strikes that each peak was heard in.
        offsets: ``(C, P)`` nats of a spread at a peak, with the logarithm of the spread's own share.
        pair_starts: ``(P + 1,)`` first pair of each peak.
        pair_groups: ``(Q,)`` group of modes of each pair.
        group_starts: ``(G + 1,)`` first mode of each group.
        shares: ``(S, Q)`` prior share of a pair in its peak, under each frequency scale.
        clutter: ``(S, P)`` share left for anything else.
        weights: ``(P,)`` of the peaks.
        log_scale_shares: ``(S,)`` nats of each frequency scale.
    """
    hypotheses, strikes = samples.shape[0], samples.shape[1]
    spreads, modes = scales.shape
    peaks, scenarios = len(counts), len(log_scale_shares)
    result = np.empty(hypotheses)
    gains = np.empty((spreads, strikes, modes))
    fits = np.empty((len(pair_groups), spreads))
    totals = np.empty(scenarios)
    for h in range(hypotheses):
        struck = gains_at(shapes, samples[h], blend[h], directions[h if len(directions) > 1 else 0])
        for c in range(spreads):
            gains[c] = struck * scales[c]
        totals[:] = log_scale_shares
        for p in range(peaks):
            best = 0.0
            for q in range(pair_starts[p], pair_starts[p + 1]):
                first, last = group_starts[pair_groups[q]], group_starts[pair_groups[q] + 1]
                for c in range(spreads):
                    fits[q, c] = offsets[c, p] + angular_gaussian(
                        gains[c, :, first:last], rows[c, p], real[c, p], imaginary[c, p], counts[p]
                    )
                    best = max(best, fits[q, c])
            for q in range(pair_starts[p], pair_starts[p + 1]):
                fits[q, 0] = np.sum(np.exp(fits[q] - best))
            for s in range(scenarios):
                total = clutter[s, p] * np.exp(-best)
                for q in range(pair_starts[p], pair_starts[p + 1]):
                    total += shares[s, q] * fits[q, 0]
                totals[s] += weights[p] * (best + np.log(total))
        most = totals.max()
        result[h] = most + np.log(np.sum(np.exp(totals - most)))
    return result
