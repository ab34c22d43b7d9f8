"""Random shapes of household categories, the training and test data of a regression and of networks.

Every hexahedron is cut along the diagonal from its first corner to its last (Kuhn, Some combinatorial lemmas
in topology, IBM Journal 4(5), 1960), so that blocks which share nodes in the same order fit each other.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from types import MappingProxyType

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.mesh import Mesh
from harness.sim.solid.tetrahedra import Tetrahedra, boundary_faces, signed_volumes, tetrahedra

_FLAT = 1e-12
"""Volume, of an object one long, below which a cell is a face that a collapsed edge left over."""


@dataclass(frozen=True, eq=False)
class HouseholdSolid:
    """A body."""

    inside: Tetrahedra  #: its cells.

    @property
    def surface(self) -> Mesh:
        """Its outside, in the same nodes."""
        faces = boundary_faces(self.inside.cells)
        used, numbers = np.unique(faces, return_inverse=True)
        return Mesh(self.inside.nodes[used], numbers.reshape(-1, 3))

    def standing(self) -> "HouseholdSolid":
        """The same one long, the middle of its bounding box above the origin, its lowest point on z = 0."""
        nodes = self.inside.nodes
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        middle = np.array([*(0.5 * (low + high))[:2], low[2]])
        return HouseholdSolid(Tetrahedra(read_only((nodes - middle) / (high - low).max()), self.inside.cells))


@dataclass
class SolidGrid:
    """A solid under construction."""

    _nodes: list[FloatArray] = field(default_factory=list)
    _blocks: list[IntArray] = field(default_factory=list)
    _count: int = 0

    def add_nodes(self, places: FloatArray) -> IntArray:
        """Numbers, shaped as the ``(..., 3)`` places without their last axis."""
        rows = np.asarray(places, dtype=np.float64).reshape(-1, 3)
        self._nodes.append(rows)
        self._count += len(rows)
        return np.arange(self._count - len(rows), self._count).reshape(places.shape[:-1])

    def places(self, numbers: IntArray) -> FloatArray:
        """Return the ``(..., 3)`` positions of nodes by their numbers."""
        return np.asarray(np.concatenate(self._nodes)[numbers])

    def add_block(self, numbers: IntArray) -> None:
        """``(a, b, c)`` numbers of the nodes of a grid of hexahedra; equal numbers are a collapsed edge."""
        self._blocks.append(numbers)

    def solid(self) -> HouseholdSolid:
        """All blocks together."""
        nodes = np.concatenate(self._nodes)
        cells = np.concatenate([_split(block) for block in self._blocks])
        ordered = np.sort(cells, axis=1)
        cells = cells[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
        flat = np.abs(signed_volumes(nodes, cells)) <= _FLAT
        return HouseholdSolid(tetrahedra(nodes, cells[~flat]))


_Random = np.random.Generator

AROUND = 24
"""Cells about the axis."""

LENGTH = 0.11
"""Of a cell along the section, in units of its greatest radius or height."""

_FEWEST = 2
"""Cells along a straight piece of the section, so that a tube finds room on a low wall."""

Outline = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Cross:
    """The horizontal section of a vessel: a superellipse."""

    across: float = 1.0  #: its extent in y over that in x.
    power: float = 2.0  #: 2 is an ellipse; greater is nearer to a rectangle.


@dataclass(frozen=True, eq=False)
class Vessel:
    """A vessel's grid."""

    grid: SolidGrid  #: that it is part of.
    outside: IntArray
    """``(s, AROUND)`` nodes of its outer face, from the middle of the bottom up to the rim."""
    split: int  #: row of ``outside`` above which cells run up, and below which they run down.


def draw(family: str, random: _Random) -> HouseholdSolid:
    """An object of that family, standing on z = 0 about z, its longest side 1."""
    return FAMILIES[family](random).standing()


def _wall(random: _Random, least: float = 0.03, most: float = 0.12) -> float:
    return float(np.exp(random.uniform(np.log(least), np.log(most))))


def _vessel(
    outline: list[tuple[float, float]], wall: float, cross: Cross | None = None, split: float = 0.5
) -> tuple[SolidGrid, Vessel]:
    grid = SolidGrid()
    return grid, turned(grid, outline, offset(outline, wall), split * outline[-1][1], cross)


def _cup(random: _Random) -> HouseholdSolid:
    radius, foot = random.uniform(0.3, 0.65), random.uniform(0.6, 1.0)
    outline = [(0.0, 0.0), (radius * foot, 0.0), (radius, random.uniform(0.2, 0.9)), (radius, 1.0)]
    grid, body = _vessel(outline, radius * _wall(random))
    if random.random() < 0.75:
        reach = radius + random.uniform(0.2, 0.5)
        add_handle(body, random.uniform(0.7, 0.9), random.uniform(0.1, 0.3), reach, 0.12)
    return grid.solid()


