"""Many tiny networks of an object's look, one for each cell of a grid that holds some of its surface.

ObjectFolder 2.0 (Gao et al., CVPR 2022, section 4.1) after KiloNeRF (Reiser et al., ICCV 2021) and object
scattering functions (Guo et al., 2020): a place, the way the light travels to the camera and the way to the
lamp become a density and the fraction of the lamp's light that is scattered towards the camera. Every
network sees its own cell as -1 .. 1, so that ten octaves of it are exact in float32.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.vision_tensors import EXTRAS, MOST_CELLS, Kind

CELLS = 16
"""Along the longest side of the object's box, as in the paper."""


BLOCK = 32
"""Samples of one network that are asked together."""

PER_CELL = 8
"""Voxels along a cell: the unit of depths that networks learn densities at."""

DEEP = 1.0
"""Voxels: how far behind the surface networks learn to answer."""

_BESIDE = 1e-6
"""Rounding tolerance around a cell, as a fraction of it; meshes may be stored in float32."""

_MOST_LOST = 0.02
"""Maximum fraction of surface points without a network; float32 rounding moves some into other cells."""

_OUTSIDE = 0.125
"""Maximum distance of a surface outside the grid, as a fraction of a cell."""


@dataclass(frozen=True)
class NetworkSize:
    """How large each tiny network is."""

    width: int = 64  #: numbers of every hidden layer.
    octaves: int = 10  #: of a place's encoding: sines and cosines of 1, 2, 4, ... times the coordinate.
    turns: int = 4  #: octaves of a direction's.
    kind: Kind = "osf"  #: what it is told.

    def __post_init__(self) -> None:
        if self.width < 8 or self.width % 8 or self.width > 256:
            raise WrongUse(
                f"networks {self.width} wide were asked for; a multiple of 8 from 8 to 256 is made"
            )
        if not (0 <= self.octaves <= 10 and 0 <= self.turns <= 10) or self.kind not in EXTRAS:
            raise WrongUse(
                f"{self.octaves} octaves of places and {self.turns} of directions of kind {self.kind!r}; "
                f"there are 0 to 10, and kinds {', '.join(EXTRAS)}"
            )

    @property
    def place(self) -> int:
        """Numbers that a place becomes: 63 with ten octaves."""
        return 3 + 6 * self.octaves

    @property
    def direction(self) -> int:
        """Numbers that a direction becomes: 27 with four octaves."""
        return 3 + 6 * self.turns

    @property
    def extras(self) -> int:
        """Further inputs of the layer that sees directions."""
        return EXTRAS[self.kind]

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of each array of ``VisionWeights``, without its leading axis of networks."""
        wide, seen = self.width, self.width + 2 * self.direction + self.extras
        return {
            "first": (self.place, wide),
            "first_bias": (wide,),
            "second": (wide, wide),
            "second_bias": (wide,),
            "density": (wide, 1),
            "density_bias": (1,),
            "feature": (wide, wide),
            "feature_bias": (wide,),
            "scatter": (seen, wide),
            "scatter_bias": (wide,),
            "colour": (wide, 3),
            "colour_bias": (3,),
        }

    @property
    def parameters(self) -> int:
        """Of one network: 20 292 in the paper's size."""
        return sum(int(np.prod(shape)) for shape in self.shapes.values())

    @property
    def products(self) -> int:
        """Multiply-adds of one sample when what is constant is folded: 14 208 in the paper's size."""
        wide = self.width
        seen = wide + self.direction + self.extras
        return self.place * wide + wide * wide + wide + seen * wide + 3 * wide


PAPER = NetworkSize()
COMPACT = NetworkSize(width=32, octaves=6, turns=3)
SIZES = {"paper": PAPER, "compact": COMPACT}


@dataclass(frozen=True, eq=False)
class VisionGrid:
    """Where each network answers: cubes of a lattice, those that hold some surface."""

    low: FloatArray  #: ``(3,)`` m, least corner of the lattice, object frame.
    cell: float  #: m, edge of every cube.
    cells: IntArray  #: ``(networks, 3)`` which cube each network has.

    def __post_init__(self) -> None:
        low, cells = np.array(self.low, np.float64), np.array(self.cells, np.int64)
        if (
            low.shape != (3,)
            or not np.isfinite(low).all()
            or not (np.isfinite(self.cell) and self.cell > 0.0)
        ):
            raise WrongUse(
                f"a grid at {low} m of {self.cell} m cells; give three numbers, and an edge above 0"
            )
        if cells.ndim != 2 or cells.shape[1:] != (3,) or len(cells) < 1:
            raise WrongUse(f"cells of shape {cells.shape}; one or more of three numbers are needed")
        if cells.min() < 0 or cells.max() >= MOST_CELLS or len(np.unique(cells, axis=0)) != len(cells):
            raise WrongUse(
                f"cells {cells.min()} to {cells.max()}, or one twice; each is counted 0 to {MOST_CELLS - 1}"
            )
        object.__setattr__(self, "low", read_only(low))
        object.__setattr__(self, "cells", read_only(cells))

    def __len__(self) -> int:
        return len(self.cells)

    @cached_property
    def shape(self) -> IntArray:
        """``(3,)`` cubes along x, y, z, up to the last that has a network."""
        last: IntArray = self.cells.max(axis=0) + 1
        return read_only(last)

    @property
    def high(self) -> FloatArray:
        """``(3,)`` m: greatest corner."""
        highest: FloatArray = self.low + self.cell * self.shape
        return highest

    @cached_property
    def table(self) -> AnyArray:
        """``shape`` int32: the network of each cube, -1 where there is none."""
        table = np.full(tuple(self.shape), -1, np.int32)
        table[tuple(self.cells.T)] = np.arange(len(self.cells), dtype=np.int32)
        return read_only(table)

    def networks(self, points: FloatArray) -> IntArray:
        """Find the network of each of ``(n, 3)`` points in m: ``(n,)``, -1 where none answers.

        A point on the border of a cube, or beside it by what rounding does, belongs to either.
        """
        return _networks_of(np.asarray(points, np.float64), self.low, self.cell, self.table)

    def require_surface(self, mesh: Mesh) -> None:
        """Refuse a surface of another object than the networks'.

        Raises:
            DataRefused: it goes where no network answers.
        """
        places = np.concatenate([mesh.vertices, mesh.corners.mean(axis=1)])
        lost = float(np.mean(self.networks(places) < 0))
        outside = float(np.maximum(self.low - mesh.bounds[0], mesh.bounds[1] - self.high).max())
        if lost > _MOST_LOST or outside > _OUTSIDE * self.cell:
            raise DataRefused(
                f"{lost:.0%} of the surface's points have no network among {len(self)}, and it leaves the "
                f"grid by {max(outside, 0.0) * 1e3:.3g} mm; mesh and networks are of different objects, "
                "build the object again"
            )


