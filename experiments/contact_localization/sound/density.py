"""How probable the sounds of hypotheses are: the angular Gaussian of each peak, and the sum over peaks.

Every row of ``y`` and of the gains comes divided by its noise, so that the matrix of the angular
Gaussian is ``I + G G^T`` with a real ``(K, r)`` block ``G``, ``r`` at most ``MOST_RANK``; by Woodbury
and the determinant lemma only ``r`` by ``r`` systems are left.

Hypotheses go side by side through every loop, so that one instruction serves several, and peaks are
weighed as densities: products, and a logarithm only before a product might leave a double's range.
"""

import numpy as np

from experiments.contact_localization.sound.gains import put_gains
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled

MOST_RANK = 4
MOST_NATS = 460.0
"""What one peak may say at most, that products of densities stay within a double."""

_FLOOR = 1.0e-12
_SIDE_BY_SIDE = 32
_ROOM = 690.0
"""Nats within which a product stays a normal double."""


@compiled
def add_densities(
    gains: AnyArray,
    rows: AnyArray,
    real: AnyArray,
    imaginary: AnyArray,
    count: int,
    floor: float,
    factor: float,
    work: FloatArray,
    total: AnyArray,
) -> None:
    """Add a factor times the densities of one complex direction, 1 for the even one, to each total.

    ``1 / det A / (y^H A^-1 y)^count`` with ``A = I + G G^T``: the density of ``y / |y|`` up to its
    phase where ``y = (G a + e) c`` with normal ``a`` and ``e`` and any ``c`` (complex angular central
    Gaussian; Kent, Data analysis for shapes and images, JSPI 57, 1997).

    Args:
        gains: ``(r, K, B)`` of the group's modes.
        rows: ``(K,)`` what makes a gain one of unit noise; 0 leaves a row out.
        real: ``(K,)`` real part of ``y``, of unit length together with the imaginary part.
        imaginary: ``(K,)``.
        count: rows that are not left out.
        floor: least ``y^H A^-1 y``, against a direction that fits to the last bit.
        factor: of the densities.
        work: ``(MOST_RANK + 2, MOST_RANK, B)``, written.
        total: ``(B,)``, added to.
    """
    rank, strikes, side = gains.shape
    inner, b, c = work[2:], work[0], work[1]
    work[: rank + 2, :rank] = 0.0
    for k in range(strikes):
        square, along, across = rows[k] * rows[k], rows[k] * real[k], rows[k] * imaginary[k]
        for r in range(rank):
            for h in range(side):
                g = gains[r, k, h]
                b[r, h] += g * along
                c[r, h] += g * across
                inner[r, r, h] += g * g * square
            for s in range(r):
                for h in range(side):
                    inner[r, s, h] += gains[r, k, h] * gains[s, k, h] * square
    # L D L^T of I + G^T G, solving forward for both right sides on the way.
    for r in range(rank):
        for s in range(r):
            for h in range(side):
                share = inner[r, s, h]
                for t in range(s):
                    share -= inner[r, t, h] * inner[s, t, h] * inner[t, t, h]
                share /= inner[s, s, h]
                inner[r, s, h] = share
                inner[r, r, h] -= share * share * inner[s, s, h]
                b[r, h] -= share * b[s, h]
                c[r, h] -= share * c[s, h]
        for h in range(side):
            inner[r, r, h] += 1.0
    for h in range(side):
        determinant, left = 1.0, 1.0
        for r in range(rank):
            determinant *= inner[r, r, h]
            left -= (b[r, h] * b[r, h] + c[r, h] * c[r, h]) / inner[r, r, h]
        left = max(left, floor)
        power = determinant
        for _ in range(count):
            power *= left
        total[h] += factor / power


