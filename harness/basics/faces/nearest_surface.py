"""A mesh prepared for many questions of how far places are from it, wherever they are."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.basics.faces.face_clusters import FaceGrid, build_face_grid
from harness.basics.faces.nearest_kernels import nearest_on_triangle, squared_gap
from harness.basics.mesh import Mesh

_SLACK = 1.0 + 1e-9
"""By which the nearest corner's distance is widened: the corner itself must be found again."""


@dataclass(frozen=True, eq=False)
class NearestSurface:
    """The exact nearest place of a mesh to any point; sorted on first use."""

    mesh: Mesh  #: m, one face or more, all corners finite.

    def places(self, points: FloatArray) -> tuple[FloatArray, IntArray]:
        """``(n, 3)`` m nearest places to ``(n, 3)`` finite points, and ``(n,)`` the faces that they are on.

        Raises:
            MeshRefused: a mesh without faces, or with a corner that is not finite.
        """
        grid = self._grid
        points = np.ascontiguousarray(points, dtype=np.float64)
        reach = np.asarray(self._corners.query(points)[0]) * _SLACK + np.finfo(float).tiny
        lists = (grid.origin, grid.cell, grid.shape, grid.starts, grid.faces)
        return _nearest_faces(points, reach, self.mesh.corners, self._spheres, *lists)

    def distances(self, points: FloatArray) -> FloatArray:
        """``(n,)`` m from ``(n, 3)`` finite points."""
        return np.asarray(np.linalg.norm(self.places(points)[0] - points, axis=1))

    @cached_property
    def _grid(self) -> FaceGrid:
        return build_face_grid(self.mesh)

    @cached_property
    def _spheres(self) -> FloatArray:
        """``(faces, 4)`` m, centre and radius of a sphere around each face, a rounding wider."""
        corners = self.mesh.corners
        centres = corners.mean(axis=1)
        radii = np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1))
        rounding = 1e-12 * np.abs(corners).max(axis=(1, 2))
        return np.column_stack([centres, radii * _SLACK + rounding])

    @cached_property
    def _corners(self) -> cKDTree:
        return cKDTree(self.mesh.vertices[np.unique(self.mesh.faces)])


@compiled
def _nearest_faces(
    points: FloatArray,
    reach: FloatArray,
    corners: FloatArray,
    spheres: FloatArray,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    starts: IntArray,
    faces: IntArray,
) -> tuple[FloatArray, IntArray]:
    """Places and faces; cells, and spheres around faces, beyond the best so far are passed over."""
    places, found = points.copy(), np.full(len(points), -1, np.int64)
    low, high, here = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    for n in range(len(points)):
        best = reach[n] ** 2
        within = reach[n] * _SLACK
        for axis in range(3):
            first = np.floor((points[n, axis] - reach[n] - origin[axis]) / cell)
            last = np.floor((points[n, axis] + reach[n] - origin[axis]) / cell)
            low[axis] = int(min(max(first, 0.0), shape[axis] - 1.0))
            high[axis] = int(min(max(last, 0.0), shape[axis] - 1.0))
        for i in range(low[0], high[0] + 1):
            x = _beyond(points[n, 0] - origin[0], i * cell, cell)
            for j in range(low[1], high[1] + 1):
                xy = x + _beyond(points[n, 1] - origin[1], j * cell, cell)
                if xy > best:
                    continue
                for k in range(low[2], high[2] + 1):
                    c = (i * shape[1] + j) * shape[2] + k
                    if starts[c] == starts[c + 1]:
                        continue
                    if xy + _beyond(points[n, 2] - origin[2], k * cell, cell) > best:
                        continue
                    for at in range(starts[c], starts[c + 1]):
                        f = faces[at]
                        if squared_gap(points[n], spheres[f]) > (within + spheres[f, 3]) ** 2:
                            continue
                        gap = nearest_on_triangle(points[n], corners[f], here)
                        if gap <= best:
                            best, found[n] = gap, f
                            within = np.sqrt(gap) * _SLACK
                            copy_line(places[n], here)
    return places, found


@compiled
def _beyond(place: float, start: float, length: float) -> float:
    """Square of how far a place is outside of a stretch, a rounding less."""
    outside = max(start - place, place - start - length) - 1e-9 * length
    return max(outside, 0.0) ** 2


def nearest_point(mesh: Mesh, point: FloatArray) -> FloatArray:
    """The ``(3,)`` point of the surface nearest to a ``(3,)`` point."""
    return np.asarray(_nearest(mesh.corners, np.ascontiguousarray(point)))


def plane_shares(corners: FloatArray, place: FloatArray) -> FloatArray:
    """``(3,)`` how much of each of ``(3, 3)`` corners a place in a triangle's plane is made of."""
    edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    second, third = np.linalg.lstsq(edges, place - corners[0], rcond=None)[0]
    return np.array([1.0 - second - third, second, third])


@compiled
def _nearest(corners: FloatArray, point: FloatArray) -> FloatArray:
    """Ericson, Real-Time Collision Detection, 2005, section 5.1.5.

    Not by ``nearest_on_triangle``, a rounding away from it: estimates are written with this one.
    """
    best: FloatArray = corners[0, 0].copy()
    best_gap = np.inf
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        ab, ac, ap = b - a, c - a, point - a
        d1, d2 = np.dot(ab, ap), np.dot(ac, ap)
        bp, cp = point - b, point - c
        d3, d4 = np.dot(ab, bp), np.dot(ac, bp)
        d5, d6 = np.dot(ab, cp), np.dot(ac, cp)
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if d1 <= 0.0 and d2 <= 0.0:
            close = a.copy()
        elif d3 >= 0.0 and d4 <= d3:
            close = b.copy()
        elif d6 >= 0.0 and d5 <= d6:
            close = c.copy()
        elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            close = a + ab * (d1 / (d1 - d3))
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            close = a + ac * (d2 / (d2 - d6))
        elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            close = b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
        else:
            scale = va + vb + vc
            close = a + ab * (vb / scale) + ac * (vc / scale)
        gap = np.sum((close - point) ** 2)
        if gap < best_gap:
            best, best_gap = close, gap
    return best
