"""What a surface encloses and how thick its walls are."""

from functools import lru_cache

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.faces.face_clusters import FaceGrid, build_face_grid
from harness.basics.faces.mesh_rays import column_crossings, first_distances
from harness.basics.faces.nearest_kernels import nearest_places
from harness.basics.mesh import Mesh

_LINES = 256
"""Vertical lines along each side: enough for half a percent of a vessel's volume."""

_ASKED = 800
"""Places whose wall is measured to know how thin a mesh is."""

_PLANES = 20
"""Directions at most in which planes are looked for; each has a like share of the surface at least."""

_ALIKE = np.cos(np.radians(1.0))
"""Cosine between normals above which two faces are of parallel planes."""

_LIFT = 1e-9
"""Of the diagonal, by which a ray starts inside its own face."""


def enclosed_volume(mesh: Mesh) -> float:
    """Cubic metres of the points that the surface winds around once or more.

    A signed volume counts overlapping bodies twice; this counts what is there. Integrated along
    vertical lines, to about half a percent.
    """
    # Seen from a vertex: far from the origin heights lose their digits.
    low, high = mesh.bounds - mesh.vertices[0]
    sides = np.array([_LINES, _LINES])
    pitch = (high - low)[:2] / _LINES
    # Shares without a short fraction, so that no line runs along the edges of a modelled object.
    first = low[:2] + pitch * np.array([0.4142135, 0.6180339])
    line, height, sign = column_crossings(mesh.corners - mesh.vertices[0], first, pitch, sides)
    order = np.lexsort((height, line))
    line, height, sign = line[order], height[order], sign[order]
    inside = -np.cumsum(sign)[:-1] >= 1
    gaps = np.where(inside & (line[1:] == line[:-1]), np.diff(height), 0.0)
    return float(gaps.sum() * pitch[0] * pitch[1])


def wall_thickness(mesh: Mesh, points: FloatArray, normals: FloatArray) -> FloatArray:
    """``(n,)`` m of material behind ``(n, 3)`` places of the surface, straight inwards.

    Infinite where nothing is behind, as behind an open surface.
    """
    lift = _LIFT * mesh.diagonal
    # Seen from a vertex: far from the origin the lift would vanish.
    starts = points - mesh.vertices[0] - lift * normals
    return first_distances(starts, -normals, mesh.corners - mesh.vertices[0]) + lift


def thin_wall(mesh: Mesh, share: float = 0.02) -> float:
    """Metres of wall that all but ``share`` of the surface exceeds.

    The very thinnest places are the roundings of rims, which say nothing of the wall.
    """
    random = np.random.default_rng(0)
    area = mesh.face_areas
    picked = random.choice(len(area), _ASKED, p=area / area.sum())
    shares = random.dirichlet(np.ones(3), _ASKED)
    points = np.einsum("nc,ncd->nd", shares, mesh.corners[picked] - mesh.vertices[0]) + mesh.vertices[0]
    return float(np.quantile(wall_thickness(mesh, points, mesh.face_normals[picked]), share))


def flat_share(mesh: Mesh) -> float:
    """Share of a surface's area in planes of few directions: 1 for a box or a tray, near 0 for a ball.

    Of each direction counted the surface has a twentieth at least; a cylinder's side has none, nor have
    the narrow sides of a thin plate.
    """
    area, normals = mesh.face_areas / mesh.face_areas.sum(), mesh.face_normals
    flat, left = 0.0, area > 0.0
    for _ in range(_PLANES):
        if not left.any():
            break
        _, which = np.unique(np.round(normals[left], 6), axis=0, return_inverse=True)
        of_direction = np.bincount(which.reshape(-1), weights=area[left])
        towards = normals[left][np.argmax(of_direction[which.reshape(-1)])]
        alike = left & (normals @ towards > _ALIKE)
        share = float(area[alike].sum())
        if share < 1.0 / _PLANES:
            break
        flat, left = flat + share, left & ~alike
    return flat


@lru_cache(maxsize=4)
def _grid_of(mesh: Mesh) -> FaceGrid:
    """A mesh's grid, made once for searches that follow each other."""
    return build_face_grid(mesh)


def nearest_on_surface(
    mesh: Mesh, points: FloatArray, directions: FloatArray, reach: FloatArray, least_cosine: float = -1.0
) -> tuple[FloatArray, IntArray]:
    """The nearest place of a mesh to each point, within reach, on a face that looks the right way.

    Args:
        mesh: searched.
        points: ``(n, 3)`` m.
        directions: ``(n, 3)`` unit, where a face should look.
        reach: ``(n,)`` m.
        least_cosine: of the angle between a face's normal and the direction.

    Returns:
        ``(n, 3)`` places and ``(n,)`` faces; where there is none the point itself and -1.
    """
    grid = _grid_of(mesh)
    return nearest_places(
        points,
        directions,
        least_cosine,
        reach,
        mesh.corners,
        mesh.face_normals,
        grid.origin,
        grid.cell,
        grid.shape,
        grid.starts,
        grid.faces,
    )
