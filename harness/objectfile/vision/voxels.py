"""Which small cubes a triangle touches, and the way of a ray through those that some triangle does."""

import numpy as np
from scipy.ndimage import distance_transform_cdt

from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.basics.compiled import compiled

Three = FloatArray | tuple[float, float, float]
"""Numbers along x, y, z."""

Whole = tuple[int, int, int]
"""The same, whole."""

_WIDER = 1e-6
"""Of a voxel: by which it is enlarged, so that rounding leaves out no triangle that it touches."""

OUTSIDE = 255
"""In ``distances``: beyond the lattice."""

_LEAP = 1.0 - 1e-9
"""Of an empty voxel: what is leapt of it, so that rounding leads into no other."""


def distances(marked: BoolArray) -> AnyArray:
    """How far marked cubes are from each of a lattice, for rays that leap over what is empty.

    Args:
        marked: ``(x, y, z)``.

    Returns:
        ``(x + 2, y + 2, z + 2)`` uint8: cubes to the nearest marked one, the greatest of the three axes; 0 of
        a marked one, ``OUTSIDE`` in a layer around the lattice, 254 of what is as far or farther.
    """
    away = np.full(marked.shape, OUTSIDE - 1, np.uint8)
    if marked.any():
        away = np.minimum(distance_transform_cdt(~marked, "chessboard"), OUTSIDE - 1).astype(np.uint8)
    return np.pad(away, 1, constant_values=OUTSIDE)


@compiled
def touch_voxels(corners: FloatArray, words: AnyArray) -> None:
    """Mark every voxel that a triangle touches, after Akenine-Moeller (J. Graphics Tools 6(1), 2001).

    Args:
        corners: ``(m, 3, 3)`` in voxels from the lattice's least corner; what lies outside marks nothing.
        words: ``(x, y, z)`` uint64 of 4 x 4 x 4 voxels each, written.
    """
    shape = (4 * words.shape[0], 4 * words.shape[1], 4 * words.shape[2])
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for m in range(len(corners)):
        face = corners[m]
        for axis in range(3):
            least = min(face[0, axis], face[1, axis], face[2, axis]) - _WIDER
            most = max(face[0, axis], face[1, axis], face[2, axis]) + _WIDER
            low[axis] = int(min(max(np.floor(least), 0.0), shape[axis]))
            high[axis] = int(min(max(np.floor(most), -1.0), shape[axis] - 1))
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    if touches(face, i + 0.5, j + 0.5, k + 0.5):
                        bit = ((i & 3) << 4) | ((j & 3) << 2) | (k & 3)
                        words[i >> 2, j >> 2, k >> 2] |= np.uint64(1) << np.uint64(bit)


@compiled
def touches(face: FloatArray, x: float, y: float, z: float) -> bool:
    """Whether a triangle ``(3, 3)`` touches the unit cube around a place: no axis separates them."""
    half = 0.5 + _WIDER
    a = (face[0, 0] - x, face[0, 1] - y, face[0, 2] - z)
    b = (face[1, 0] - x, face[1, 1] - y, face[1, 2] - z)
    c = (face[2, 0] - x, face[2, 1] - y, face[2, 2] - z)
    for axis in range(3):
        if min(a[axis], b[axis], c[axis]) > half or max(a[axis], b[axis], c[axis]) < -half:
            return False
    e = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    f = (c[0] - b[0], c[1] - b[1], c[2] - b[2])
    g = (a[0] - c[0], a[1] - c[1], a[2] - c[2])
    nx, ny, nz = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
    if abs(nx * a[0] + ny * a[1] + nz * a[2]) > half * (abs(nx) + abs(ny) + abs(nz)):
        return False
    for edge in (e, f, g):
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            p, q = -edge[v], edge[u]
            reach = half * (abs(p) + abs(q))
            pa, pb, pc = p * a[u] + q * a[v], p * b[u] + q * b[v], p * c[u] + q * c[v]
            if min(pa, pb, pc) > reach or max(pa, pb, pc) < -reach:
                return False
    return True


@compiled
def entered(eye: Three, way: Three, sides: Whole) -> tuple[float, float]:
    """From where to where a ray is in a lattice of so many cubes; from infinity where it is not.

    A ray along a face of the box lies in it if its place does: nothing is multiplied by infinity.
    """
    begin, end = 0.0, np.inf
    for axis in range(3):
        if way[axis] == 0.0:
            if not 0.0 <= eye[axis] <= sides[axis]:
                return np.inf, np.inf
        else:
            a, b = -eye[axis] / way[axis], (sides[axis] - eye[axis]) / way[axis]
            begin, end = max(begin, min(a, b)), min(end, max(a, b))
    return (begin, end) if begin < end else (np.inf, np.inf)


