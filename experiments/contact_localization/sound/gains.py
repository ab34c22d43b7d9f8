"""Tables of the loudness of each mode at each point of an object, for the search.

Every row of ``y`` and of the gains is divided by its noise, so that the matrix of the angular
Gaussian is ``I + G G^T`` with a real ``(K, r)`` block ``G``, ``r`` at most ``MOST_RANK``; by Woodbury
and the determinant lemma only ``r`` by ``r`` systems remain.

Loops are vectorised over hypotheses, and peaks are
combined as products of densities, with a logarithm only before a product might leave a double's range.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled, copy_line
from harness.basics.faces.nearest_kernels import nearest_on_triangle
from harness.basics.geometry import rotation_about
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface

_PAIR_POINTS = 500
"""Surface points on which two mode shapes are compared with their rotated copies."""

_PAIR_ANGLES = (0.13, 0.45, 0.9)
"""Rotations about the object's axis in rad, in no simple ratio to each other."""

_PAIR_COVERAGE = 0.7
"""Share of a rotated mode shape's square that the two shapes of a pair must span."""

_PAIR_EXCHANGE = 0.25
"""Share of a mode shape's square that some rotation must move into the other shape; less is no pair."""

_CANDIDATES = 16
"""Faces about a sample among which the one nearest to a place is looked for."""


