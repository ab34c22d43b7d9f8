"""Where rays meet the surface: the point, its normal, and whether a lamp far away is seen from there.

The outline of a picture knows which face each ray meets, so that no ray is followed. All rays towards a lamp
are parallel, so that what is in the light's way is looked up on the plane across it: faces are projected
along the light once for a lamp, and listed by square cells of that plane. Of the faces of one cell those
stop a point's light that cover it and are nearer to the lamp.

Light that leaves a point outside of a closed surface and is stopped enters the surface first, through a face
that looks away from the lamp: such are all that must be listed for it, and few points have one above them. A
point's own face is one of them if the point was lifted from it: what enters there leaves through another.
"""

import math
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.ray_mesh import LEAST
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage import Contours, Outline
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.lambert import cosine_of, place_on

Surface = tuple[FloatArray, FloatArray, FloatArray]
"""``(m, 3, 3)`` m corners, ``(m, 3)`` unit normals of faces, and ``(m, 3, 3)`` of their corners."""


Eye = tuple[FloatArray, float, float, float, FloatArray]
"""A camera's place ``(3,)`` m, its focal length and axis x and y in pixels, and its rotation ``(3, 3)``."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """The points of a surface that rays meet, one a ray."""

    points: FloatArray  #: ``(n, 3)`` m, object frame.
    views: AnyArray  #: ``(n, 3)`` float32 unit, from the camera.
    light: AnyArray  #: ``(3,)`` float32 unit, towards the lamp.
    extras: AnyArray
    """``(n, 4)`` float32: 1 where the lamp is seen, else 0; the unit normal on the side seen."""


class HitSurface:
    """A mesh whose points are looked up for one picture after another."""

    def __init__(self, contours: Contours) -> None:
        mesh = contours.mesh
        self._mesh, self._closed = mesh, contours.closed
        normals = plain(mesh, (1.0, 1.0, 1.0)).normals
        self._surface: Surface = (mesh.corners, mesh.face_normals, normals)
        self._grid: LampGrid | None = None

    def points(self, camera: Pinhole, light: DirectionalLight, outline: Outline) -> SurfacePoints:
        """Find the points that an outline shows, one for each of its pixels.

        Args:
            camera: that looks.
            light: from far away.
            outline: of this mesh, in the camera's picture.
        """
        count = len(outline.faces)
        points, lifted, cosine = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
        views, extras = np.empty((count, 3), np.float32), np.empty((count, 4), np.float32)
        rotation = np.ascontiguousarray(camera.object_from_camera[:3, :3])
        eye: Eye = (camera.eye, camera.focal_px, *camera.centre_px, rotation)
        lamp, size = np.array(light.direction, np.float64), self._mesh.diagonal
        _find_points(
            outline.places,
            outline.faces,
            eye,
            self._surface,
            lamp,
            size,
            points,
            views,
            lifted,
            cosine,
            extras,
        )
        extras[:, 0] = self._listed(lamp, camera.eye).sees(lifted, LEAST * size, outline.faces, cosine)
        return SurfacePoints(points, views, lamp.astype(np.float32), extras)

    def _listed(self, lamp: FloatArray, eye: FloatArray) -> "LampGrid":
        """List the faces as a lamp sees them, again if it moved, or the eye from outside of the mesh into it.

        What is seen from outside of a closed surface is seen on its outside.
        """
        low, high = self._mesh.bounds
        from_outside = self._closed and bool(((eye < low) | (eye > high)).any())
        kept = self._grid
        if kept is None or not np.array_equal(kept.turn[:, 2], lamp) or kept.from_outside != from_outside:
            kept = self._grid = LampGrid.of(self._mesh, lamp, from_outside=from_outside)
        return kept


@compiled
def _find_points(
    places: AnyArray,
    faces: AnyArray,
    camera: Eye,
    surface: Surface,
    lamp: FloatArray,
    size: float,
    points: FloatArray,
    views: AnyArray,
    lifted: FloatArray,
    cosine: FloatArray,
    extras: AnyArray,
) -> None:
    """Fill in the points of ``SurfacePoints``, and all of ``extras`` but whether the lamp is seen.

    Args:
        places: ``(n, 2)`` x and y in the picture, pixels.
        faces: ``(n,)`` which face is in front there.
        camera: that looks.
        surface: of the mesh.
        lamp: ``(3,)`` unit, towards it.
        size: m, of the mesh.
        points: ``(n, 3)`` m, written.
        views: ``(n, 3)`` unit, written.
        lifted: ``(n, 3)`` m, written: from where the lamp is looked for.
        cosine: ``(n,)`` written: between normal and lamp, 0 where a point looks away.
        extras: ``(n, 4)``, of which the last three are written.
    """
    eye, focal, x, y, rotation = camera
    corners, flats, normals = surface
    light = (lamp[0], lamp[1], lamp[2])
    for n in range(len(places)):
        f, a, b = faces[n], (places[n, 0] - x) / focal, (places[n, 1] - y) / focal
        unit = 1.0 / math.sqrt(a * a + b * b + 1.0)
        dx = unit * (rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2])
        dy = unit * (rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2])
        dz = unit * (rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2])
        # The line of the ray and the face's plane, after Moeller and Trumbore. A ray on an edge passes by its
        # face by what rounding has done to its place, and is moved to it.
        ox, oy, oz = corners[f, 0, 0], corners[f, 0, 1], corners[f, 0, 2]
        ax, ay, az = corners[f, 1, 0] - ox, corners[f, 1, 1] - oy, corners[f, 1, 2] - oz
        bx, by, bz = corners[f, 2, 0] - ox, corners[f, 2, 1] - oy, corners[f, 2, 2] - oz
        px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
        volume = ax * px + ay * py + az * pz
        share = 1.0 / volume if volume != 0.0 else 0.0
        sx, sy, sz = eye[0] - ox, eye[1] - oy, eye[2] - oz
        qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
        u = min(max((sx * px + sy * py + sz * pz) * share, 0.0), 1.0)
        v = min(max((dx * qx + dy * qy + dz * qz) * share, 0.0), 1.0 - u)
        point, facing, flat, above = place_on(f, u, v, (dx, dy, dz), corners, flats, normals)
        cosine[n] = cosine_of(light, point, facing, flat, above, size)
        points[n, 0], points[n, 1], points[n, 2] = point
        views[n, 0], views[n, 1], views[n, 2] = dx, dy, dz
        lifted[n, 0], lifted[n, 1], lifted[n, 2] = above
        extras[n, 1], extras[n, 2], extras[n, 3] = facing


_ON_EDGE = 1e-9
"""Share of a face by which it is widened, as in ``ray_kernels``."""

_WIDER = 1e-6
"""Cells by which a face is widened where it is listed."""

_ALONG = 0.35
"""Cells along the grid for the root of the number of faces: more take longer to list, fewer to look up."""

_MOST = 32
"""Lists that a face is in, in the mean."""


Lists = tuple[
    FloatArray, FloatArray, float, int, AnyArray, FloatArray, AnyArray, FloatArray, FloatArray, AnyArray
]
"""Of a ``LampGrid``: turn, low, cell, columns, starts, most, listed, tops, turned and faces."""


@dataclass(frozen=True, eq=False)
class LampGrid:
    """The faces of a mesh as a lamp sees them."""

    turn: FloatArray
    """``(3, 3)``: columns are two directions across the light, and the one towards the lamp."""
    low: FloatArray  #: ``(2,)`` m, least corner of the grid across the light.
    cell: float  #: m, edge of a cell.
    starts: AnyArray  #: ``(rows * columns + 1,)`` int32: where each cell's list begins.
    most: FloatArray  #: ``(rows * columns,)`` m: how near to the lamp any face of a cell reaches.
    listed: AnyArray  #: int32 faces.
    tops: FloatArray  #: ``(listed,)`` m: how near to the lamp each listed one reaches.
    turned: FloatArray  #: ``(n, 3)`` m, the mesh's vertices.
    faces: AnyArray  #: ``(m, 3)`` the mesh's.
    columns: int  #: cells along the second direction.
    from_outside: bool  #: whether only such faces are listed as look away from the lamp.

    @classmethod
    def of(
        cls, mesh: Mesh, lamp: FloatArray, along: int | None = None, from_outside: bool = False
    ) -> "LampGrid":
        """A mesh under a lamp.

        Args:
            mesh: in metres.
            lamp: ``(3,)`` unit, towards it.
            along: cells along the longer side; None for a few faces in each.
            from_outside: whether the mesh is closed and only places outside of it will be asked for.
        """
        # A rotation whose last column is towards the lamp.
        aside, count = np.zeros(3), len(mesh.faces)
        aside[np.argmin(np.abs(lamp))] = 1.0
        one = np.cross(lamp, aside)
        one /= np.linalg.norm(one)
        turn = np.ascontiguousarray(np.column_stack([one, np.cross(lamp, one), lamp]))
        turned = mesh.vertices @ turn
        least, most = _reach(turned)
        side = max(1, int(_ALONG * np.sqrt(count))) if along is None else along
        spans = np.empty((count, 4), np.int32)
        while True:
            cell = max(float((most - least).max()) / side, np.finfo(np.float64).tiny)
            low = least - _WIDER * cell
            rows, columns = (np.floor((most - low) / cell).astype(np.int64) + 1).tolist()
            starts = np.zeros(rows * columns + 1, np.int32)
            _span(turned, mesh.faces, from_outside, low, cell, columns, starts, spans)
            # Slivers across the whole of it would be listed nearly everywhere.
            if along is not None or side == 1 or starts.sum() <= _MOST * count:
                break
            side //= 2
        starts = np.cumsum(starts, dtype=np.int32)
        highest, listed, tops = (
            np.full(rows * columns, -np.inf),
            np.empty(starts[-1], np.int32),
            np.empty(starts[-1]),
        )
        _list(turned, mesh.faces, spans, columns, starts, listed, tops, highest)
        return cls(turn, low, cell, starts, highest, listed, tops, turned, mesh.faces, columns, from_outside)

    @property
    def lists(self) -> Lists:
        """As the compiled loops take them."""
        return (
            *(self.turn, self.low, self.cell, self.columns, self.starts, self.most, self.listed, self.tops),
            *(self.turned, self.faces),
        )

    def sees(self, places: FloatArray, least: float, own: IntArray, faced: FloatArray) -> BoolArray:
        """Find where nothing is between places and the lamp, of those that face it: ``(n,)``.

        Args:
            places: ``(n, 3)`` m.
            least: m, how much nearer to the lamp anything must be.
            own: ``(n,)`` face that each is on, which does not stop it.
            faced: ``(n,)`` cosine, 0 where a place looks away.
        """
        seen = np.empty(len(places), np.bool_)
        _sees(places, least, own, faced, self.from_outside, self.lists, seen)
        return seen


@compiled
def _reach(turned: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(2,)`` least and greatest places across the light."""
    least, most = np.full(2, np.inf), np.full(2, -np.inf)
    for n in range(len(turned)):
        for axis in range(2):
            least[axis], most[axis] = min(least[axis], turned[n, axis]), max(most[axis], turned[n, axis])
    return least, most


