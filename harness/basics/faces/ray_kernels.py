"""Rays through a grid of faces: what each meets first, and whether it meets anything."""

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.ray_triangle import ON_EDGE, meeting

Grid = tuple[FloatArray, float, IntArray, IntArray, IntArray]
"""Origin, cell, shape, starts and faces of a ``FaceGrid``."""

Hit = tuple[float, int, float, float]
"""Distance, face, and the weights of the face's second and third corner."""

_PADDING = 1e-6
"""Cells by which the box is widened: its outermost faces lie on its border."""


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
    """What one ray meets first farther than ``least`` m; the face -1 where that is nothing.

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