@dataclass(frozen=True, eq=False)
class GainTable:
    """The modes at a surface's samples and at the nodes of their own mesh, made once an object."""

    surface: Surface  #: whose samples; gives the sample nearest to any place.
    shapes: AnyArray  #: ``(samples + nodes, m, 3)`` 1/sqrt(kg), float32.
    mean_squares: FloatArray  #: ``(m,)`` 1/kg: of each mode's gain along the normal, over the samples.
    nodes: FloatArray  #: ``(nodes, 3)`` metres.
    faces: IntArray  #: ``(f, 3)`` nodes of the mesh's surface.
    near_faces: AnyArray  #: ``(samples, k)`` faces about each sample.
    rotation_pairs: BoolArray
    """``(m - 1,)`` whether a mode and the next one are a pair that a rotation about the object's axis turns
    into each other (``find_rotation_pairs``)."""

    @property
    def at_samples(self) -> AnyArray:
        """``(samples, m, 3)`` of ``shapes``."""
        return self.shapes[: len(self.surface.points)]

    def nearest(self, points: FloatArray) -> IntArray:
        """``(n,)`` sample nearest to each of ``(n, 3)`` points in metres, however far."""
        table = self.surface.table
        found = nearest_in_table(np.ascontiguousarray(points), table.nearest, table.origin, table.pitch)
        far = np.nonzero(found < 0)[0]
        if len(far):
            found[far] = self.surface.tree.query(points[far])[1]
        return found

    def about(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """``(n, 3)`` rows of ``shapes`` about ``(n, 3)`` places in metres, and shares: linear on a face.

        Samples about a place would give it the shapes of one beside it, another one for every place, and
        near a rim those of a face that the hammer never meets; so it is nodes that are blended.
        """
        points = np.ascontiguousarray(points)
        nodes, shares = faces_about(points, self.nearest(points), self.near_faces, self.nodes, self.faces)
        return nodes + len(self.surface.points), shares


def gain_table(modes: Modes, surface: Surface) -> GainTable:
    """Tabulate the modes at a surface's samples and at their own nodes."""
    at_samples = modes.at(surface.points).astype(np.float32)
    along = np.einsum("smi,si->sm", at_samples, surface.normals.astype(np.float32))
    squares = np.asarray(np.mean(along**2, axis=0, dtype=np.float64))
    shapes = np.concatenate([at_samples, modes.shapes.astype(np.float32)])
    count = min(_CANDIDATES, len(modes.faces))
    middles = cKDTree(modes.points[modes.faces].mean(axis=1))
    near = np.asarray(middles.query(surface.points, k=count)[1], dtype=np.int32).reshape(-1, count)
    return GainTable(
        surface,
        read_only(shapes),
        read_only(squares),
        modes.points,
        modes.faces,
        read_only(near),
        read_only(find_rotation_pairs(modes, surface.points)),
    )


def find_rotation_pairs(modes: Modes, points: FloatArray) -> BoolArray:
    """Find neighbouring modes that are one pair of a round object: cos(n a) and sin(n a) about its axis.

    Small asymmetries, which a real object and its model do not share, decide where about the axis the nodal
    lines of such a pair lie, and split its frequencies.

    Args:
        modes: modes of the object, in ascending order of frequency.
        points: ``(n, 3)`` points of the surface in metres, evenly distributed.

    Returns:
        ``(m - 1,)`` for every mode but the last, whether it and the next one are such a pair.
    """
    count = len(modes.frequencies)
    if count < 2:
        return np.zeros(max(0, count - 1), np.bool_)
    spread = np.linspace(0, len(points) - 1, min(_PAIR_POINTS, len(points))).astype(np.int64)
    places, centre = points[spread], points.mean(axis=0)
    moments, axes = np.linalg.eigh(np.cov((points - centre).T))
    # The axis of a round object: the other two principal moments are the two nearest to each other.
    axis = axes[:, 2] if moments[1] - moments[0] < moments[2] - moments[1] else axes[:, 0]
    shapes = modes.at(places).transpose(1, 0, 2).reshape(count, -1)
    squares = (shapes**2).sum(axis=1)
    coverage, exchange = np.ones(count - 1), np.zeros(count - 1)
    overlap = (shapes[:-1] * shapes[1:]).sum(axis=1) / np.sqrt(squares[:-1] * squares[1:])
    for angle in _PAIR_ANGLES:
        turn = rotation_about(axis, angle)
        turned = modes.at((places - centre) @ turn.T + centre) @ turn
        turned = turned.transpose(1, 0, 2).reshape(count, -1)[:-1]
        lengths = np.sqrt((turned**2).sum(axis=1))
        own = (turned * shapes[:-1]).sum(axis=1) / (lengths * np.sqrt(squares[:-1]))
        other = (turned * shapes[1:]).sum(axis=1) / (lengths * np.sqrt(squares[1:]))
        across = (other - overlap * own) / np.sqrt(np.maximum(1.0 - overlap**2, 1e-6))
        coverage = np.minimum(coverage, own**2 + across**2)
        exchange = np.maximum(exchange, across**2)
    return np.asarray((coverage > _PAIR_COVERAGE) & (exchange > _PAIR_EXCHANGE))


_LITTLE = 1.0e-3
"""Share below which a place of the table adds nothing."""


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
def faces_about(
    points: FloatArray, nearest: IntArray, near_faces: AnyArray, corners: FloatArray, faces: AnyArray
) -> tuple[IntArray, FloatArray]:
    """The corners of the face that each place is nearest to, and their shares in the nearest place of it.

    Args:
        points: ``(n, 3)`` metres.
        nearest: ``(n,)`` the sample nearest to each.
        near_faces: ``(samples, k)`` faces about each sample.
        corners: ``(nodes, 3)`` metres.
        faces: ``(f, 3)`` nodes.

    Returns:
        ``(n, 3)`` nodes and ``(n, 3)`` shares from 0 to 1 that sum to 1.
    """
    nodes, shares = np.empty((len(points), 3), np.int64), np.empty((len(points), 3))
    triangle, here, foot = np.empty((3, 3)), np.empty(3), np.empty(3)
    for i in range(len(points)):
        best, face = np.inf, 0
        for j in range(near_faces.shape[1]):
            other = near_faces[nearest[i], j]
            for corner in range(3):
                copy_line(triangle[corner], corners[faces[other, corner]])
            gap = nearest_on_triangle(points[i], triangle, here)
            if gap < best:
                best, face = gap, other
                copy_line(foot, here)
        for corner in range(3):
            nodes[i, corner] = faces[face, corner]
            copy_line(triangle[corner], corners[faces[face, corner]])
        _put_shares(foot, triangle, shares[i])
    return nodes, shares


@compiled
def _put_shares(foot: FloatArray, triangle: FloatArray, shares: FloatArray) -> None:
    """Write the shares of a triangle's corners in a place of it; of one without area its first corner's."""
    aa, ab, bb, pa, pb = 0.0, 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        a, b = triangle[1, d] - triangle[0, d], triangle[2, d] - triangle[0, d]
        p = foot[d] - triangle[0, d]
        aa += a * a
        ab += a * b
        bb += b * b
        pa += p * a
        pb += p * b
    det = aa * bb - ab * ab
    if det > 0.0:
        shares[1] = min(max((bb * pa - ab * pb) / det, 0.0), 1.0)
        shares[2] = min(max((aa * pb - ab * pa) / det, 0.0), 1.0 - shares[1])
    else:
        shares[1] = shares[2] = 0.0
    shares[0] = 1.0 - shares[1] - shares[2]


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
        shapes: ``(n, 3 m)`` modes at the table's places: a mode's three axes side by side.
        first: ``(R,)`` first mode of each run of modes that are asked for.
        last: ``(R,)`` mode behind the run's last.
        samples: ``(K, J)`` places of the table about the one that each strike hit.
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


MOST_RANK = 4
MOST_NATS = 460.0
"""Largest log-likelihood of one peak, so that products of densities stay within a double."""

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
