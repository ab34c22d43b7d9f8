"""An object's surface as evenly spaced samples, and which of them is nearest to any place.

A position filter asks "how far is this place from the surface, and which way does the
surface face there?" a million times a run. The answer is read from a table of voxels; near
an edge or a thin wall, where the nearest sample may lie on the other face, a caller looks
among the sample's neighbours for one whose normal fits.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import MeshRefused
from harness.basics.faces.nearest_kernels import squared_gap
from harness.basics.mesh import Mesh

NEIGHBOURS = 24
"""Samples looked at around the nearest one: about two rings, on both faces of a thin wall."""

_SMOOTHING_RADIUS = 2.0e-3
_REACH = 8.0e-3
_CANDIDATES_PER_SAMPLE = 12.0
_DENSITY_FOR_NORMALS = 4.0e6


@dataclass(frozen=True, eq=False)
class VoxelTable:
    """The nearest sample of every voxel within reach of the surface."""

    origin: FloatArray  #: ``(3,)`` metres, the corner of voxel (0, 0, 0).
    pitch: float  #: metres, the edge of a voxel.
    nearest: AnyArray  #: ``(nx, ny, nz)`` int32 sample index, -1 beyond ``reach``.
    reach: float  #: metres.


@dataclass(frozen=True, eq=False)
class Surface:
    """Samples of a mesh, hardly a place on it farther than ``spacing`` from one that faces its way.

    About one place in ten thousand is farther, by up to a fifth: samples are chosen from random points.
    """

    spacing: float  #: metres.
    points: FloatArray  #: ``(n, 3)`` metres, in the object's frame.
    normals: FloatArray  #: ``(n, 3)`` unit, outward, averaged over 2 mm of the same face.
    areas: FloatArray  #: ``(n,)`` square metres that each sample stands for.
    neighbours: AnyArray  #: ``(n, NEIGHBOURS)`` int32, nearest first, the sample itself excluded.
    table: VoxelTable  #: nearest sample of any place.

    @cached_property
    def tree(self) -> cKDTree:
        """For the nearest samples of places at any distance."""
        return cKDTree(self.points)


def random_points(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """``(count, 3)`` points uniform over the surface, and the face each lies on."""
    areas = mesh.face_areas
    total = float(areas.sum())
    if not total > 0.0:
        raise MeshRefused("the mesh has no surface: every face has zero area; export it again")
    faces = rng.choice(len(areas), size=count, p=areas / total)
    # Square root: area grows with the square of the distance from a corner.
    along, across = np.sqrt(rng.random(count)), rng.random(count)
    a, b, c = (mesh.corners[faces, corner] for corner in range(3))
    u, v, w = 1.0 - along, along * (1.0 - across), along * across
    points: FloatArray = u[:, None] * a + v[:, None] * b + w[:, None] * c
    return points, faces.astype(np.int64)


def sample_surface(mesh: Mesh, spacing: float, seed: int = 0) -> Surface:
    """Even samples of a mesh.

    Args:
        mesh: in metres.
        spacing: metres; hardly a place on the mesh is farther from a sample of its own side.
        seed: of the dense points that the samples are chosen from.

    Returns:
        The samples with normals, neighbours and nearest table.

    Raises:
        MeshRefused: the mesh has no area, or is so small that it has fewer than 32 samples.
    """
    rng = np.random.default_rng(seed)
    # Dense points lie about radius / 3 apart, so a gap between chosen samples hardly exceeds spacing.
    radius = 0.85 * spacing
    count = max(2000, int(_CANDIDATES_PER_SAMPLE * float(mesh.face_areas.sum()) / radius**2))
    dense, faces = random_points(mesh, count, rng)
    facing = np.ascontiguousarray(mesh.face_normals[faces])
    chosen = thin(dense, facing, radius)
    if len(chosen) < 32:
        raise MeshRefused(
            f"the surface gives {len(chosen)} samples {spacing * 1e3:g} mm apart, fewer than 32; "
            "check its units, or ask for a finer spacing"
        )
    points = np.ascontiguousarray(dense[chosen])
    # Points come in no order, so the first of them are as even as all of them.
    enough = slice(0, max(2000, int(_DENSITY_FOR_NORMALS * float(mesh.face_areas.sum()))))
    first, width = dense[enough], _SMOOTHING_RADIUS
    cells, shape = _cells(first, width)
    order = np.argsort(cells, kind="stable")
    starts = np.searchsorted(cells[order], np.arange(int(np.prod(shape)) + 1))
    own, lowest = np.ascontiguousarray(facing[chosen]), first.min(axis=0)
    normals = _mean_normals(first, facing[enough], points, own, order, starts, lowest, shape, width)
    owner = cKDTree(points).query(dense)[1]
    owned = np.bincount(owner, minlength=len(points)).astype(np.float64)
    nearest = np.asarray(cKDTree(points).query(points, k=NEIGHBOURS + 1)[1])[:, 1:]
    return Surface(
        spacing=spacing,
        points=read_only(points),
        normals=read_only(normals),
        areas=read_only(owned * (float(mesh.face_areas.sum()) / count)),
        neighbours=read_only(np.ascontiguousarray(nearest, dtype=np.int32)),
        table=voxel_table(points, pitch=0.75 * spacing, reach=_REACH),
    )


def thin(points: FloatArray, normals: FloatArray, radius: float) -> IntArray:
    """Indices of points no two of which are closer than ``radius`` and face the same way."""
    cells, shape = _cells(points, radius)
    return _thin(points, normals, cells, shape, radius)


def voxel_table(points: FloatArray, pitch: float, reach: float) -> VoxelTable:
    """The nearest of ``(n, 3)`` points for every voxel whose centre lies within ``reach`` of one."""
    origin = points.min(axis=0) - reach - pitch
    shape = np.ceil((points.max(axis=0) + reach + pitch - origin) / pitch).astype(np.int64)
    nearest = np.full(tuple(shape), -1, dtype=np.int32)
    _paint(points, origin, pitch, reach, nearest)
    return VoxelTable(read_only(origin), pitch, read_only(nearest), reach)


def _cells(points: FloatArray, size: float) -> tuple[IntArray, IntArray]:
    index = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    shape = index.max(axis=0) + 1
    flat: IntArray = (index[:, 0] * shape[1] + index[:, 1]) * shape[2] + index[:, 2]
    return flat, shape


@compiled
def _cosine(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _thin(
    points: FloatArray, normals: FloatArray, cells: IntArray, shape: IntArray, radius: float
) -> IntArray:
    first = np.full(shape[0] * shape[1] * shape[2], -1, np.int64)
    following = np.full(len(points), -1, np.int64)
    kept = np.empty(len(points), np.int64)
    count = 0
    for i in range(len(points)):
        cell = cells[i]
        x, y, z = cell // (shape[2] * shape[1]), (cell // shape[2]) % shape[1], cell % shape[2]
        free = True
        for a in range(max(x - 1, 0), min(x + 2, shape[0])):
            for b in range(max(y - 1, 0), min(y + 2, shape[1])):
                for c in range(max(z - 1, 0), min(z + 2, shape[2])):
                    j = first[(a * shape[1] + b) * shape[2] + c]
                    while j >= 0 and free:
                        near = squared_gap(points[i], points[j]) < radius * radius
                        # 60 degrees: a bevel's own faces stay apart, a curved wall's do not.
                        if near and _cosine(normals[i], normals[j]) > 0.5:
                            free = False
                        j = following[j]
        if free:
            following[i] = first[cell]
            first[cell] = i
            kept[count] = i
            count += 1
    return kept[:count]


@compiled
def _mean_normals(
    dense: FloatArray,
    facing: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    order: IntArray,
    starts: IntArray,
    origin: FloatArray,
    shape: IntArray,
    radius: float,
) -> FloatArray:
    means = np.empty((len(points), 3))
    for n in range(len(points)):
        cell_of = np.floor((points[n] - origin) / radius).astype(np.int64)
        total = normals[n].copy()
        for a in range(max(cell_of[0] - 1, 0), min(cell_of[0] + 2, shape[0])):
            for b in range(max(cell_of[1] - 1, 0), min(cell_of[1] + 2, shape[1])):
                for c in range(max(cell_of[2] - 1, 0), min(cell_of[2] + 2, shape[2])):
                    cell = (a * shape[1] + b) * shape[2] + c
                    for k in range(starts[cell], starts[cell + 1]):
                        j = order[k]
                        near = squared_gap(points[n], dense[j]) < radius * radius
                        if near and _cosine(normals[n], facing[j]) > 0.5:
                            total += facing[j]
        means[n] = total / np.sqrt(np.sum(total**2))
    return means


@compiled
def _paint(points: FloatArray, origin: FloatArray, pitch: float, reach: float, nearest: AnyArray) -> None:
    squared = np.full(nearest.shape, reach * reach)
    for i in range(len(points)):
        low = np.maximum(np.floor((points[i] - reach - origin) / pitch), 0.0).astype(np.int64)
        high = np.floor((points[i] + reach - origin) / pitch).astype(np.int64) + 1
        for a in range(low[0], min(high[0], nearest.shape[0])):
            dx = origin[0] + (a + 0.5) * pitch - points[i, 0]
            for b in range(low[1], min(high[1], nearest.shape[1])):
                dy = origin[1] + (b + 0.5) * pitch - points[i, 1]
                for c in range(low[2], min(high[2], nearest.shape[2])):
                    dz = origin[2] + (c + 0.5) * pitch - points[i, 2]
                    gap = dx * dx + dy * dy + dz * dz
                    if gap < squared[a, b, c]:
                        squared[a, b, c] = gap
                        nearest[a, b, c] = i
