"""Which side of a face is open to the room: rays against all triangles."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled


@compiled
def _hits(origin: FloatArray, direction: FloatArray, corners: FloatArray, first_only: bool) -> int:
    """Triangles a ray crosses (Moeller and Trumbore, J. Graphics Tools 2(1), 1997)."""
    count = 0
    for k in range(len(corners)):
        e1 = corners[k, 1] - corners[k, 0]
        e2 = corners[k, 2] - corners[k, 0]
        px = direction[1] * e2[2] - direction[2] * e2[1]
        py = direction[2] * e2[0] - direction[0] * e2[2]
        pz = direction[0] * e2[1] - direction[1] * e2[0]
        volume = e1[0] * px + e1[1] * py + e1[2] * pz
        if volume == 0.0:
            continue
        s = origin - corners[k, 0]
        u = (s[0] * px + s[1] * py + s[2] * pz) / volume
        if u < 0.0 or u > 1.0:
            continue
        qx = s[1] * e1[2] - s[2] * e1[1]
        qy = s[2] * e1[0] - s[0] * e1[2]
        qz = s[0] * e1[1] - s[1] * e1[0]
        v = (direction[0] * qx + direction[1] * qy + direction[2] * qz) / volume
        if v < 0.0 or u + v > 1.0:
            continue
        if (e2[0] * qx + e2[1] * qy + e2[2] * qz) / volume > 0.0:
            count += 1
            if first_only:
                return count
    return count


@compiled
def _escapes(origins: FloatArray, directions: FloatArray, corners: FloatArray) -> IntArray:
    free = np.zeros(len(origins), np.int64)
    for i in range(len(origins)):
        free[i] = _hits(origins[i], directions[i], corners, True) == 0
    return free


@compiled
def _crossings(points: FloatArray, direction: FloatArray, corners: FloatArray) -> IntArray:
    count = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        count[i] = _hits(points[i], direction, corners, False)
    return count


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
    front = _escapes(centre + lift * normal, away, corners).mean()
    back = _escapes(centre - lift * normal, -away, corners).mean()
    return float(front - back)


def is_inside(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Whether ``(n, 3)`` points lie inside a closed surface of ``(m, 3, 3)`` corners, 1.0 or 0.0."""
    # An irrational direction passes through edges of a modelled object almost never.
    direction = np.array([0.5773103, 0.3219714, 0.7503127])
    inside: FloatArray = (_crossings(points, direction, corners) % 2).astype(np.float64)
    return inside
