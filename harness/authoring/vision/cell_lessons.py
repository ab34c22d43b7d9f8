"""What each cell's network learns from, of what all learn from together."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from harness.authoring.vision.batch import Lesson, encode
from harness.authoring.vision.layers import layer_shapes, octave_factors
from harness.authoring.vision.lessons import Lessons
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.vision.network import NetworkSize, VisionGrid


class CellLessons:
    """Lessons by cell.

    Args:
        size: of the networks.
        grid: of the cells.
        lessons: what all learn from.
        lamps: ``(m, 3)`` of ``CellTraining``.
        overlap: cells by which each learns from beyond its border.
        least: places that a cell learns from at least, the nearest if it has fewer; 0 for its own alone.
    """

    def __init__(
        self,
        size: NetworkSize,
        grid: VisionGrid,
        lessons: Lessons,
        lamps: AnyArray,
        overlap: float,
        least: int,
    ) -> None:
        self._size, self._grid, self._lessons, self._lamps = size, grid, lessons, lamps
        self._taught = _by_cell(grid, lessons.points, overlap, least)

    def lesson(self, cell: int) -> Lesson:
        """Of places of the surface."""
        lessons, at = self._lessons, self._taught(cell)
        return Lesson(
            *(self._encoded(cell, at), self._told(at), lessons.normals[at], lessons.colours[at]),
            *(lessons.depth[at], lessons.weight[at], self._lamps),
        )

    def _encoded(self, cell: int, at: IntArray) -> AnyArray:
        # -1 to 1 in a cell, and on beyond its border.
        grid, points = self._grid, self._lessons.points[at]
        place = np.asarray(2.0 * ((points - grid.low) / grid.cell - grid.cells[cell]) - 1.0, np.float32)
        encoded = np.empty((len(at), self._size.place), np.float32)
        encode(place, octave_factors(self._size), 0, encoded)
        return encoded

    def _told(self, at: IntArray) -> AnyArray:
        """What places with lamps of their own tell the later layer; nothing where lamps are drawn anew."""
        size, lessons = self._size, self._lessons
        if not lessons.lamps.shape[1]:
            return np.empty((len(at), 0), np.float32)
        told = np.empty((len(at), layer_shapes(size).told[0]), np.float32)
        ones, first = np.ones(size.turns, np.float32), 0
        if size.kind == "osf":
            encode(lessons.views[at], ones, first, told)
            first = size.direction
        encode(lessons.lamps[at], ones, first, told)
        if size.extras:
            told[:, first + size.direction :] = np.hstack([lessons.seen[at], lessons.normals[at]])
        return told


def _by_cell(grid: VisionGrid, points: FloatArray, overlap: float, least: int) -> Callable[[int], IntArray]:
    """Which places each cell learns from: those in it, a little beyond its border, or the nearest."""
    owners, places = _owned((points - grid.low) / grid.cell, grid, overlap)
    starts = np.searchsorted(owners, np.arange(len(grid) + 1))
    tree: list[cKDTree] = []

    def taught(cell: int) -> IntArray:
        own = places[starts[cell] : starts[cell + 1]]
        if len(own) >= least:
            return own
        if not tree:
            tree.append(cKDTree(points))
        middle = grid.low + grid.cell * (grid.cells[cell] + 0.5)
        near = np.atleast_1d(tree[0].query(middle, min(least, len(points)))[1])
        return np.union1d(own, near)

    return taught


def _owned(scaled: FloatArray, grid: VisionGrid, overlap: float) -> tuple[IntArray, IntArray]:
    """Cells, ascending, and the places that are within ``overlap`` of each."""
    least, most = (np.floor(scaled + by).astype(np.int64) for by in (-overlap, overlap))
    owners, places = [], []
    for corner in np.ndindex(2, 2, 2):
        further = np.array(corner, np.bool_)
        # A place that is near no border along an axis is counted once.
        cells = np.where(further, most, least)
        there = np.flatnonzero(np.all(~further | (most != least), axis=1))
        inside = there[np.all((cells[there] >= 0) & (cells[there] < grid.shape), axis=1)]
        network = grid.table[tuple(cells[inside].T)]
        owners.append(network[network >= 0])
        places.append(inside[network >= 0])
    owner, place = np.concatenate(owners), np.concatenate(places)
    order = np.lexsort((place, owner))
    return owner[order].astype(np.int64), place[order]