def _bowl(random: _Random) -> HouseholdSolid:
    height, foot, bulge = random.uniform(0.4, 1.1), random.uniform(0.3, 0.7), random.uniform(0.75, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (bulge, 0.5 * height), (1.0, height)]
    return _vessel(outline, _wall(random))[0].solid()


def _plate(random: _Random) -> HouseholdSolid:
    height, foot = random.uniform(0.05, 0.3), random.uniform(0.4, 0.8)
    outline = [(0.0, 0.0), (foot, 0.0), (1.0, height)]
    return _vessel(outline, _wall(random, 0.025, 0.08))[0].solid()


def _tray(random: _Random) -> HouseholdSolid:
    across, height, foot = random.uniform(0.4, 1.0), random.uniform(0.1, 0.6), random.uniform(0.75, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (1.0, height)]
    return _vessel(outline, _wall(random, 0.025, 0.08), Cross(across, random.uniform(2.0, 10.0)))[0].solid()


def _bottle(random: _Random) -> HouseholdSolid:
    radius, shoulder, neck = random.uniform(0.12, 0.35), random.uniform(0.4, 0.85), random.uniform(0.25, 0.8)
    high = 0.5 * (1.0 + shoulder)
    outline = [(0.0, 0.0), (radius, 0.0), (radius, shoulder), (neck * radius, high), (neck * radius, 1.0)]
    return _vessel(outline, radius * _wall(random, 0.04, 0.15))[0].solid()


