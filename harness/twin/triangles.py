"""Exact questions put to the triangles of an object: what a convex body meets, what a line meets."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from harness.basics.arrays import FloatArray, read_only
from harness.basics.compiled import compiled, copy_line
from harness.basics.errors import MeshRefused
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh


@dataclass(frozen=True, eq=False)
class ConvexBody:
    """A convex body as its corners and its faces' planes, in its own frame."""

    vertices: FloatArray  #: ``(n, 3)`` m.
    planes: FloatArray
    """``(m, 4)``: unit outward normal and offset; a point inside has ``normal . point + offset <= 0``."""

    @classmethod
    def of_points(cls, vertices: FloatArray) -> "ConvexBody":
        """The convex hull of ``(n, 3)`` points."""
        hull = ConvexHull(vertices)
        return cls(vertices[hull.vertices], np.unique(hull.equations.round(12), axis=0))

    @classmethod
    def box(cls, low: FloatArray, high: FloatArray) -> "ConvexBody":
        """The box between two opposite corners, ``(3,)`` m each."""
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        return cls(corners, np.column_stack([normals, np.concatenate([-high, low])]))


@dataclass(frozen=True, eq=False)
class Solid:
    """The surface of an object, ready to be asked."""

    mesh: Mesh

    @cached_property
    def _corners(self) -> FloatArray:
        """``(m, 3, 3)`` m; a triangle without area is no surface and would divide by zero."""
        return read_only(np.ascontiguousarray(self.mesh.corners[self.mesh.face_areas > 0.0]))

    @cached_property
    def _boxes(self) -> tuple[FloatArray, FloatArray]:
        return read_only(self._corners.min(axis=1)), read_only(self._corners.max(axis=1))

    @cached_property
    def hull(self) -> FloatArray:
        """``(n, 3)`` m, the corners of the convex hull in the object's frame.

        Raises:
            MeshRefused: the surface is flat, so that no body stands on the bench.
        """
        places = self.mesh.vertices
        try:
            return read_only(places[ConvexHull(places).vertices])
        except QhullError as error:
            sides = 1e3 * np.ptp(places, axis=0)
            raise MeshRefused(
                f"the object's surface of {sides[0]:.3g} x {sides[1]:.3g} x {sides[2]:.3g} mm is flat: "
                "nothing stands on the bench that an arm may touch; give it a thickness in its file"
            ) from error

    def meets(self, body: ConvexBody, object_from_body: FloatArray, clearance: float) -> bool:
        """Whether any triangle comes within ``clearance`` m of a convex body.

        Beyond the corners and edges of the body, up to sqrt(3) times as far already counts.
        """
        planes = _moved(body.planes, object_from_body)
        planes[:, 3] -= clearance
        corners = apply(object_from_body, body.vertices)
        lows, highs = self._boxes
        low, high = corners.min(axis=0) - clearance, corners.max(axis=0) + clearance
        return bool(_meets(self._corners, lows, highs, planes, low, high))

    def least_along(self, body: ConvexBody, object_from_body: FloatArray) -> float:
        """The least z, in the body's frame, of all surface within a convex body; inf if there is none."""
        planes = _moved(body.planes, object_from_body)
        corners = apply(object_from_body, body.vertices)
        lows, highs = self._boxes
        axis = _moved(np.array([[0.0, 0.0, 1.0, 0.0]]), object_from_body)[0]
        low, high = corners.min(axis=0), corners.max(axis=0)
        return float(_least_along(self._corners, lows, highs, planes, low, high, axis))

    def first_hit(self, start: FloatArray, direction: FloatArray) -> float:
        """How far, in m, along a unit direction from ``(3,)`` the first triangle is; inf where it misses."""
        return float(_first_hit(self._corners, np.ascontiguousarray(start), np.ascontiguousarray(direction)))

    def nearest(self, point: FloatArray) -> FloatArray:
        """``(3,)`` m, the point of the surface nearest to ``(3,)`` m."""
        nearest: FloatArray = _nearest(self._corners, np.ascontiguousarray(point))
        return nearest


def _moved(planes_in_a: FloatArray, b_from_a: FloatArray) -> FloatArray:
    moved: FloatArray = planes_in_a @ inverse(b_from_a)
    return moved


@compiled
def _clip(polygon: FloatArray, spare: FloatArray, count: int, plane: FloatArray) -> int:
    """Cut a convex polygon by one plane, in place; its new number of corners (Sutherland, Hodgman 1974)."""
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here = plane[0] * polygon[i, 0] + plane[1] * polygon[i, 1] + plane[2] * polygon[i, 2] + plane[3]
        there = plane[0] * polygon[j, 0] + plane[1] * polygon[j, 1] + plane[2] * polygon[j, 2] + plane[3]
        if here <= 0.0:
            copy_line(spare[kept], polygon[i])
            kept += 1
        if (here < 0.0 < there) or (there < 0.0 < here):
            share = here / (here - there)
            for k in range(3):
                spare[kept, k] = polygon[i, k] + share * (polygon[j, k] - polygon[i, k])
            kept += 1
    for i in range(kept):
        copy_line(polygon[i], spare[i])
    return kept