@compiled
def _span(
    turned: FloatArray,
    faces: IntArray,
    from_outside: bool,
    low: FloatArray,
    cell: float,
    columns: int,
    counts: AnyArray,
    spans: AnyArray,
) -> None:
    """Which cells faces touch.

    Args:
        turned: of ``LampGrid``.
        faces: of the mesh.
        from_outside: whether faces that look towards the lamp touch none.
        low: of the grid.
        cell: of the grid.
        columns: of the grid.
        counts: ``(rows * columns + 1,)`` raised by the faces of each cell, from its second on.
        spans: ``(m, 4)`` int32, written: first row and the one after the last, and so of columns.
    """
    share, rows = 1.0 / cell, (len(counts) - 1) // columns
    for m in range(len(faces)):
        a, b, c = faces[m, 0], faces[m, 1], faces[m, 2]
        x0, x1, x2, y0, y1, y2 = (
            turned[a, 0],
            turned[b, 0],
            turned[c, 0],
            turned[a, 1],
            turned[b, 1],
            turned[c, 1],
        )
        spans[m, 0] = spans[m, 1] = 0
        if from_outside and (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0) >= 0.0:
            continue
        i0, j0 = (min(x0, min(x1, x2)) - low[0]) * share, (min(y0, min(y1, y2)) - low[1]) * share
        i1, j1 = (max(x0, max(x1, x2)) - low[0]) * share, (max(y0, max(y1, y2)) - low[1]) * share
        spans[m, 0], spans[m, 1] = max(int(i0 - _WIDER), 0), min(int(i1 + _WIDER) + 1, rows)
        spans[m, 2], spans[m, 3] = max(int(j0 - _WIDER), 0), min(int(j1 + _WIDER) + 1, columns)
        for i in range(spans[m, 0], spans[m, 1]):
            for j in range(spans[m, 2], spans[m, 3]):
                counts[i * columns + j + 1] += 1


