"""A mesh's faces by the small cubes that they touch, for rays that know about where they meet it.

Rays of a picture meet a surface where its depth says: cubes of about a face's size ask few faces, and what is
empty is leapt over.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.faces.ray_kernels import Hit, nearest_of
from harness.basics.faces.ray_triangle import triangles_of
from harness.basics.mesh import Mesh
from harness.objectfile.vision.voxels import OUTSIDE, clamped, distances, entered, prepared, touches

ALONG = 128
"""Cubes along the longest side of the mesh's box."""

_BESIDE = 1e-3
"""Cubes between that box and the lattice's border."""

_WIDER = 1e-6
"""Of a cube: by which it is enlarged, as in ``touches``."""

Lists = tuple[FloatArray, float, AnyArray, AnyArray, AnyArray, AnyArray, FloatArray]
"""Least corner (m), edge (m), near, bricks, starts, faces and triangles of ``FaceCubes``."""


@dataclass(frozen=True, eq=False)
class FaceCubes:
    """Which faces touch each cube.

    Attributes:
        low: ``(3,)`` m, least corner of the lattice, object frame.
        edge: m, of a cube.
        near: ``(4 x + 2, 4 y + 2, 4 z + 2)`` as ``vision_voxels.distances`` of cubes that a face touches.
        bricks: ``(x, y, z)`` int32: number of each brick of 4 x 4 x 4 cubes that a face touches, else -1.
        starts: ``(64 bricks + 1,)`` int32: where each cube's list begins in ``faces``; cube (i, j, k) of a
            brick is its ``16 i + 4 j + k``-th.
        faces: int64 indices.
        triangles: ``(m, 3, 3)`` m: first corner of each face, and the ways from it to the others.
    """

    low: FloatArray
    edge: float
    near: AnyArray
    bricks: AnyArray
    starts: AnyArray
    faces: AnyArray
    triangles: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, along: int = ALONG) -> "FaceCubes":
        """The faces of a mesh, in metres.

        Args:
            mesh: of one face or more that is not a point.
            along: cubes along its longest side.
        """
        bounds, corners = mesh.bounds, mesh.corners
        edge = float((bounds[1] - bounds[0]).max()) / along
        low = bounds[0] - _BESIDE * edge
        sides = np.floor((bounds[1] - low) / edge + _BESIDE).astype(np.int64) // 4 + 1
        cubes, owners = _touched(np.ascontiguousarray((corners - low) / edge), 4 * sides)
        order = np.argsort(cubes, kind="stable")
        cubes, owners = cubes[order], owners[order]
        there, number = np.unique(cubes >> 6, return_inverse=True)
        bricks = np.full(int(sides.prod()), -1, np.int32)
        bricks[there] = np.arange(len(there), dtype=np.int32)
        counts = np.bincount(64 * number.reshape(-1) + (cubes & 63), minlength=64 * len(there))
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        triangles = triangles_of(corners)
        near = distances(_grid(cubes, sides))
        for each in (low, near, bricks, starts, owners, triangles):
            read_only(each)
        return cls(low, edge, near, bricks.reshape(sides), starts, owners, triangles)

    @property
    def lists(self) -> Lists:
        """As the compiled loops take them."""
        return self.low, self.edge, self.near, self.bricks, self.starts, self.faces, self.triangles


def _grid(cubes: IntArray, bricks: IntArray) -> BoolArray:
    """``(4 x, 4 y, 4 z)`` whether each cube is among some, which are counted brick by brick."""
    there = np.zeros((int(bricks.prod()), 64), np.bool_)
    there[cubes >> 6, cubes & 63] = True
    parts = there.reshape(*bricks, 4, 4, 4).transpose(0, 3, 1, 4, 2, 5)
    return np.ascontiguousarray(parts.reshape(4 * bricks))


