"""Lines against all triangles of a surface: what is open to the room, inside, or behind a wall."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.ray_mesh import ON_EDGE, meeting, triangles_of

_DIRECTIONS = 12
_FACES_ASKED = 48


def openness(faces: IntArray, corners: FloatArray, seed: int = 0) -> float:
    """How much more of the room the front of some faces sees than their back.

    Args:
        faces: ``(n,)`` indices of the faces asked about; at most 48 of them are drawn, by area.
        corners: ``(m, 3, 3)`` of the whole surface, which blocks the view.
        seed: of the draw.

    Returns:
        -1 to 1: the share of free directions before the faces less the share behind them.
    """
    rng = np.random.default_rng(seed)
    cross = np.cross(corners[faces, 1] - corners[faces, 0], corners[faces, 2] - corners[faces, 0])
    area = np.linalg.norm(cross, axis=1)
    picked = rng.choice(len(faces), min(_FACES_ASKED, len(faces)), p=area / area.sum())
    normal = np.repeat(cross[picked] / area[picked, None], _DIRECTIONS, axis=0)
    centre = np.repeat(corners[faces[picked]].mean(axis=1), _DIRECTIONS, axis=0)
    # A unit normal plus a point on the unit sphere is a cosine-weighted direction.
    ball = rng.standard_normal(normal.shape)
    away = normal + 0.999 * ball / np.linalg.norm(ball, axis=1)[:, None]
    lift = 1e-6 * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    triangles = triangles_of(corners)
    front = _escapes(centre + lift * normal, away, triangles).mean()
    back = _escapes(centre - lift * normal, -away, triangles).mean()
    return float(front - back)


def is_inside(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Whether ``(n, 3)`` points lie inside a closed surface of ``(m, 3, 3)`` corners, 1.0 or 0.0."""
    # An irrational direction passes through edges of a modelled object almost never.
    direction = np.array([0.5773103, 0.3219714, 0.7503127])
    inside: FloatArray = (_crossings(points, direction, triangles_of(corners)) % 2).astype(np.float64)
    return inside


def first_distances(origins: FloatArray, directions: FloatArray, corners: FloatArray) -> FloatArray:
    """``(n,)`` how far along each ray the first triangle is; +inf where there is none.

    Args:
        origins: ``(n, 3)`` m.
        directions: ``(n, 3)`` unit, taken as they are.
        corners: ``(m, 3, 3)`` m.
    """
    return np.asarray(_first(origins, directions, triangles_of(corners)))


@compiled
def _first(origins: FloatArray, directions: FloatArray, triangles: FloatArray) -> FloatArray:
    far = np.full(len(origins), np.inf)
    for n in range(len(origins)):
        for f in range(len(triangles)):
            t = meeting(origins[n], directions[n], triangles[f], ON_EDGE)[0]
            if 0.0 < t < far[n]:
                far[n] = t
    return far


@compiled
def _hits(origin: FloatArray, direction: FloatArray, triangles: FloatArray, first_only: bool) -> int:
    """Triangles that a ray crosses; as large as they are, so that none of two is counted twice."""
    count = 0
    for k in range(len(triangles)):
        if meeting(origin, direction, triangles[k], 0.0)[0] > 0.0:
            count += 1
            if first_only:
                return count
    return count


@compiled
def _escapes(origins: FloatArray, directions: FloatArray, triangles: FloatArray) -> IntArray:
    free = np.zeros(len(origins), np.int64)
    for i in range(len(origins)):
        free[i] = _hits(origins[i], directions[i], triangles, True) == 0
    return free


@compiled
def _crossings(points: FloatArray, direction: FloatArray, triangles: FloatArray) -> IntArray:
    count = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        count[i] = _hits(points[i], direction, triangles, False)
    return count


@compiled
def column_crossings(
    corners: FloatArray, low: FloatArray, pitch: FloatArray, sides: IntArray
) -> tuple[IntArray, FloatArray, IntArray]:
    """Where vertical lines on a grid cross the faces.

    A vertical line needs no ray: two of a face's coordinates say which lines cross it, without trying the
    others.

    Args:
        corners: ``(m, 3, 3)`` m.
        low: ``(2,)`` m, x and y of the first line.
        pitch: ``(2,)`` m between the lines.
        sides: ``(2,)`` how many lines.

    Returns:
        Of each crossing the line, the height, and +1 where the face looks up, -1 where down.
    """
    lines, heights, signs = [0], [0.0], [0]
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        i0 = max(int(np.ceil((min(a[0], b[0], c[0]) - low[0]) / pitch[0])), 0)
        i1 = min(int(np.floor((max(a[0], b[0], c[0]) - low[0]) / pitch[0])), sides[0] - 1)
        j0 = max(int(np.ceil((min(a[1], b[1], c[1]) - low[1]) / pitch[1])), 0)
        j1 = min(int(np.floor((max(a[1], b[1], c[1]) - low[1]) / pitch[1])), sides[1] - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                x, y = low[0] + i * pitch[0], low[1] + j * pitch[1]
                s = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
                t = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
                if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
                    lines.append(i * sides[1] + j)
                    heights.append(a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]))
                    signs.append(1 if area > 0.0 else -1)
    return np.array(lines)[1:], np.array(heights)[1:], np.array(signs)[1:]