@compiled
def _networks_of(points: FloatArray, low: FloatArray, cell: float, table: AnyArray) -> IntArray:
    """See ``VisionGrid.networks``."""
    found = np.full(len(points), -1, np.int64)
    x, y, z = table.shape
    for n in range(len(points)):
        a, b, c = (
            (points[n, 0] - low[0]) / cell,
            (points[n, 1] - low[1]) / cell,
            (points[n, 2] - low[2]) / cell,
        )
        for k in range(9):
            # The point itself, then the corners of a tiny cube around it.
            beside = 0.0 if k == 0 else _BESIDE
            i = int(np.floor(a + (beside if k & 1 else -beside)))
            j = int(np.floor(b + (beside if k & 2 else -beside)))
            m = int(np.floor(c + (beside if k & 4 else -beside)))
            if 0 <= i < x and 0 <= j < y and 0 <= m < z and table[i, j, m] >= 0:
                found[n] = table[i, j, m]
                break
    return found


@dataclass(frozen=True, eq=False)
class VisionWeights:
    """Of all networks of an object; ``y = x @ weight + bias``, ReLU after ``first``, ``second``, ``scatter``.

    The rows of ``scatter`` are the feature's, the view's, the light's, the extras'. A view is the way from
    the camera into the picture, a light the way to the lamp, both unit, in the object's frame.
    """

    size: NetworkSize  #: of each network.
    density_scale: float  #: 1/m that a density of 1 stands for: keeps numbers within float16.
    first: AnyArray  #: of a place's encoding.
    first_bias: AnyArray  #: of it.
    second: AnyArray  #: of what ``first`` gave.
    second_bias: AnyArray  #: of it.
    density: AnyArray  #: of what ``second`` gave, ReLU after it.
    density_bias: AnyArray  #: of it.
    feature: AnyArray  #: of what ``second`` gave.
    feature_bias: AnyArray  #: of it.
    scatter: AnyArray  #: of the feature and the directions.
    scatter_bias: AnyArray  #: of it.
    colour: AnyArray  #: of what ``scatter`` gave, a logistic after it.
    colour_bias: AnyArray  #: of it.

    def __post_init__(self) -> None:
        if not (np.isfinite(self.density_scale) and self.density_scale > 0.0):
            raise WrongUse(f"a density's scale of {self.density_scale} 1/m; a finite one above 0 is needed")
        count = len(self.first)
        for name, array in self.arrays():
            wanted = (count, *self.size.shapes[name])
            if array.shape != wanted or count < 1:
                raise WrongUse(f"weights {name!r} have the shape {array.shape}; {wanted} fits the others")
            if not np.isfinite(array).all():
                bad = int(np.count_nonzero(~np.isfinite(array)))
                raise WrongUse(f"weights {name!r} have {bad} numbers that are not finite; train again")

    def __len__(self) -> int:
        return len(self.first)

    def arrays(self) -> Iterator[tuple[str, AnyArray]]:
        """Each array by its name, in the order of the file."""
        for field in fields(self)[2:]:
            yield field.name, getattr(self, field.name)

    def rounded(self) -> "VisionWeights":
        """As float16, which is how they are kept.

        Raises:
            WrongUse: a number that float16 cannot hold.
        """
        with np.errstate(over="ignore"):  # refused by name by the new object
            halves = {name: np.asarray(array, np.float64).astype(np.float16) for name, array in self.arrays()}
        return VisionWeights(self.size, self.density_scale, **halves)


@dataclass(frozen=True, eq=False)
class VisionModel:
    """Networks and where each answers."""

    grid: VisionGrid  #: of the cells.
    weights: VisionWeights  #: as many networks as cells.

    def __post_init__(self) -> None:
        if len(self.grid) != len(self.weights):
            raise WrongUse(f"{len(self.grid)} cells and {len(self.weights)} networks; one for each is needed")


def scatter_rows(size: NetworkSize) -> dict[str, slice]:
    """Which rows of ``VisionWeights.scatter`` belong to what."""
    ends = np.cumsum([0, size.width, size.direction, size.direction, size.extras])
    names = ("feature", "view", "light", "extras")
    return {name: slice(int(a), int(b)) for name, a, b in zip(names, ends[:-1], ends[1:], strict=True)}
