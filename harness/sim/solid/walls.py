"""The solid of a hollow thing of which the mesh is only the outside, or only the middle."""

from functools import lru_cache

import numpy as np
from manifold3d import Manifold

from harness.basics.arrays import FloatArray, IntArray, row_keys
from harness.basics.errors import MeshRefused
from harness.basics.faces.face_clusters import FaceGrid, build_face_grid
from harness.basics.faces.mesh_rays import column_crossings, first_distances
from harness.basics.faces.nearest_kernels import nearest_places
from harness.basics.mesh import Mesh, signed_volume
from harness.objects.solid import from_manifold, outward
from harness.sim.solid.mesh_repair import boundary_edges

_LINES = 256
"""Vertical lines along each side: enough for half a percent of a vessel's volume."""

_ASKED = 800
"""Places whose wall is measured to know how thin a mesh is."""

_PLANES = 20
"""Directions at most in which planes are looked for; each has a like share of the surface at least."""

_ALIKE = np.cos(np.radians(1.0))
"""Cosine between normals above which two faces are of parallel planes."""

_LIFT = 1e-9
"""Distance from its own face at which a ray starts, as a fraction of the diagonal."""


_CELLS_OF_WALL, _CELLS_OF_SIZE = 1.5, 1.0 / 60.0
"""Walls, and shares of the diagonal, to a cell of the grid in which a cavity is found."""

_MM = 1e-3


def walled(mesh: Mesh, wall: float | None) -> Mesh:
    """The surface of the material itself.

    Args:
        mesh: outward; closed, the outside of the thing, or open, the middle of its wall.
        wall: m, thickness of the wall; None for a mesh that already is the material's surface.

    Returns:
        A closed surface, outward. A closed mesh gains a cavity at ``wall`` beneath it, with no
        opening, since the mesh has none; an open one is thickened by half a wall to each side.

    Raises:
        MeshRefused: the wall is so thick that no cavity is left.
    """
    if wall is None:
        return mesh
    if len(boundary_edges(mesh.faces)):
        # Both sides of an open surface, joined along its rim.
        offset = 0.5 * wall * mesh.vertex_normals
        count = len(mesh.vertices)
        edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        _, which, counts = np.unique(
            row_keys(np.sort(edges, axis=1)), return_inverse=True, return_counts=True
        )
        rim = np.asarray(edges[counts[which.ravel()] == 1])
        a, b = rim[:, 0], rim[:, 1]
        sides = [np.stack(side, axis=1) for side in ((b, a, a + count), (b, a + count, b + count))]
        faces = np.concatenate([mesh.faces, mesh.faces[:, ::-1] + count, *sides])
        return outward(Mesh(np.concatenate([mesh.vertices + offset, mesh.vertices - offset]), faces))
    # Level sets have float32 coordinates: far from the origin they lose the wall.
    centre = mesh.vertices[0]
    cavity = _cavity(Mesh(mesh.vertices - centre, mesh.faces), wall)
    vertices = np.concatenate([mesh.vertices, cavity.vertices + centre])
    return Mesh(vertices, np.concatenate([mesh.faces, cavity.faces + len(mesh.vertices)]))


def _cavity(mesh: Mesh, wall: float) -> Mesh:
    """The surface of all that lies deeper than ``wall`` m, seen from within the solid."""
    cell = min(_CELLS_OF_WALL * wall, _CELLS_OF_SIZE * mesh.diagonal)
    low, high = mesh.bounds
    counts = np.ceil((high - low) / cell).astype(np.int64) + 3
    origin = low - cell
    # Metres beneath the surface at the corners of a grid; outside below zero, far away held.
    axes = [origin[axis] + cell * np.arange(counts[axis]) for axis in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    far = wall + 3.0 * cell
    places, faces = nearest_on_surface(
        mesh, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape).copy(), np.full(len(points), far)
    )
    gap = np.where(faces >= 0, np.linalg.norm(points - places, axis=1), far)
    # Which corners of the grid the surface encloses, by where vertical lines cross it.
    nudge = cell * np.array([1.1e-5, 1.7e-5])
    line, height, sign = column_crossings(
        mesh.corners, origin[:2] + nudge, np.array([cell, cell]), counts[:2].copy()
    )
    # A point is wound as often as faces above it look up less those that look down.
    above = np.zeros((counts[0] * counts[1], counts[2] + 1), dtype=np.int64)
    level = np.clip(np.ceil((height - origin[2]) / cell).astype(np.int64), 0, counts[2])
    np.add.at(above, (line, level), sign)
    winding = above.sum(axis=1, keepdims=True) - np.cumsum(above, axis=1)
    gap = gap.reshape(counts)
    depth = np.where(winding[:, : counts[2]].reshape(counts) >= 1, gap, -gap)
    inside = Manifold.level_set(
        _Sampled(depth / _MM, origin / _MM, cell / _MM),
        [*(low / _MM), *(high / _MM)],
        cell / _MM,
        wall / _MM,
    )
    if inside.is_empty() or inside.volume() < 1e-6 * abs(signed_volume(mesh)) / _MM**3:
        raise MeshRefused(
            f"a wall of {wall * 1e3:g} mm leaves no cavity in the object; say a thinner wall, or leave it "
            "out for a solid"
        )
    smooth = from_manifold(inside.simplify(0.02 * wall / _MM))
    return Mesh(smooth.vertices * _MM, smooth.faces[:, ::-1])


class _Sampled:
    """A field on a grid, linear between its corners, read point by point."""

    def __init__(self, field: FloatArray, origin: FloatArray, cell: float) -> None:
        self.field = field.tolist()
        self.origin = origin.tolist()
        self.cell = cell
        self.last = [side - 2 for side in field.shape]

    def __call__(self, x: float, y: float, z: float) -> float:
        """The field at a point; beyond the grid, its value at the border."""
        (i, u), (j, v), (k, w) = (self._place(axis, at) for axis, at in enumerate((x, y, z)))
        total = 0.0
        for a, share_a in ((i, 1.0 - u), (i + 1, u)):
            for b, share_b in ((j, 1.0 - v), (j + 1, v)):
                row = self.field[a][b]
                total += share_a * share_b * (row[k] * (1.0 - w) + row[k + 1] * w)
        return total

    def _place(self, axis: int, at: float) -> tuple[int, float]:
        along = (at - self.origin[axis]) / self.cell
        index = min(max(int(along), 0), self.last[axis])
        return index, min(max(along - index, 0.0), 1.0)


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
    """Return the wall thickness in m that all but ``share`` of the surface exceeds.

    The very thinnest places are the roundings of rims, which say nothing of the wall.
    """
    random = np.random.default_rng(0)
    area = mesh.face_areas
    picked = random.choice(len(area), _ASKED, p=area / area.sum())
    shares = random.dirichlet(np.ones(3), _ASKED)
    points = np.einsum("nc,ncd->nd", shares, mesh.corners[picked] - mesh.vertices[0]) + mesh.vertices[0]
    return float(np.quantile(wall_thickness(mesh, points, mesh.face_normals[picked]), share))


def flat_share(mesh: Mesh) -> float:
    """Return the fraction of a surface in planes of few directions: 1 for a box or a tray, near 0 for a ball.

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