@compiled
def _cut(corners: FloatArray, polygon: FloatArray, spare: FloatArray, planes: FloatArray) -> int:
    """Put the part of one triangle within all planes into ``polygon``; its number of corners."""
    for p in range(len(planes)):
        outside = True
        for c in range(3):
            reach = planes[p, 0] * corners[c, 0] + planes[p, 1] * corners[c, 1] + planes[p, 2] * corners[c, 2]
            outside = outside and reach + planes[p, 3] > 0.0
        if outside:
            return 0
    count = 3
    for c in range(count):
        copy_line(polygon[c], corners[c])
    for p in range(len(planes)):
        count = _clip(polygon, spare, count, planes[p])
        if count == 0:
            return 0
    return count


@compiled
def _apart(low: FloatArray, high: FloatArray, box_low: FloatArray, box_high: FloatArray) -> bool:
    apart = False
    for k in range(3):
        apart = apart or low[k] > box_high[k] or high[k] < box_low[k]
    return apart


@compiled
def _meets(
    corners: FloatArray,
    lows: FloatArray,
    highs: FloatArray,
    planes: FloatArray,
    box_low: FloatArray,
    box_high: FloatArray,
) -> bool:
    polygon, spare = np.empty((len(planes) + 4, 3)), np.empty((len(planes) + 4, 3))
    for f in range(len(corners)):
        if _apart(lows[f], highs[f], box_low, box_high):
            continue
        if _cut(corners[f], polygon, spare, planes) > 0:
            return True
    return False


@compiled
def _least_along(
    corners: FloatArray,
    lows: FloatArray,
    highs: FloatArray,
    planes: FloatArray,
    box_low: FloatArray,
    box_high: FloatArray,
    axis: FloatArray,
) -> float:
    polygon, spare = np.empty((len(planes) + 4, 3)), np.empty((len(planes) + 4, 3))
    least = np.inf
    for f in range(len(corners)):
        if _apart(lows[f], highs[f], box_low, box_high):
            continue
        for i in range(_cut(corners[f], polygon, spare, planes)):
            along = axis[0] * polygon[i, 0] + axis[1] * polygon[i, 1] + axis[2] * polygon[i, 2] + axis[3]
            least = min(least, along)
    return least


@compiled
def _cross(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """As ``np.cross``, without the messages about shapes that numba would compile for seconds."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def _first_hit(corners: FloatArray, start: FloatArray, direction: FloatArray) -> float:
    """Find the first hit of a ray from either side (Moeller and Trumbore, J. Graphics Tools 2(1), 1997).

    Not by ``harness.basics.faces.ray_mesh``: its sums are those of ``np.dot``, another rounding, and
    rehearsed contacts are written with these.
    """
    first, p, q = np.inf, np.empty(3), np.empty(3)
    for f in range(len(corners)):
        e1, e2 = corners[f, 1] - corners[f, 0], corners[f, 2] - corners[f, 0]
        _cross(direction, e2, p)
        volume = np.dot(e1, p)
        if volume == 0.0:
            continue
        s = start - corners[f, 0]
        u = np.dot(s, p) / volume
        if u < -1e-12 or u > 1.0 + 1e-12:
            continue
        _cross(s, e1, q)
        v = np.dot(direction, q) / volume
        if v < -1e-12 or u + v > 1.0 + 1e-12:
            continue
        along = np.dot(e2, q) / volume
        if 0.0 <= along < first:
            first = along
    return first


@compiled
def _nearest(corners: FloatArray, point: FloatArray) -> FloatArray:
    """Find the nearest point of a triangle (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).

    It uses barycentric weights, which differ by rounding from ``basics.faces.nearest_surface``; rehearsed
    contacts are written with these.
    """
    best, best_gap = corners[0, 0].copy(), np.inf
    for f in range(len(corners)):
        near = _nearest_on(corners[f], point)
        gap = np.sum((near - point) ** 2)
        if gap < best_gap:
            best, best_gap = near, gap
    closest: FloatArray = best
    return closest


@compiled
def _nearest_on(corners: FloatArray, point: FloatArray) -> FloatArray:
    a, b, c = corners[0], corners[1], corners[2]
    ab, ac = b - a, c - a
    d1, d2 = np.dot(ab, point - a), np.dot(ac, point - a)
    d3, d4 = np.dot(ab, point - b), np.dot(ac, point - b)
    d5, d6 = np.dot(ab, point - c), np.dot(ac, point - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    on_b, on_c = 0.0, 0.0  # weights of corners b and c
    if d1 <= 0.0 and d2 <= 0.0:
        on_b = 0.0
    elif d3 >= 0.0 and d4 <= d3:
        on_b = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        on_c = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        on_b = d1 / (d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        on_c = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        on_c = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        on_b = 1.0 - on_c
    else:
        on_b, on_c = vb / (va + vb + vc), vc / (va + vb + vc)
    near: FloatArray = a + on_b * ab + on_c * ac
    return near
