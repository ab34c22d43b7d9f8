"""A mesh prepared for ray casting: the face and point that a ray hits, and occlusion of lights.

Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, J. Graphics Tools 2(1), 1997. Another
order of its sums changes pictures and wall thicknesses in their last bits.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import OutOfDomain
from harness.basics.faces.face_clusters import build_face_grid
from harness.basics.mesh import Mesh

Meeting = tuple[float, float, float]
"""Distance along the ray, and the weights of the triangle's second and third corner."""

ON_EDGE = 1e-9
"""Relative margin of a triangle, so that no ray passes between two triangles that share an edge."""


Grid = tuple[FloatArray, float, IntArray, IntArray, IntArray]
"""Origin, cell, shape, starts and faces of a ``FaceGrid``."""

Hit = tuple[float, int, float, float]
"""Distance, face, and the weights of the face's second and third corner."""

_PADDING = 1e-6
"""Cells by which the box is widened: its outermost faces lie on its border."""


LEAST = 1e-7
"""Shares of the object's size: a blocker nearer than this to where a ray begins is that place itself."""


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays met first."""

    distance: FloatArray  #: ``(n,)`` m along the ray; +inf where nothing was met.
    face: IntArray  #: ``(n,)`` index; -1 where nothing was met.
    weights: FloatArray  #: ``(n, 2)`` of the face's second and third corner, 0 to 1.


class RayMesh:
    """A mesh prepared once for any number of rays; read-only and safe to share by threads.

    Faces stop rays from both sides.
    """

    mesh: Mesh  #: in metres, in the object's frame.
    least: float  #: m, how far from where a ray begins a blocker is one.

    def __init__(self, mesh: Mesh) -> None:
        """Sort the faces.

        Raises:
            MeshRefused: no face, or a corner that is not finite.
        """
        grid = build_face_grid(mesh)
        self.mesh = mesh
        self.least = LEAST * mesh.diagonal
        self._grid: Grid = (grid.origin, grid.cell, grid.shape, grid.starts, grid.faces)
        self._triangles = read_only(triangles_of(mesh.corners))

    def first_hits(self, origins: FloatArray, directions: FloatArray) -> Hits:
        """What rays meet first.

        Args:
            origins: ``(n, 3)`` m in the object's frame; or ``(3,)`` where all begin.
            directions: ``(n, 3)`` of any length but zero.

        Raises:
            OutOfDomain: a ray that is not finite, or has no direction.
        """
        unit = _unit(directions)
        starts = _finite(np.atleast_2d(origins), "where a ray begins")
        _require_match(len(starts), len(unit))
        count = len(unit)
        distance, face = np.empty(count), np.empty(count, np.int64)
        weights = np.empty((count, 2))
        first_hits(starts, unit, self._triangles, self._grid, distance, face, weights)
        # Rays on an edge are met by faces a little wider than they are.
        return Hits(distance, face, np.clip(weights, 0.0, 1.0))

    def free(self, origins: FloatArray, directions: FloatArray, from_faces: IntArray) -> BoolArray:
        """Whether the way is free: a light there is seen from here.

        Args:
            origins: ``(n, 3)`` m in the object's frame.
            directions: ``(n, 3)``, or ``(3,)`` for all, of any length but zero.
            from_faces: ``(n,)`` the face that each begins on, which does not stop it; -1 for none.

        Returns:
            ``(n,)``: nothing is met farther than ``least``.

        Raises:
            OutOfDomain: a ray that is not finite, or has no direction.
        """
        unit = _unit(np.atleast_2d(directions))
        starts = _finite(np.atleast_2d(origins), "where a ray begins")
        _require_match(len(unit), len(starts))
        if len(from_faces) != len(starts):
            raise OutOfDomain(
                f"{len(starts)} rays and {len(from_faces)} faces that they begin on; give one each"
            )
        return free_rays(starts, unit, from_faces, self.least, self._triangles, self._grid)


def _unit(directions: FloatArray) -> FloatArray:
    given = _finite(directions, "a ray's direction")
    # By the largest first: squares of very short and very long ones are no numbers.
    most = np.max(np.abs(given), axis=1, initial=0.0)
    if not np.all(most > 0.0):
        raise OutOfDomain(
            f"ray {int(np.argmin(most))} of {len(given)} has no direction; give one that is not zero"
        )
    scaled = given / most[:, None]
    unit: FloatArray = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return unit


def _finite(rows: FloatArray, what: str) -> FloatArray:
    given = np.ascontiguousarray(rows, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3:
        raise OutOfDomain(f"rays of shape {given.shape} were given; give (n, 3)")
    good = np.all(np.isfinite(given), axis=1)
    if not np.all(good):
        worst = int(np.argmin(good))
        raise OutOfDomain(
            f"{what} is {given[worst].tolist()} (ray {worst} of {len(given)}); give finite numbers"
        )
    return given


def _require_match(few: int, many: int) -> None:
    if few not in (1, many):
        raise OutOfDomain(f"{few} and {many} ends of rays were given; give as many of both, or one for all")


@compiled
def first_hits(
    origins: FloatArray,
    directions: FloatArray,
    triangles: FloatArray,
    grid: Grid,
    distance: FloatArray,
    face: IntArray,
    weights: FloatArray,
) -> None:
    """Fill in what each ray meets first.

    Args:
        origins: ``(n, 3)`` m, or ``(1, 3)`` for all.
        directions: ``(n, 3)`` unit.
        triangles: ``(m, 3, 3)``: first corner, and the ways from it to the second and third.
        grid: of the same faces.
        distance: ``(n,)`` m, overwritten; +inf where nothing is met.
        face: ``(n,)`` overwritten; -1 where nothing is met.
        weights: ``(n, 2)`` of the second and third corner, overwritten.
    """
    one = len(origins) == 1
    for n in range(len(directions)):
        origin = origins[0 if one else n]
        t, f, u, v = nearest(origin, directions[n], 0.0, -1, False, triangles, grid)
        distance[n], face[n], weights[n, 0], weights[n, 1] = t, f, u, v


@compiled
def free_rays(
    origins: FloatArray,
    directions: FloatArray,
    from_faces: IntArray,
    least: float,
    triangles: FloatArray,
    grid: Grid,
) -> BoolArray:
    """``(n,)`` whether rays meet nothing farther than ``least`` m, each its own face left out.

    ``directions`` may be ``(1, 3)`` for all; ``from_faces`` has -1 for a ray of no face.
    """
    free = np.empty(len(origins), np.bool_)
    one = len(directions) == 1
    for n in range(len(origins)):
        direction = directions[0 if one else n]
        free[n] = nearest(origins[n], direction, least, from_faces[n], True, triangles, grid)[1] < 0
    return free


@compiled
def nearest(
    origin: FloatArray,
    direction: FloatArray,
    least: float,
    without: int,
    any_will_do: bool,
    triangles: FloatArray,
    grid: Grid,
) -> Hit:
    """Find the first face that a ray hits beyond ``least`` m; face -1 if there is none.

    Cells are walked in the ray's order (Amanatides and Woo, Eurographics 1987). Where a border is
    met is computed from its place each time, not summed up, so that long walks do not drift.
    """
    corner, cell, shape, starts, faces = grid
    enters, leaves = _through_box(origin, direction, corner, cell, shape, least)
    if not enters <= leaves:
        return np.inf, -1, 0.0, 0.0
    at = np.empty(3, np.int64)
    border = np.empty(3)
    for axis in range(3):
        place = (origin[axis] + enters * direction[axis] - corner[axis]) / cell
        at[axis] = min(max(int(np.floor(place)), 0), shape[axis] - 1)
        border[axis] = _border(origin[axis], direction[axis], corner[axis], cell, at[axis])
    best: Hit = (np.inf, -1, 0.0, 0.0)
    while True:
        index = (at[0] * shape[1] + at[1]) * shape[2] + at[2]
        best = nearest_of(
            origin, direction, least, without, starts[index], starts[index + 1], faces, triangles, best
        )
        next_border = min(border[0], border[1], border[2])
        # A face may reach into cells farther on: what was met counts once no nearer one can come.
        if best[1] >= 0 and (any_will_do or best[0] <= next_border):
            return best
        axis = 0
        if border[1] == next_border:
            axis = 1
        if border[2] == next_border:
            axis = 2
        at[axis] += 1 if direction[axis] > 0.0 else -1
        if next_border == np.inf or at[axis] < 0 or at[axis] >= shape[axis]:
            return best
        border[axis] = _border(origin[axis], direction[axis], corner[axis], cell, at[axis])


@compiled
def _border(origin: float, direction: float, corner: float, cell: float, at: int) -> float:
    """Where along the ray a cell's far border is, along one axis."""
    if direction == 0.0:
        return np.inf
    return (corner + cell * (at + (1 if direction > 0.0 else 0)) - origin) / direction