def _grid_box(
    sides: tuple[float, float, float], cells: tuple[int, int, int]
) -> tuple[SolidGrid, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    axes = [np.linspace(-0.5 * side, 0.5 * side, count + 1) for side, count in zip(sides, cells, strict=True)]
    return SolidGrid(), np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def _bar(random: _Random) -> HouseholdSolid:
    grid, places = _grid_box((1.0, random.uniform(0.04, 0.3), random.uniform(0.03, 0.2)), (16, 2, 2))
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _block(random: _Random) -> HouseholdSolid:
    grid, places = _grid_box((1.0, random.uniform(0.3, 1.0), random.uniform(0.2, 1.2)), (6, 6, 6))
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _tool(random: _Random) -> HouseholdSolid:
    """A flat shaft with a wider end or two."""
    shaft = random.uniform(0.05, 0.12)
    grid, places = _grid_box((1.0, shaft, random.uniform(0.03, 0.1)), (20, 4, 2))
    first, second = random.uniform(1.0, 3.5, 2) if random.random() < 0.6 else (1.0, random.uniform(1.5, 3.5))
    knots = [-0.5, -0.5 + random.uniform(0.1, 0.2), -0.25, 0.25, 0.5 - random.uniform(0.1, 0.2), 0.5]
    wider = np.interp(places[..., 0], knots, [0.7 * first, first, 1.0, 1.0, second, 0.7 * second])
    places[..., 1] *= wider
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _hammer(random: _Random) -> HouseholdSolid:
    """A shaft with a head across its end, lying."""
    thick, head = random.uniform(0.06, 0.14), random.uniform(0.25, 0.5)
    grid, places = _grid_box((thick, head, thick), (2, 6, 2))
    numbers = grid.add_nodes(places + np.array([0.5, 0.0, 0.0]))
    grid.add_block(numbers)
    shaft = random.uniform(0.3, 1.0) * head / 6.0
    ends = numbers[0, 2:5]
    layers = [ends]
    for x in np.linspace(0.5 - 0.5 * thick, -0.5, 16)[1:]:
        at = places[0, 2:5].copy()
        at[..., 0], at[..., 1] = x, at[..., 1] * shaft / (head / 6.0)
        layers.append(grid.add_nodes(at))
    grid.add_block(np.stack(layers))
    return grid.solid()


def _pan(random: _Random) -> HouseholdSolid:
    height, length = random.uniform(0.15, 0.6), random.uniform(0.6, 1.8)
    outline = [(0.0, 0.0), (random.uniform(0.7, 1.0), 0.0), (1.0, height)]
    grid, body = _vessel(outline, _wall(random, 0.025, 0.08), split=0.0)
    add_arm(body, 0.8 * height, (1.0 + length, random.uniform(0.6, 1.1) * height), 0.14)
    return grid.solid()


def _glass(random: _Random) -> HouseholdSolid:
    rim, widest = random.uniform(0.15, 0.32), random.uniform(0.18, 0.36)
    foot, stem = random.uniform(0.15, 0.3), random.uniform(0.02, 0.04)
    low, high = random.uniform(0.2, 0.45), random.uniform(0.6, 0.8)
    wall = widest * _wall(random, 0.03, 0.1)
    outer = [(foot, 0.0), (foot, 0.02), (stem, 0.06), (stem, low), (widest, high), (rim, 1.0)]
    inner = [
        (0.0, 0.0),
        (0.0, 0.02),
        (0.0, 0.06),
        (0.0, low + 0.03),
        (widest - wall, high),
        (rim - wall, 1.0),
    ]
    grid = SolidGrid()
    turned(grid, outer, inner, 0.5)
    return grid.solid()


def _pot(random: _Random) -> HouseholdSolid:
    height, belly, lid = random.uniform(0.8, 1.6), random.uniform(0.4, 0.6), random.uniform(0.3, 0.7)
    outline = [(0.0, 0.0), (0.6, 0.0), (1.0, belly * height), (lid, 0.95 * height), (lid, height)]
    grid, body = _vessel(outline, _wall(random))
    end = random.uniform(1.2, 1.7), random.uniform(0.6, 1.0) * height
    add_arm(body, 0.6 * height, end, 0.2, opposite=True)
    add_handle(body, 0.8 * height, 0.25 * height, random.uniform(1.2, 1.7), 0.15)
    return grid.solid()


def _jug(random: _Random) -> HouseholdSolid:
    radius, waist = random.uniform(0.22, 0.4), random.uniform(0.6, 1.0)
    foot = radius * random.uniform(0.7, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (radius, 0.4), (radius * waist, 0.8), (radius, 1.0)]
    grid, body = _vessel(outline, radius * _wall(random))
    add_handle(body, 0.85, 0.25, radius + random.uniform(0.12, 0.3), 0.08)
    return grid.solid()


FAMILIES: MappingProxyType[str, Callable[[_Random], HouseholdSolid]] = MappingProxyType(
    {
        "cup": _cup, "bowl": _bowl, "plate": _plate, "tray": _tray, "bottle": _bottle, "bar": _bar,
        "block": _block, "tool": _tool, "hammer": _hammer, "pan": _pan, "glass": _glass, "pot": _pot,
        "jug": _jug,
    }
)  # fmt: skip
"""By name."""


def offset(outline: Outline, wall: float) -> list[tuple[float, float]]:
    """The inner side of a wall whose outer side is a line of radii and heights, mitred at its corners."""
    places = np.array(outline)
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    inward = np.column_stack([-along[:, 1], along[:, 0]])
    before, after = np.vstack([inward[:1], inward]), np.vstack([inward, inward[-1:]])
    mitre = (before + after) / (1.0 + np.einsum("ij,ij->i", before, after))[:, None]
    inner = places + wall * mitre
    inner[:, 0] = np.maximum(inner[:, 0], 0.0)
    return [(float(radius), float(height)) for radius, height in inner]


def turned(
    grid: SolidGrid, outer: Outline, inner: Outline, split_height: float, cross: Cross | None = None
) -> Vessel:
    """Add the body between two lines of radii and heights of equal length, turned about the vertical.

    Args:
        grid: to add to.
        outer: its outer side, from the bottom up.
        inner: its inner side, point by point.
        split_height: above it cells run up, below it down, so that both ends of a handle fit.
        cross: horizontal section; a circle where not given.
    """
    cross = cross or Cross()
    outside, inside = _divided(np.array(outer), np.array(inner))
    angles = np.arange(AROUND) * 2.0 * np.pi / AROUND
    way = np.column_stack([np.cos(angles), np.sin(angles)])
    way /= (np.abs(way) ** cross.power).sum(axis=1, keepdims=True) ** (1.0 / cross.power)
    way = way * np.array([1.0, cross.across])
    numbers = np.stack([_ring(grid, side, way) for side in (inside, outside)], axis=2)
    around = np.concatenate([numbers, numbers[:, :1]], axis=1)
    split = int(np.clip(np.searchsorted(outside[:, 1], split_height), 1, len(outside) - 2))
    grid.add_block(around[split:])
    grid.add_block(around[split::-1])
    return Vessel(grid, numbers[:, :, 1], split)


def _divided(outer: FloatArray, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both lines with so many points that no cell is much longer than ``LENGTH`` of the whole."""
    lengths = np.linalg.norm(np.diff(outer, axis=0), axis=1)
    counts = np.maximum(_FEWEST, np.round(lengths / (LENGTH * outer.max()))).astype(int)
    share = np.concatenate(
        [k + np.arange(count) / count for k, count in enumerate(counts)] + [np.array([len(counts)])]
    )
    at = np.arange(len(outer))
    first, second = (
        np.column_stack([np.interp(share, at, line[:, axis]) for axis in (0, 1)]) for line in (outer, inner)
    )
    return first, second


def _ring(grid: SolidGrid, line: FloatArray, way: FloatArray) -> IntArray:
    flat = line[:, None, :1] * way[None]
    height = np.broadcast_to(line[:, None, 1:], (*flat.shape[:2], 1))
    numbers = grid.add_nodes(np.concatenate([flat, height], axis=2))
    on_axis = line[:, 0] <= 0.0
    return np.where(on_axis[:, None], numbers[:, :1], numbers)


def _row_at(vessel: Vessel, height: float) -> int:
    heights = vessel.grid.places(vessel.outside[:, 0])[:, 2]
    return int(np.clip(np.abs(heights - height).argmin() - 1, 1, len(heights) - 3))


def _patch(vessel: Vessel, row: int, column: int) -> IntArray:
    """``(3, 3)`` nodes of two by two cells of the outer face, about a column."""
    columns = (column + np.arange(-1, 2)) % AROUND
    return np.asarray(vessel.outside[row : row + 3][:, columns])


def add_handle(vessel: Vessel, high: float, low: float, reach: float, thick: float) -> None:
    """A loop on the side of x, out to a distance from the axis, between two heights."""
    top = _row_at(vessel, high)
    bottom = min(_row_at(vessel, low), vessel.split - 2)
    if bottom < 1 or top < vessel.split:
        return
    first, last = _patch(vessel, top, 0), _patch(vessel, bottom, 0)[::-1]
    a, b = (vessel.grid.places(patch).mean(axis=(0, 1)) for patch in (first, last))
    out = np.array([reach - 0.5 * thick, 0.0, 0.0])
    corner = [np.array([out[0], 0.0, end[2] + lift]) for end, lift in ((a, -0.5 * thick), (b, 0.5 * thick))]
    _tube(vessel.grid, first, last, np.array([a, *corner, b]), thick)


def add_arm(
    vessel: Vessel, height: float, end: tuple[float, float], thick: float, opposite: bool = False
) -> None:
    """A straight bar from the wall to a distance from the axis and a height; a spout or a pan's handle."""
    row = max(_row_at(vessel, height), vessel.split)
    if row > len(vessel.outside) - 3:
        return
    column = AROUND // 2 if opposite else 0
    first = _patch(vessel, row, column)
    begin = vessel.grid.places(first).mean(axis=(0, 1))
    side = -1.0 if opposite else 1.0
    _tube(vessel.grid, first, None, np.array([begin, [side * end[0], 0.0, end[1]]]), thick)


def _tube(grid: SolidGrid, first: IntArray, last: IntArray | None, corners: FloatArray, thick: float) -> None:
    """Cells along a line in the plane of x and z, from nodes that are there, to such or to a free end."""
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    at = np.append(0.0, np.cumsum(length))
    count = max(3, int(np.ceil(at[-1] / max(thick, 0.08 * at[-1]))))
    stations = np.linspace(0.0, at[-1], count + 1)
    middle = np.column_stack([np.interp(stations, at, corners[:, axis]) for axis in range(3)])
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # What is up at the beginning turns with the line.
    side = np.sign(along[0, 0]) or 1.0
    up = np.column_stack([-along[:, 2] * side, np.zeros(len(along)), along[:, 0] * side])
    across = grid.places(first)[:, :, 1]
    wide = np.sign(across[1, 2] - across[1, 0]) * np.linspace(-0.5, 0.5, 3) * thick
    rows = np.linspace(-0.5, 0.5, 3) * thick
    layers = [first]
    free = range(1, count) if last is not None else range(1, count + 1)
    for k in free:
        places = middle[k] + rows[:, None, None] * up[k] + wide[None, :, None] * np.array([0.0, 1.0, 0.0])
        layers.append(grid.add_nodes(places))
    if last is not None:
        layers.append(last)
    grid.add_block(np.stack(layers))


def _split(block: IntArray) -> IntArray:
    """``(n, 4)`` cells of a block of hexahedra, six each."""
    cells = []
    whole = np.array(block.shape) - 1
    for axes in permutations(range(3)):
        corner = np.zeros(3, dtype=np.int64)
        path = [corner.copy()]
        for axis in axes:
            corner[axis] += 1
            path.append(corner.copy())
        taken = [block[a : a + whole[0], b : b + whole[1], c : c + whole[2]].ravel() for a, b, c in path]
        cells.append(np.stack(taken, axis=1))
    return np.concatenate(cells)