@compiled
def _weigh_peak(
    gains: AnyArray,
    scales: FloatArray,
    rows: AnyArray,
    real: AnyArray,
    imaginary: AnyArray,
    count: int,
    floor: float,
    factors: AnyArray,
    groups: AnyArray,
    group_starts: IntArray,
    work: FloatArray,
    fits: AnyArray,
) -> None:
    """Set ``(Q, B)`` ``fits`` to each group's density at one peak, see ``sound_scores``."""
    scaled = np.empty(rows.shape[1])
    for q in range(len(groups)):
        first, last = group_starts[groups[q]], group_starts[groups[q] + 1]
        fits[q] = 0.0
        for c in range(len(factors)):
            for k in range(len(scaled)):
                scaled[k] = rows[c, k] * scales[c, first]
            add_densities(
                gains[first:last], scaled, real[c], imaginary[c], count, floor, factors[c], work, fits[q]
            )


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
    weight: float,
    log_scale_shares: FloatArray,
) -> FloatArray:
    """``(h,)`` nats of hypotheses.

    Args:
        shapes: ``(n, m, 3)`` modes at the surface's samples, groups of modes side by side.
        samples: ``(h, K, J)`` samples about the place that each strike of a hypothesis hit.
        blend: ``(h, K, J)`` their shares in it.
        directions: ``(h or 1, K, 3)`` unit, of the strikes.
        scales: ``(C, m)`` what makes a gain one of unit noise, under each of the spreads; one figure a
            group.
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
        weight: factor on the peaks' nats.
        log_scale_shares: ``(S,)`` nats of each frequency scale.
    """
    hypotheses, strikes = samples.shape[0], samples.shape[1]
    most = _most_nats(offsets)
    floors = np.maximum(_FLOOR, np.exp((most - MOST_NATS) / np.maximum(counts, 1)))
    most -= counts * np.log(floors)
    factors = np.exp(offsets)
    result = np.empty(hypotheses)
    flat = shapes.reshape(shapes.shape[0], -1)
    blended = np.zeros(flat.shape[1])
    first, last = _asked_for(pair_groups, group_starts)
    gains = np.zeros((shapes.shape[1], strikes, _SIDE_BY_SIDE))
    work = np.empty((MOST_RANK + 2, MOST_RANK, _SIDE_BY_SIDE))
    fits = np.empty((len(pair_groups), _SIDE_BY_SIDE))
    products = np.empty((len(log_scale_shares), _SIDE_BY_SIDE))
    nats = np.empty((len(log_scale_shares), _SIDE_BY_SIDE))
    for start in range(0, hypotheses, _SIDE_BY_SIDE):
        side = min(_SIDE_BY_SIDE, hypotheses - start)
        for h in range(side):
            at = start + h
            towards = directions[at if len(directions) > 1 else 0]
            put_gains(gains[:, :, h], flat, first, last, samples[at], blend[at], towards, blended)
        products[:] = 1.0
        nats[:] = 0.0
        room = _ROOM
        for p in range(len(counts)):
            pairs = slice(pair_starts[p], pair_starts[p + 1])
            _weigh_peak(
                gains,
                scales,
                rows[:, p],
                real[:, p],
                imaginary[:, p],
                counts[p],
                floors[p],
                factors[:, p],
                pair_groups[pairs],
                group_starts,
                work,
                fits[pairs],
            )
            if most[p] > room:
                nats += np.log(products)
                products[:] = 1.0
                room = _ROOM
            room -= most[p]
            _multiply(products, shares[:, pairs], clutter[:, p], fits[pairs])
        nats += np.log(products)
        result[start : start + side] = _mean_over_scales(nats[:, :side], weight, log_scale_shares)
    return result


@compiled
def _asked_for(groups: IntArray, group_starts: IntArray) -> tuple[IntArray, IntArray]:
    """``(R,)`` and ``(R,)``: runs of modes that any pair asks for, from the first to behind the last."""
    wanted = np.zeros(len(group_starts) + 1, np.bool_)
    for group in groups:
        wanted[group + 1] = True
    # Between groups where what is wanted begins or ends.
    edges = np.nonzero(wanted[1:] != wanted[:-1])[0]
    return group_starts[edges[0::2]], group_starts[edges[1::2]]


@compiled
def _most_nats(offsets: FloatArray) -> FloatArray:
    """``(P,)`` the greatest of ``(C, P)`` offsets at each peak, or 0, which is what clutter says."""
    most = np.zeros(offsets.shape[1])
    for c in range(offsets.shape[0]):
        most = np.maximum(most, offsets[c])
    return most


@compiled
def _multiply(products: FloatArray, shares: AnyArray, clutter: AnyArray, fits: AnyArray) -> None:
    """Multiply ``(S, B)`` by what a peak says under each scale: its groups' shares, or anything else."""
    one = np.empty(products.shape[1])
    for s in range(products.shape[0]):
        one[:] = clutter[s]
        for q in range(len(fits)):
            for h in range(len(one)):
                one[h] += shares[s, q] * fits[q, h]
        for h in range(len(one)):
            products[s, h] *= one[h]


@compiled
def _mean_over_scales(nats: AnyArray, weight: float, log_shares: FloatArray) -> FloatArray:
    """``(B,)`` nats of the mean of ``(S, B)`` weighted likelihoods."""
    result = np.empty(nats.shape[1])
    for h in range(len(result)):
        weighted = log_shares + weight * nats[:, h]
        most = weighted.max()
        result[h] = most + np.log(np.sum(np.exp(weighted - most)))
    return result