@compiled
def _through_box(
    origin: FloatArray, direction: FloatArray, corner: FloatArray, cell: float, shape: IntArray, least: float
) -> tuple[float, float]:
    """Where a ray is inside the grid's box; the first number is the greater where it never is."""
    enters, leaves = least, np.inf
    for axis in range(3):
        low = corner[axis] - _PADDING * cell
        high = corner[axis] + (shape[axis] + _PADDING) * cell
        if direction[axis] == 0.0:
            # A quotient would be 0 times infinity for a ray along the border.
            if origin[axis] < low or origin[axis] > high:
                return np.inf, -np.inf
            continue
        a, b = (low - origin[axis]) / direction[axis], (high - origin[axis]) / direction[axis]
        enters, leaves = max(enters, min(a, b)), min(leaves, max(a, b))
    return enters, leaves


@compiled
def nearest_of(
    o: FloatArray,
    d: FloatArray,
    least: float,
    without: int,
    first: int,
    last: int,
    faces: IntArray,
    triangles: FloatArray,
    best: Hit,
) -> Hit:
    """The nearest of a cell's faces, or ``best``."""
    for k in range(first, last):
        f = faces[k]
        if f == without:
            continue
        t, u, v = meeting(o, d, triangles[f], ON_EDGE)
        if least < t < best[0]:
            best = (t, f, u, v)
    return best