@compiled
def clamped(place: float, least: int, most: int) -> int:
    """The whole number below a place, from the least to the most."""
    return int(min(max(np.floor(place), least), most))


@compiled
def prepared(way: Three) -> tuple[tuple[float, float, float], Whole, Whole, float]:
    """Of a ray through cubes counted from 1, as ``near`` has them.

    Returns:
        One over the way, an infinity (never to be multiplied) where there is none; the step to the next cube;
        what the border ahead is at more than a cube's number; length of a leap over one empty cube.
    """
    wx, wy, wz = way
    rx = 1.0 / wx if wx != 0.0 else np.inf
    ry = 1.0 / wy if wy != 0.0 else np.inf
    rz = 1.0 / wz if wz != 0.0 else np.inf
    steps = ((1 if wx > 0.0 else -1), (1 if wy > 0.0 else -1), (1 if wz > 0.0 else -1))
    ahead = ((0 if wx > 0.0 else -1), (0 if wy > 0.0 else -1), (0 if wz > 0.0 else -1))
    return (rx, ry, rz), steps, ahead, _LEAP * min(abs(rx), min(abs(ry), abs(rz)))


@compiled
def walk(
    eye: FloatArray, way: FloatArray, start: float, near: AnyArray, runs: FloatArray
) -> tuple[int, float]:
    """The stretches of a ray within marked voxels, from ``start`` on, in order.

    What is empty is leapt over, as far as the nearest marked voxel is away in every direction. Beside marked
    voxels borders are computed from their own numbers, never summed up, and voxels entered by counting, so
    that a ray along a face stays in one of its two voxels and no rounding leaves it in none. Stretches
    without a length are left out: who goes on where one ended always gets farther.

    Args:
        eye: ``(3,)`` in voxels.
        way: ``(3,)`` voxels for a unit of length, not zero; lengths are in that unit.
        start: length from which on.
        near: ``Shell.near``.
        runs: ``(n, 2)`` from and to, written.

    Returns:
        How many stretches there are in ``runs``, and from where there may be more; inf for no more.
    """
    ex, ey, ez = eye[0], eye[1], eye[2]
    wx, wy, wz = way[0], way[1], way[2]
    nx, ny, nz = near.shape[0] - 2, near.shape[1] - 2, near.shape[2] - 2
    begin, end = entered((ex, ey, ez), (wx, wy, wz), (nx, ny, nz))
    (rx, ry, rz), (sx, sy, sz), (ux, uy, uz), leap = prepared((wx, wy, wz))
    t, count = max(begin, start), 0
    while t < end:
        vx = clamped(ex + t * wx, 0, nx - 1) + 1
        vy = clamped(ey + t * wy, 0, ny - 1) + 1
        vz = clamped(ez + t * wz, 0, nz - 1) + 1
        px = (vx + ux - ex) * rx if wx != 0.0 else np.inf
        py = (vy + uy - ey) * ry if wy != 0.0 else np.inf
        pz = (vz + uz - ez) * rz if wz != 0.0 else np.inf
        away, opened, is_open = int(near[np.uint64(vx), np.uint64(vy), np.uint64(vz)]), t, False
        while away < 2:
            if away == 0:
                if not is_open:
                    is_open, opened = True, t
            elif is_open:
                if min(t, end) > opened:
                    break
                is_open = False
            if px <= py and px <= pz:
                t, vx = max(t, px), vx + sx
                px = (vx + ux - ex) * rx
            elif py <= pz:
                t, vy = max(t, py), vy + sy
                py = (vy + uy - ey) * ry
            else:
                t, vz = max(t, pz), vz + sz
                pz = (vz + uz - ez) * rz
            away = int(near[np.uint64(vx), np.uint64(vy), np.uint64(vz)])
        if is_open and min(t, end) > opened:
            runs[count, 0], runs[count, 1] = opened, min(t, end)
            count += 1
            if count == len(runs):
                return count, (t if t < end else np.inf)
        if away == OUTSIDE:
            break
        t += max(away - 1, 0) * leap
    return count, np.inf