@compiled
def _list(
    turned: FloatArray,
    faces: IntArray,
    spans: AnyArray,
    columns: int,
    starts: AnyArray,
    listed: AnyArray,
    tops: FloatArray,
    most: FloatArray,
) -> None:
    """Fill in each cell's faces."""
    at = starts.copy()
    for m in range(len(faces)):
        if spans[m, 0] == spans[m, 1]:
            continue
        top = max(turned[faces[m, 0], 2], max(turned[faces[m, 1], 2], turned[faces[m, 2], 2]))
        for i in range(spans[m, 0], spans[m, 1]):
            for j in range(spans[m, 2], spans[m, 3]):
                n = at[i * columns + j]
                listed[n], tops[n] = m, top
                at[i * columns + j], most[i * columns + j] = n + 1, max(most[i * columns + j], top)


@compiled
def _sees(
    places: FloatArray,
    least: float,
    own: IntArray,
    faced: FloatArray,
    from_outside: bool,
    lists: Lists,
    seen: BoolArray,
) -> None:
    """See ``LampGrid.sees``."""
    turn, low, cell, columns, starts, most, listed, tops, turned, faces = lists
    rows, share = len(most) // columns, 1.0 / cell
    for n in range(len(places)):
        seen[n] = faced[n] > 0.0
        if not seen[n]:
            continue
        a, b, c = places[n, 0], places[n, 1], places[n, 2]
        x = a * turn[0, 0] + b * turn[1, 0] + c * turn[2, 0]
        y = a * turn[0, 1] + b * turn[1, 1] + c * turn[2, 1]
        above = a * turn[0, 2] + b * turn[1, 2] + c * turn[2, 2] + least
        i, j = int(np.floor((x - low[0]) * share)), int(np.floor((y - low[1]) * share))
        if not (0 <= i < rows and 0 <= j < columns) or above >= most[i * columns + j]:
            continue
        without = -1 if from_outside else own[n]
        for k in range(starts[i * columns + j], starts[i * columns + j + 1]):
            if tops[k] > above and listed[k] != without and _stops(turned, faces, listed[k], x, y, above):
                seen[n] = False
                break


@compiled
def _stops(turned: FloatArray, faces: IntArray, m: int, x: float, y: float, above: float) -> bool:
    """Whether a face covers a place across the light, higher than ``above``."""
    p, q, r = faces[m, 0], faces[m, 1], faces[m, 2]
    ax, ay = turned[q, 0] - turned[p, 0], turned[q, 1] - turned[p, 1]
    bx, by = turned[r, 0] - turned[p, 0], turned[r, 1] - turned[p, 1]
    area = ax * by - ay * bx
    if area == 0.0:
        return False
    sx, sy = x - turned[p, 0], y - turned[p, 1]
    u, v = (sx * by - sy * bx) / area, (ax * sy - ay * sx) / area
    # Written so that a NaN of a face seen edge-on stops nothing.
    if not (u >= -_ON_EDGE and v >= -_ON_EDGE and u + v <= 1.0 + _ON_EDGE):
        return False
    z = turned[p, 2]
    return bool(z + u * (turned[q, 2] - z) + v * (turned[r, 2] - z) > above)