@compiled
def meeting(o: FloatArray, d: FloatArray, p: FloatArray, wider: float) -> Meeting:
    """Where the line of a ray meets a triangle, from either side and in either direction.

    Args:
        o: ``(3,)`` m, where the ray begins.
        d: ``(3,)`` its direction, of which the distance is counted in lengths.
        p: ``(3, 3)`` m: first corner, and the ways from it to the second and third.
        wider: share of the triangle by which it is widened.

    Returns:
        The distance NaN where it passes by, or runs within the triangle's plane; NaN is neither near nor far.
    """
    px = d[1] * p[2, 2] - d[2] * p[2, 1]
    py = d[2] * p[2, 0] - d[0] * p[2, 2]
    pz = d[0] * p[2, 1] - d[1] * p[2, 0]
    volume = p[1, 0] * px + p[1, 1] * py + p[1, 2] * pz
    if volume == 0.0:
        return np.nan, 0.0, 0.0
    sx, sy, sz = o[0] - p[0, 0], o[1] - p[0, 1], o[2] - p[0, 2]
    u = (sx * px + sy * py + sz * pz) / volume
    # Written so that a NaN of a face seen edge-on is no hit.
    if not (-wider <= u <= 1.0 + wider):
        return np.nan, 0.0, 0.0
    qx = sy * p[1, 2] - sz * p[1, 1]
    qy = sz * p[1, 0] - sx * p[1, 2]
    qz = sx * p[1, 1] - sy * p[1, 0]
    v = (d[0] * qx + d[1] * qy + d[2] * qz) / volume
    if not (v >= -wider and u + v <= 1.0 + wider):
        return np.nan, 0.0, 0.0
    return (p[2, 0] * qx + p[2, 1] * qy + p[2, 2] * qz) / volume, u, v


def triangles_of(corners: FloatArray) -> FloatArray:
    """``(m, 3, 3)`` corners as ``meeting`` takes them: the first, and the ways from it to the others."""
    return np.stack([corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