@compiled
def _touched(corners: FloatArray, sides: IntArray) -> tuple[AnyArray, AnyArray]:
    """Cubes, counted brick by brick, and the face that touches each.

    Args:
        corners: ``(m, 3, 3)`` in cubes from the lattice's least corner.
        sides: ``(3,)`` cubes, multiples of four.
    """
    cubes, owners, count = np.empty(16 * len(corners), np.int64), np.empty(16 * len(corners), np.int64), 0
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for m in range(len(corners)):
        face = corners[m]
        for axis in range(3):
            least = min(face[0, axis], face[1, axis], face[2, axis]) - _WIDER
            most = max(face[0, axis], face[1, axis], face[2, axis]) + _WIDER
            low[axis] = min(max(int(np.floor(least)), 0), sides[axis] - 1)
            high[axis] = min(max(int(np.floor(most)), 0), sides[axis] - 1)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    if not touches(face, i + 0.5, j + 0.5, k + 0.5):
                        continue
                    if count == len(cubes):
                        cubes = np.concatenate((cubes, np.empty(count, np.int64)))
                        owners = np.concatenate((owners, np.empty(count, np.int64)))
                    brick = ((i >> 2) * (sides[1] >> 2) + (j >> 2)) * (sides[2] >> 2) + (k >> 2)
                    cubes[count] = (brick << 6) | ((i & 3) << 4) | ((j & 3) << 2) | (k & 3)
                    owners[count] = m
                    count += 1
    return cubes[:count], owners[:count]


@compiled
def first_met(
    eye: FloatArray,
    ways: FloatArray,
    begin: FloatArray,
    likely: AnyArray,
    lists: Lists,
    faces: IntArray,
    weights: FloatArray,
) -> None:
    """Fill in which face each ray meets first from ``begin`` on.

    Args:
        eye: ``(3,)`` m, where all rays begin.
        ways: ``(n, 3)`` unit.
        begin: ``(n,)`` m along each.
        likely: ``(n,)`` int32: the face that an outline knows each to meet; asked first. Or ``(0,)``.
        lists: of the mesh.
        faces: ``(n,)`` written; -1 where nothing is met.
        weights: ``(n, 2)`` of the face's second and third corner, 0 to 1, written.
    """
    nothing: Hit = (np.inf, -1, 0.0, 0.0)
    for n in range(len(ways)):
        hit = nothing
        if len(likely):
            hit = nearest_of(eye, ways[n], begin[n], -1, n, n + 1, likely, lists[6], nothing)
        if hit[1] < 0:
            hit = meet(eye, ways[n], begin[n], lists)
        _, faces[n], b, c = hit
        # Rays on an edge are met by faces a little wider than they are.
        weights[n, 0], weights[n, 1] = min(max(b, 0.0), 1.0), min(max(c, 0.0), 1.0)


@compiled
def meet(origin: FloatArray, way: FloatArray, least: float, lists: Lists) -> Hit:
    """What one ray meets first farther than ``least`` m; the face -1 where that is nothing.

    As ``vision_voxels.walk`` goes: borders from their own numbers, cubes by counting.
    """
    low, edge, near, bricks, firsts, faces, triangles = lists
    ex, ey, ez = (origin[0] - low[0]) / edge, (origin[1] - low[1]) / edge, (origin[2] - low[2]) / edge
    wx, wy, wz = way[0] / edge, way[1] / edge, way[2] / edge
    best: Hit = (np.inf, -1, 0.0, 0.0)
    nx, ny, nz = near.shape[0] - 2, near.shape[1] - 2, near.shape[2] - 2
    begin, end = entered((ex, ey, ez), (wx, wy, wz), (nx, ny, nz))
    (rx, ry, rz), (sx, sy, sz), (ux, uy, uz), leap = prepared((wx, wy, wz))
    t = max(begin, least)
    while t < end:
        vx = clamped(ex + t * wx, 0, nx - 1) + 1
        vy = clamped(ey + t * wy, 0, ny - 1) + 1
        vz = clamped(ez + t * wz, 0, nz - 1) + 1
        px = (vx + ux - ex) * rx if wx != 0.0 else np.inf
        py = (vy + uy - ey) * ry if wy != 0.0 else np.inf
        pz = (vz + uz - ez) * rz if wz != 0.0 else np.inf
        away = int(near[np.uint64(vx), np.uint64(vy), np.uint64(vz)])
        while away < 2:
            if away == 0:
                x, y, z = np.uint64(vx - 1), np.uint64(vy - 1), np.uint64(vz - 1)
                two, three = np.uint64(2), np.uint64(3)
                cube = 64 * bricks[x >> two, y >> two, z >> two]
                cube += int(((x & three) << np.uint64(4)) | ((y & three) << two) | (z & three))
                first, last = firsts[cube], firsts[cube + 1]
                best = nearest_of(origin, way, least, -1, first, last, faces, triangles, best)
                # A face may reach on into cubes farther on: what is met counts once none can be nearer.
                if best[1] >= 0 and best[0] <= min(px, min(py, pz)):
                    return best
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
        if away == OUTSIDE:
            break
        t += (away - 1) * leap
    return best
