"""The loops that find a place's gains: the face it lies on, and how far a strike there moves each mode."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.basics.faces.nearest_kernels import nearest_on_triangle

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
