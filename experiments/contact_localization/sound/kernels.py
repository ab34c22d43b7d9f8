"""The loops that find a place's gains: samples about it, and how strongly a strike there moves each mode."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled

_FACING = 0.5
"""Cosine between a sample's normal and the way back of a hammer below which it strikes another face."""

_RIDGE, _REACH = 0.2, 1.0
"""Of the Gaussian's width: against samples in a row, and how far a place may lie from the samples' mean."""

_LITTLE, _FAR = 1.0e-3, 8.0
"""Shares below which a sample adds nothing, and nats behind the nearest sample's at which it has none."""


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
    directions: FloatArray,
    nearest: IntArray,
    places: FloatArray,
    normals: FloatArray,
    neighbours: AnyArray,
    count: int,
    width: float,
) -> tuple[IntArray, FloatArray]:
    """Samples about the places that a hammer strikes, and their shares: exact for what is linear across it.

    The samples face the hammer: beside a rim or a hole the nearest one often faces elsewhere. Where none
    does, the nearest has it all. Their mean under a Gaussian is a place of its own, up to half a spacing
    off, at random from one place to the next; the shares are therefore those of a plane fitted across the
    hammer (local linear regression), which may be negative. Beyond an edge the plane ends with the samples.

    Args:
        points: ``(n, 3)`` metres.
        directions: ``(n, 3)`` unit, of the hammer.
        nearest: ``(n,)`` the sample nearest to each.
        places: ``(s, 3)`` metres, of the samples.
        normals: ``(s, 3)`` unit, of the samples.
        neighbours: ``(s, >= count)`` of the samples, nearest first.
        count: samples that share a place at most.
        width: metres, one sigma of the Gaussian.

    Returns:
        ``(n, count)`` samples and ``(n, count)`` shares that sum to 1.
    """
    samples = np.empty((len(points), count), np.int64)
    shares = np.zeros((len(points), count))
    gaps, sides = np.empty((2, count)), np.empty((2, 3))
    for i in range(len(points)):
        samples[i] = nearest[i]
        found = _facing(directions[i], nearest[i], normals, neighbours, samples[i])
        if found == 0:
            shares[i, 0] = 1.0
            continue
        _across(directions[i], sides)
        for j in range(found):
            for side in range(2):
                gaps[side, j] = 0.0
                for d in range(3):
                    gaps[side, j] += sides[side, d] * (places[samples[i, j], d] - points[i, d])
        _gaussian(gaps[:, :found], width, shares[i, :found])
        _levelled(gaps[:, :found], width, shares[i, :found])
    return samples, shares


@compiled
def _facing(
    direction: FloatArray, first: int, normals: FloatArray, neighbours: AnyArray, samples: IntArray
) -> int:
    """Write the first sample and its neighbours that face a hammer, as many as there is room for."""
    found = 0
    for j in range(neighbours.shape[1] + 1):
        sample = first if j == 0 else neighbours[first, j - 1]
        facing = 0.0
        for d in range(3):
            facing -= normals[sample, d] * direction[d]
        if facing > _FACING:
            samples[found] = sample
            found += 1
            if found == len(samples):
                break
    return found


@compiled
def _across(direction: FloatArray, sides: FloatArray) -> None:
    """Write ``(2, 3)``: two unit vectors across a unit direction and each other (Duff, JCGT 6(1), 2017)."""
    x, y, z = direction[0], direction[1], direction[2]
    sign = 1.0 if z >= 0.0 else -1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    sides[0, 0], sides[0, 1], sides[0, 2] = 1.0 + sign * x * x * a, sign * b, -sign * x
    sides[1, 0], sides[1, 1], sides[1, 2] = b, sign + y * y * a, -y


@compiled
def _gaussian(gaps: FloatArray, width: float, shares: FloatArray) -> None:
    """Write the ``(count,)`` shares of samples at ``(2, count)`` gaps in metres, summing to 1."""
    closest, total = np.inf, 0.0
    for j in range(len(shares)):
        shares[j] = gaps[0, j] ** 2 + gaps[1, j] ** 2
        closest = min(closest, shares[j])
    for j in range(len(shares)):
        nats = 0.5 * (shares[j] - closest) / width**2
        shares[j] = np.exp(-nats) if nats < _FAR else 0.0
        total += shares[j]
    for j in range(len(shares)):
        shares[j] /= total


@compiled
def _levelled(gaps: FloatArray, width: float, shares: FloatArray) -> None:
    """Change shares so that the samples' mean is the place itself: times ``1 - (gap - mean) C^-1 mean``.

    ``C`` is the covariance of the gaps, with a ridge against samples in a row.
    """
    mean0, mean1 = 0.0, 0.0
    for j in range(len(shares)):
        mean0 += shares[j] * gaps[0, j]
        mean1 += shares[j] * gaps[1, j]
    c00, c01, c11 = (_RIDGE * width) ** 2, 0.0, (_RIDGE * width) ** 2
    for j in range(len(shares)):
        x, y = gaps[0, j] - mean0, gaps[1, j] - mean1
        c00 += shares[j] * x * x
        c01 += shares[j] * x * y
        c11 += shares[j] * y * y
    within = min(1.0, _REACH * width / max(np.hypot(mean0, mean1), 1.0e-9))
    factor = within / (c00 * c11 - c01 * c01)
    slope0 = factor * (c11 * mean0 - c01 * mean1)
    slope1 = factor * (c00 * mean1 - c01 * mean0)
    for j in range(len(shares)):
        shares[j] *= 1.0 - (gaps[0, j] - mean0) * slope0 - (gaps[1, j] - mean1) * slope1


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
            if abs(share) > _LITTLE:
                row = shapes[samples[k, j]]
                for r in range(len(first)):
                    for i in range(3 * first[r], 3 * last[r]):
                        blended[i] += share * row[i]
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        for r in range(len(first)):
            for m in range(first[r], last[r]):
                gains[m, k] = blended[3 * m] * x + blended[3 * m + 1] * y + blended[3 * m + 2] * z
