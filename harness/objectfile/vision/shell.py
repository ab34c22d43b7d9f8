"""Where an object's networks are asked: small cubes along its surface, and a way into it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import DataRefused, MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network.network import CELLS, VisionGrid
from harness.objectfile.vision.voxels import distances, touch_voxels
from harness.objectfile.vision_tensors import MOST_CELLS

PER_CELL = 8
"""Voxels along a cell: 128 along the longest side of the object."""

DEEP = 1.0
"""Voxels: how far behind the surface the shell goes on, so that what is opaque has room to be it."""

BOX = 1.2
"""Of the object's longest side: what ``cells`` go across, as the published grid's -0.6 to 0.6."""

_MARGIN = 1e-3
"""Of a cell, at least, between the object's box and the lattice's border."""

_BRICK = 4

_MOST_LOST = 0.02
"""Of cells: a mesh that was written in float32 touches some that it did not touch before."""


@dataclass(frozen=True, eq=False)
class Shell:
    """Voxels that are not empty.

    Attributes:
        low: ``(3,)`` m, least corner of the lattice, object frame.
        voxel: m, edge of each.
        words: ``(x, y, z)`` uint64, each of 4 x 4 x 4 voxels: bit ``16 (i % 4) + 4 (j % 4) + k % 4`` is
            set where voxel (i, j, k) is not empty.
    """

    low: FloatArray
    voxel: float
    words: AnyArray

    @classmethod
    def of(cls, low: FloatArray, voxel: float, occupied: AnyArray) -> "Shell":
        """A shell of given voxels, ``(x, y, z)`` booleans."""
        if occupied.ndim != 3 or 0 in occupied.shape or not (np.isfinite(voxel) and voxel > 0.0):
            raise WrongUse(
                f"voxels of shape {occupied.shape} with an edge of {voxel} m; three sides, above 0"
            )
        bricks = [-(-size // _BRICK) for size in occupied.shape]
        whole = np.zeros([_BRICK * count for count in bricks], np.uint64)
        whole[tuple(slice(size) for size in occupied.shape)] = occupied
        parts = whole.reshape(bricks[0], 4, bricks[1], 4, bricks[2], 4).transpose(0, 2, 4, 1, 3, 5)
        bits = np.left_shift(parts.reshape(*bricks, 64), np.arange(64, dtype=np.uint64))
        words = np.bitwise_or.reduce(bits, axis=3)
        return cls(np.asarray(low, np.float64), float(voxel), read_only(np.ascontiguousarray(words)))

    @property
    def occupied(self) -> AnyArray:
        """``(x, y, z)`` booleans."""
        shape = self.words.shape
        bits = (self.words[..., None] >> np.arange(64, dtype=np.uint64)) & np.uint64(1)
        parts = bits.astype(bool).reshape(*shape, 4, 4, 4).transpose(0, 3, 1, 4, 2, 5)
        return parts.reshape([_BRICK * size for size in shape])

    @cached_property
    def near(self) -> AnyArray:
        """``(x + 2, y + 2, z + 2)`` uint8, of ``distances``."""
        return read_only(distances(self.occupied))

    def cells(self, per_cell: int) -> AnyArray:
        """``(n, 3)`` cells of so many voxels a side that hold some."""
        occupied = self.occupied
        room = [-(-size // per_cell) * per_cell - size for size in occupied.shape]
        whole = np.pad(occupied, [(0, more) for more in room])
        sides = [part for size in whole.shape for part in (size // per_cell, per_cell)]
        return np.argwhere(whole.reshape(sides).any(axis=(1, 3, 5)))


@dataclass(frozen=True)
class VoxelLattice:
    """Cubes around an object.

    Attributes:
        low: ``(3,)`` m, least corner, object frame.
        cell: m, edge of a cube.
        sides: cubes along x, y, z.
        per_cell: voxels along a cube.
    """

    low: tuple[float, float, float]
    cell: float
    sides: tuple[int, int, int]
    per_cell: int = PER_CELL

    def __post_init__(self) -> None:
        if self.per_cell % _BRICK or not _BRICK <= self.per_cell <= 64:
            raise WrongUse(
                f"cells of {self.per_cell} voxels were asked for; 4 to 64 in multiples of 4 are made"
            )

    @property
    def voxel(self) -> float:
        """Metres, edge of a voxel."""
        return self.cell / self.per_cell


def lattice_of(mesh: Mesh, cells: int = CELLS, per_cell: int = PER_CELL) -> VoxelLattice:
    """The cubes around a surface.

    Args:
        mesh: in metres.
        cells: along ``BOX`` times the longest side of its box.
        per_cell: voxels along a cell.

    Raises:
        MeshRefused: no surface, or one that is not finite or all at one place.
        WrongUse: a number of cells or voxels that cannot be made.
    """
    if not 1 <= cells <= MOST_CELLS:
        raise WrongUse(f"{cells} cells along a side were asked for; 1 to {MOST_CELLS} are made")
    if len(mesh.faces) == 0 or not np.isfinite(mesh.corners).all():
        raise MeshRefused(f"a surface of {len(mesh.faces)} faces with finite corners has no shell; repair it")
    low, high = mesh.bounds
    longest = float((high - low).max())
    if not longest > 0.0:
        raise MeshRefused("a surface whose corners are all at one place has no shell; repair it")
    cell = longest * BOX / cells
    sides = np.maximum(np.ceil((high - low) / cell + 2.0 * _MARGIN), 1.0).astype(np.int64)
    x, y, z = (0.5 * (low + high) - 0.5 * cell * sides).tolist()
    return VoxelLattice((x, y, z), cell, (int(sides[0]), int(sides[1]), int(sides[2])), per_cell)


def surface_shell(mesh: Mesh, lattice: VoxelLattice, deep: float = DEEP) -> Shell:
    """The voxels that a surface touches, and those a little behind it.

    Args:
        mesh: in metres.
        lattice: that they are of; what lies outside of it is left out.
        deep: voxels behind the surface, along its normals; 0 to 64.
    """
    if not 0.0 <= deep <= 64.0:
        raise WrongUse(f"a shell {deep} voxels deep was asked for; 0 to 64 is made")
    origin, voxel = np.array(lattice.low), lattice.voxel
    words = np.zeros(tuple(size * lattice.per_cell // _BRICK for size in lattice.sides), np.uint64)
    for behind in np.minimum(np.arange(np.ceil(deep) + 1.0), deep):
        moved = mesh.vertices - behind * voxel * mesh.vertex_normals
        touch_voxels(np.ascontiguousarray((moved[mesh.faces] - origin) / voxel), words)
    return Shell(read_only(origin), voxel, read_only(words))


def grid_of(shell: Shell, lattice: VoxelLattice) -> VisionGrid:
    """A network for every cell that holds some of a shell."""
    return VisionGrid(shell.low, lattice.cell, shell.cells(lattice.per_cell))


def shell_for(mesh: Mesh, grid: VisionGrid, per_cell: int = PER_CELL, deep: float = DEEP) -> Shell:
    """The shell of a surface whose networks are known.

    Raises:
        DataRefused: the surface goes where no network answers: they are of different objects.
    """
    x, y, z = grid.low.tolist()
    i, j, k = grid.shape.tolist()
    lattice = VoxelLattice((x, y, z), grid.cell, (i, j, k), per_cell)
    shell = surface_shell(mesh, lattice, deep)
    lost = np.count_nonzero(grid.table[tuple(shell.cells(per_cell).T)] < 0)
    outside = float(np.maximum(grid.low - mesh.bounds[0], mesh.bounds[1] - grid.high).max())
    if lost > _MOST_LOST * len(grid) or outside > shell.voxel:
        raise DataRefused(
            f"the surface passes through {lost} cells that have no network, of {len(grid)} that have, and "
            f"leaves the grid by {max(outside, 0.0) * 1e3:.3g} mm; mesh and networks are of different "
            "objects, build the object again"
        )
    return shell
